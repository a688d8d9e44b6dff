#include "core/wire/string_table.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

using namespace rr;

TEST_CASE("the standard table has 113 codes, all multiples of 4, with a gap from 312 to 508") {
  int count = 0;
  for (std::uint32_t code = 0; code < 1000; ++code) {
    const bool is_listed = code % 4 == 0 && (code <= 308 || (code >= 512 && code <= 648));
    INFO(code);
    CHECK(standard_text(code).has_value() == is_listed);
    count += is_listed;
  }
  CHECK(count == 113);
  CHECK_FALSE(standard_text(0xfffffffc));
}

TEST_CASE("standard texts stand at the codes of the specification") {
  const std::pair<std::uint32_t, const char*> rows[] = {{0, ""},
                                                        {4, "array"},
                                                        {44, "credentials"},
                                                        {48, "data"},
                                                        {92, "index"},
                                                        {96, "Length"},
                                                        {136, "nodeid"},
                                                        {140, "nodeid"},
                                                        {144, "nodename"},
                                                        {172, "packet"},
                                                        {188, "password"},
                                                        {192, "pause"},
                                                        {236, "robotraconteur"},
                                                        {268, "ServiceIndex"},
                                                        {308, "urgent"},
                                                        {512, "username"},
                                                        {516, "value"},
                                                        {548, "Name"},
                                                        {588, "ServiceIndex"},
                                                        {596, "ServiceInfo"},
                                                        {600, "node"},
                                                        {648, "fiberid"},
                                                        {244, "RobotRaconteur.TimeSpec"}};
  for (const auto& [code, text] : rows) CHECK(standard_text(code) == std::string_view(text));
}

TEST_CASE("every standard text is found again, at its lowest code") {
  for (std::uint32_t code = 0; code <= 648; code += 4) {
    const auto text = standard_text(code);
    if (!text) continue;
    INFO(*text);
    const std::uint32_t expected = code == 140 ? 136 : code == 588 ? 268 : code;
    CHECK(standard_code(*text) == expected);
  }
  CHECK_FALSE(standard_code("Value"));
  CHECK_FALSE(standard_code("value "));
}

TEST_CASE("local texts get odd codes in the order of their first use") {
  StringCoder coder(false, true);
  CHECK(coder.code_for("member") == 1u);
  CHECK(coder.code_for("path") == 3u);
  CHECK(coder.code_for("member") == 1u);
  CHECK(coder.code_for("value") == 5u);
  REQUIRE(coder.local_count() == 3);
  CHECK(coder.local_text(1) == "path");
  CHECK(coder.local_size() == 3 * 2 + 6 + 4 + 5);
}

TEST_CASE("the standard table goes before the local one") {
  StringCoder both(true, true);
  CHECK(both.code_for("value") == 516u);
  CHECK(both.code_for("") == 0u);
  CHECK(both.code_for("x") == 1u);
  StringCoder standard_only(true, false);
  CHECK(standard_only.code_for("value") == 516u);
  CHECK_FALSE(standard_only.code_for("x"));
  StringCoder none(false, false);
  CHECK_FALSE(none.code_for("value"));
}

TEST_CASE("texts above 128 bytes stay inline") {
  StringCoder coder(true, true);
  CHECK_FALSE(coder.code_for(std::string(129, 'x')));
  const std::string longest(128, 'x');
  CHECK(coder.code_for(longest) == 1u);
}

TEST_CASE("the local table ends at exactly 1024 bytes and smaller texts still fit behind a refused one") {
  StringCoder coder(false, true);
  std::vector<std::string> texts;
  for (int i = 0; i < 8; ++i) texts.push_back(std::string(124, static_cast<char>('a' + i)));
  texts.push_back(std::string(15, 'z'));
  for (int i = 0; i < 8; ++i) CHECK(coder.code_for(texts[static_cast<std::size_t>(i)]));
  CHECK(coder.local_size() == 8 * 126);  // 16 bytes are left
  CHECK_FALSE(coder.code_for(texts[8]));
  CHECK(coder.code_for("fourteen bytes") == 17u);
  CHECK(coder.local_size() == 1024);
  CHECK_FALSE(coder.code_for("y"));
  CHECK(coder.code_for(texts[0]) == 1u);
}

TEST_CASE("as many short texts as the table can hold are told apart") {
  std::vector<std::string> texts;
  for (int i = 0; i < 2000; ++i) texts.push_back(std::to_string(i));
  StringCoder coder(false, true);
  std::vector<std::optional<std::uint32_t>> codes;
  for (const auto& text : texts) codes.push_back(coder.code_for(text));
  CHECK(coder.local_size() <= 1024);
  CHECK(coder.local_count() > 150);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    CHECK(coder.code_for(texts[i]) == codes[i]);
    if (codes[i]) CHECK(coder.local_text(*codes[i] / 2) == texts[i]);
  }
}

TEST_CASE("of a code that a received table lists twice the first text counts") {
  const std::string texts = "firstsecondother";
  const std::string_view view = texts;
  LocalTexts table;
  table.add(7, view.substr(0, 5));
  table.add(1, view.substr(11));
  table.add(7, view.substr(5, 6));
  table.sort();
  CHECK(table.find(7) == std::string_view("first"));
  CHECK(table.find(1) == std::string_view("other"));
  CHECK_FALSE(table.find(3));
  CHECK_FALSE(table.find(9));
}
