#include "core/wire/message.hpp"

#include <catch2/catch.hpp>
#include <string>

using namespace rr;

TEST_CASE("a message is built in pre-order and read by siblings") {
  Message message;
  message.begin_entry(EntryType::function_call_req, "svc", "f", 1);
  message.add_scalar("a", DataType::int32_t, std::int32_t{7});
  message.begin_nested("s", DataType::structure_t, "t.S");
  message.add_text("x", "inner");
  message.begin_nested("l", DataType::list_t);
  message.add_numbered(0, DataType::void_t, 0, {});
  message.end_nested();
  message.end_nested();
  message.add_text("b", "last");
  message.begin_entry(EntryType::property_get_req, "svc", "p", 2);

  REQUIRE(message.entries.size() == 2);
  const auto elements = message.elements_of(message.entries[0]);
  CHECK(elements.size() == 3);
  std::string names;
  for (const auto& element : elements) names += element.name;
  CHECK(names == "asb");
  REQUIRE(elements.find("b") != nullptr);
  CHECK(elements.find("b")->text() == "last");
  CHECK(elements.find("x") == nullptr);
  CHECK(load<std::int32_t>(elements.find("a")->data.data()) == 7);

  const auto children = message.children_of(*elements.find("s"));
  CHECK(children.size() == 2);
  CHECK(children.find("x")->text() == "inner");
  CHECK(message.children_of(*children.find("l")).size() == 1);
  CHECK(message.children_of(*children.find("x")).empty());
  CHECK(message.elements_of(message.entries[1]).empty());
}

TEST_CASE("find looks at names only") {
  Message message;
  message.begin_entry(EntryType::null, "", "");
  message.add_numbered(1, DataType::void_t, 0, {});
  CHECK(message.elements_of(message.entries[0]).find("") == nullptr);
}

TEST_CASE("stored bytes stay where they are while more is stored") {
  Message message;
  std::vector<std::string_view> texts;
  for (int i = 0; i < 3000; ++i) texts.push_back(message.store(std::string_view(std::to_string(i))));
  const std::string large(100'000, 'x');
  texts.push_back(message.store(std::string_view(large)));
  for (std::size_t i = 0; i < 3000; ++i) REQUIRE(texts[i] == std::to_string(i));
  CHECK(texts.back() == large);
  CHECK(message.store(ByteSpan{}).empty());
}

TEST_CASE("clear keeps nothing of the message") {
  Message message;
  message.header.version = 2;
  message.header.priority = std::uint16_t{1};
  message.begin_entry(EntryType::null, "", "");
  message.begin_nested("open", DataType::list_t);
  const auto owner = std::make_shared<int>(1);
  message.keep_alive(owner);
  message.clear();
  CHECK(owner.use_count() == 1);
  CHECK(message.header.version == 4);
  CHECK_FALSE(message.header.priority);
  message.begin_entry(EntryType::null, "", "");
  message.add_text("top", "level");
  CHECK(message.entries[0].element_count == 1);
}

TEST_CASE("clear gives back the elements of a huge message") {
  Message message;
  message.begin_entry(EntryType::null, "", "");
  for (int i = 0; i < 100'000; ++i) message.add_numbered(i, DataType::void_t, 0, {});
  message.clear();
  CHECK(message.elements.capacity() < 20'000);
}
