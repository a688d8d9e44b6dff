#include "core/robdef/parse/lexer.hpp"

#include <catch2/catch.hpp>

namespace rr::test {

namespace {

struct Lexed {
  std::vector<LogicalLine> lines = {};
  std::vector<Diagnostic> diagnostics = {};
};

Lexed lex(std::string_view text) {
  Lexed lexed;
  Reporter reporter(RobdefMode::strict, "x.robdef");
  LineReader reader(text, reporter);
  while (reader.peek() != nullptr) lexed.lines.push_back(reader.take());
  lexed.diagnostics = reporter.take();
  return lexed;
}

}  // namespace

TEST_CASE("lines are statements, documentation, comments or blank", "[robdef]") {
  const auto lexed = lex("service a\n\n \t\n# c\n\t## d #\n###\nlast");
  REQUIRE(lexed.lines.size() == 7);
  const LineKind kinds[] = {LineKind::statement,     LineKind::blank,         LineKind::blank,    LineKind::comment,
                            LineKind::documentation, LineKind::documentation, LineKind::statement};
  for (std::size_t i = 0; i < 7; ++i) {
    CHECK(lexed.lines[i].kind() == kinds[i]);
    CHECK(lexed.lines[i].line() == i + 1);
  }
  CHECK(lexed.lines[4].text() == " d #");
  CHECK(lexed.lines[5].text() == "#");
  CHECK(lexed.diagnostics.empty());
}

TEST_CASE("carriage returns go before a line feed or the end", "[robdef]") {
  const auto lexed = lex("a\r\nb\r\r\n\r\nc\r");
  REQUIRE(lexed.lines.size() == 4);
  CHECK(lexed.lines[0].text() == "a");
  CHECK(lexed.lines[1].text() == "b");
  CHECK(lexed.lines[2].kind() == LineKind::blank);
  CHECK(lexed.lines[3].text() == "c");
  CHECK(lexed.diagnostics.empty());
}

TEST_CASE("a backslash at the very end joins the next line, raw", "[robdef]") {
  const auto lexed = lex("one \\\n # two\\\n\\\nthree\nfour");
  REQUIRE(lexed.lines.size() == 2);
  CHECK(lexed.lines[0].text() == "one   # two  three");
  CHECK(lexed.lines[1].text() == "four");
  CHECK(lexed.lines[1].line() == 5);
  const auto span = lexed.lines[0].span(lexed.lines[0].text().find("two"), lexed.lines[0].text().find("two") + 3);
  CHECK(span.line == 1);
  CHECK(span.column_line == 2);
  CHECK(span.column == 4);
  CHECK(span.end_column == 7);
  const auto third = lexed.lines[0].span(lexed.lines[0].text().find("three"), lexed.lines[0].text().size());
  CHECK(third.column_line == 4);
  CHECK(third.column == 1);
}

TEST_CASE("comments and documentation never continue", "[robdef]") {
  const auto lexed = lex("# c \\\n## d \\\nx");
  REQUIRE(lexed.lines.size() == 3);
  CHECK(lexed.lines[1].text() == " d \\");
}

TEST_CASE("a byte order mark is left out with a warning", "[robdef]") {
  const auto lexed = lex("\xef\xbb\xbfservice a\n");
  REQUIRE(lexed.lines.size() == 1);
  CHECK(lexed.lines[0].text() == "service a");
  REQUIRE(lexed.diagnostics.size() == 1);
  CHECK(lexed.diagnostics[0].code == "interop");
  CHECK(lex("service a\n\xef\xbb\xbf\n").diagnostics[0].code == "bad-character");
}

TEST_CASE("illegal characters are reported where they stand", "[robdef]") {
  struct Case {
    std::string text;
    std::uint32_t line;
    std::uint32_t column_line;
    std::uint32_t column;
    std::string found;
  };
  for (const auto& item : {Case{"ab\x01", 1, 1, 3, "0x01"}, Case{"a\n# \xc3\xa9", 2, 2, 3, "0xc3"},
                           Case{std::string("a\n## \0", 6), 2, 2, 4, "0x00"}, Case{"a\\\nb\\\nc\x7f", 1, 3, 2, "0x7f"},
                           Case{"a\rb", 1, 1, 2, "0x0d"}}) {
    const auto lexed = lex(item.text);
    REQUIRE(lexed.diagnostics.size() == 1);
    const auto& found = lexed.diagnostics[0];
    CHECK(found.code == "bad-character");
    CHECK(found.line == item.line);
    CHECK(found.column_line == item.column_line);
    CHECK(found.column == item.column);
    CHECK(found.message.find(item.found) != std::string::npos);
    CHECK(lexed.lines.back().is_bad() == (lexed.lines.back().kind() == LineKind::statement));
  }
}

TEST_CASE("nothing continues the last line", "[robdef]") {
  for (const auto* text : {"a \\", "a \\\n", "a \\\nb\\"}) {
    const auto lexed = lex(text);
    REQUIRE(lexed.diagnostics.size() == 1);
    CHECK(lexed.diagnostics[0].code == "bad-continuation");
    CHECK(lexed.diagnostics[0].line == 1);
  }
  CHECK(lex("a \\\n\n").diagnostics.empty());
}

}  // namespace rr::test
