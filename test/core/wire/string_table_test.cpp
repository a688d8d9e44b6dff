#include "core/wire/string_table.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

using namespace rr;

namespace {

using Codes = std::vector<std::uint32_t>;
constexpr std::uint32_t none = StringCoder::inline_text;

/// The codes that the texts of one message get.
struct Coded {
  Coded(bool use_standard, bool use_local, std::vector<std::string> given)
      : texts(std::move(given)), coder(use_standard, use_local) {
    for (const auto& text : texts) codes.push_back(coder.note(text));
    coder.choose();
    for (auto& code : codes) code = coder.code_of(code);
  }
  std::string table() const {
    std::string out;
    coder.visit_local([&](std::uint32_t code, std::string_view text) {
      out += (out.empty() ? "" : ", ") + std::to_string(code) + " " + std::string(text);
    });
    return out;
  }

  std::vector<std::string> texts;  ///< which the coder borrows
  StringCoder coder;
  Codes codes;
};

}  // namespace

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

TEST_CASE("texts that come twice get odd codes, in the order of their first use") {
  Coded coded(false, true, {"member", "path", "member", "value", "once", "path", "value"});
  CHECK(coded.codes == Codes{1, 3, 1, 5, none, 3, 5});
  CHECK(coded.table() == "1 member, 3 path, 5 value");
  CHECK(coded.coder.local_size() == 3 * 2 + 6 + 4 + 5);
}

TEST_CASE("a local table makes its message smaller, or there is none") {
  CHECK(Coded(false, true, {"member", "path"}).table() == "");
  CHECK(Coded(false, true, {"xyz", "xyz"}).table() == "");  // 8 bytes inline; 7 and the table's count with a code
  CHECK(Coded(false, true, {"four", "four"}).table() == "1 four");
  CHECK(Coded(false, true, {"xyz", "xyz", "four", "four"}).table() == "1 xyz, 3 four");
  CHECK(Coded(false, true, {"x", "x", "x", "x"}).table() == "");
  CHECK(Coded(false, true, std::vector<std::string>(100, "")).table() == "");
}

TEST_CASE("the standard table goes before the local one") {
  CHECK(Coded(true, true, {"value", "", "twice", "twice", "once"}).codes == Codes{516, 0, 1, 1, none});
  CHECK(Coded(true, false, {"value", "twice", "twice"}).codes == Codes{516, none, none});
  CHECK(Coded(false, false, {"value", "value"}).codes == Codes{none, none});
}

TEST_CASE("texts above 128 bytes stay inline") {
  const std::string longest(128, 'x');
  const std::string longer(129, 'x');
  CHECK(Coded(true, true, {longer, longer, longest, longest}).codes == Codes{none, none, 1, 1});
}

TEST_CASE("the local table ends at exactly 1024 bytes and smaller texts still fit behind a refused one") {
  std::vector<std::string> texts;
  for (int i = 0; i < 8; ++i) texts.push_back(std::string(124, static_cast<char>('a' + i)));
  texts.push_back(std::string(15, 'z'));
  texts.push_back("fourteen bytes");
  texts.push_back("yyyy");
  const auto once = texts;
  texts.insert(texts.end(), once.begin(), once.end());
  const Coded coded(false, true, texts);
  CHECK(coded.coder.local_size() == 1024);
  CHECK(coded.codes[7] == 15u);
  CHECK(coded.codes[8] == none);  // 8 * 126 bytes are used, 16 are left
  CHECK(coded.codes[9] == 17u);
  CHECK(coded.codes[10] == none);
}

TEST_CASE("as many texts as are counted are told apart, those behind them stay inline") {
  std::vector<std::string> texts;
  for (int i = 0; i < 2000; ++i) texts.push_back("text " + std::to_string(i));
  for (int i = 0; i < 2000; ++i) texts.push_back("text " + std::to_string(i));
  const Coded coded(false, true, texts);
  CHECK(coded.coder.local_size() <= 1024);
  CHECK(coded.coder.local_count() > 80);
  std::vector<std::string> known(2 * coded.coder.local_count());
  coded.coder.visit_local([&](std::uint32_t code, std::string_view text) { known[code] = text; });
  for (std::size_t i = 0; i < 2000; ++i) {
    CHECK(coded.codes[i] == coded.codes[i + 2000]);
    if (coded.codes[i] != none) CHECK(known[coded.codes[i]] == texts[i]);
    if (i >= StringCoder::max_texts) CHECK(coded.codes[i] == none);
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
