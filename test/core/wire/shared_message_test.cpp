// A message that many are sent: to each the same bytes as if it alone had been sent it.

#include "core/wire/shared_message.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "test/core/wire/vectors.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

constexpr StringTableMode modes[] = {{false, false}, {true, false}, {false, true}, {true, true}};

/// Wire packets of a small and of a large value: the latter is referenced.
void write(Message& message, const std::vector<double>& values) {
  message.header.metadata = "unreliable\n";
  message.begin_entry(EntryType::wire_packet, "arm", "torque").metadata = "unreliable\n";
  message.begin_nested("packettime", DataType::structure_t, "RobotRaconteur.TimeSpec");
  message.add_scalar("seconds", DataType::int64_t, std::int64_t{1});
  message.end_nested();
  message.add("packet", DataType::double_t, static_cast<std::uint32_t>(values.size()),
              {reinterpret_cast<const std::uint8_t*>(values.data()), values.size() * sizeof(double)});
}

/// As Connection sets it.
void address(MessageHeader& header, std::uint16_t message_id, bool has_addresses, std::uint16_t version = 4) {
  header.version = version;
  header.message_id = message_id;
  header.has_routing = header.has_endpoints = has_addresses;
  header.sender_endpoint = 7u * message_id;
}

std::string alone(const Message& message, const EncodeOptions& options) {
  EncodedMessage encoded;
  REQUIRE(encode(message, options, encoded));
  return to_hex(encoded.to_bytes());
}

}  // namespace

TEST_CASE("every receiver of a shared message gets the bytes that it would get alone") {
  const std::vector<double> values(GENERATE(std::size_t{3}, std::size_t{1000}), 0.5);
  SharedMessage shared;
  write(shared.message, values);
  std::vector<EncodedMessage> sent;
  std::vector<std::string> expected;
  const auto send = [&](std::uint16_t message_id, bool has_addresses, std::uint16_t version, StringTableMode mode) {
    const EncodeOptions options{.string_table = mode};
    address(shared.message.header, message_id, has_addresses, version);
    expected.push_back(alone(shared.message, options));
    REQUIRE(shared.encode(options, sent.emplace_back()));
    const auto* lent = shared.lend(options).value();
    CHECK((lent != nullptr) == (version == 4 && !has_addresses && message_id != 0));
    if (lent) CHECK(to_hex(lent->to_bytes()) == expected.back());
  };
  for (const auto mode : modes)
    for (const std::uint16_t message_id : std::initializer_list<std::uint16_t>{1, 0, 65535, 258, 3})
      send(message_id, false, 4, mode);
  send(4, true, 4, modes[3]);
  send(5, true, 2, modes[0]);
  send(6, false, 4, modes[3]);
  REQUIRE(sent.size() == expected.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    INFO("receiver " << i);
    CHECK(to_hex(sent[i].to_bytes()) == expected[i]);
    if (values.size() == 1000) CHECK(sent[i].slices().back().data() == sent[0].slices().back().data());
  }
}

TEST_CASE("every receiver of a shared message gets its own number") {
  const std::vector<double> values(GENERATE(std::size_t{3}, std::size_t{1000}), 0.5);
  std::uint32_t number = 0;
  const ByteSpan bytes(reinterpret_cast<const std::uint8_t*>(&number), sizeof(number));
  SharedMessage shared;
  write(shared.message, values);
  shared.message.add("number", DataType::uint32_t, 1, bytes);
  shared.own_number = bytes;
  EncodedMessage sent;
  for (number = 1; number < 1'000'000; number *= 11) {
    address(shared.message.header, static_cast<std::uint16_t>(number % 7), false);
    REQUIRE(shared.encode({}, sent));
    CHECK(to_hex(sent.to_bytes()) == alone(shared.message, {}));
    if (const auto* lent = shared.lend({}).value()) CHECK(to_hex(lent->to_bytes()) == alone(shared.message, {}));
  }
}

TEST_CASE("a shared message keeps what it references for the last of its receivers") {
  auto values = std::make_shared<std::vector<double>>(1000, 0.5);
  const std::weak_ptr<const void> alive = values;
  EncodedMessage sent;
  {
    SharedMessage shared;
    write(shared.message, *values);
    shared.message.keep_alive(std::move(values));
    for (const std::uint16_t message_id : std::initializer_list<std::uint16_t>{1, 2}) {
      address(shared.message.header, message_id, false);
      REQUIRE(shared.encode({}, sent));
    }
  }
  CHECK_FALSE(alive.expired());
  CHECK(to_hex(sent.slices().back()).starts_with("000000000000e03f"));
  sent.clear();
  CHECK(alive.expired());
}

TEST_CASE("each receiver's limit holds for a shared message") {
  const std::vector<double> values(100, 0.5);
  SharedMessage shared;
  write(shared.message, values);
  address(shared.message.header, 1, false);
  EncodedMessage sent;
  REQUIRE(shared.encode({}, sent));
  for (const std::size_t limit : {sent.size(), sent.size() - 1}) {
    address(shared.message.header, 2, false);
    EncodedMessage second;
    const auto done = shared.encode({.max_message_size = limit}, second);
    CHECK(static_cast<bool>(done) == (limit == sent.size()));
    if (!done)
      CHECK(done.error().message ==
            "encode: message has " + std::to_string(sent.size()) + " bytes, limit " + std::to_string(limit));
  }
}
