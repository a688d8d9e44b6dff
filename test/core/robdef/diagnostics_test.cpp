// The texts and places of diagnostics.
#include <catch2/catch.hpp>

#include "test/core/robdef/checked.hpp"

namespace rr::test {

namespace {

std::string first_error(const Checked& checked) {
  REQUIRE_FALSE(checked.errors().empty());
  return format_diagnostic(checked.errors()[0]);
}

}  // namespace

TEST_CASE("diagnostics say where, what was found and what was expected", "[robdef]") {
  struct Case {
    const char* body;
    const char* expected;
  };
  for (const auto& item : {
           Case{"object Arm\n    property double angle[readonly]\nend\n",
                "demo.a:4:26: error: found '[', expected a blank before the modifiers [syntax]"},
           Case{"object Arm\n    property double angle # radians\nend\n",
                "demo.a:4:27: error: found '#', expected the end of the statement or modifiers (comments take lines of "
                "their own) [syntax]"},
           Case{"struct S\n    field double[3, 3] x\nend\n",
                "demo.a:4:20: error: found ' ', expected a size: decimal digits [syntax]"},
           Case{"struct S\n    field double{lst} x\nend\n",
                "demo.a:4:17: error: found '{lst}', expected a container: {list}, {int32}, {string} or {generator} "
                "[syntax]"},
           Case{"struct S\n    field double\nend\n",
                "demo.a:4:17: error: found the end of the statement, expected the name of the member [syntax]"},
           Case{"struct S\n    property double x\nend\n",
                "demo.a:4:5: error: found 'property', expected field, constant, option or end [syntax]"},
           Case{"constant int16 K 40000\n",
                "demo.a:3:18: error: constant 'K': found '40000', expected -32768 to 32767 for int16 [constant-range]"},
           Case{"constant string K \"a\\qb\"\n",
                "demo.a:3:21: error: constant 'K': found the escape '\\\\q', expected one of \\\" \\\\ \\/ \\b \\f \\n "
                "\\r \\t or \\u with four hex digits "
                "[constant-invalid]"},
           Case{"struct S\n    field Unknwn x\nend\n",
                "demo.a:4:11: error: found the unknown name 'Unknwn', expected a type of this definition or an alias "
                "[type-unknown]"},
           Case{"struct S\n    field string[] x\nend\n",
                "demo.a:4:11: error: field 'x' of 'S': found the type 'string[]', expected no array of it; use {list} "
                "[type-not-allowed]"},
           Case{"object Arm\n    property double get_x\nend\n",
                "demo.a:4:21: error: found the reserved name 'get_x', expected another [name-reserved]"},
           Case{
               "import demo.gone\n",
               "demo.a:3:8: error: found the import of 'demo.gone', but no such definition was given [import-missing]"},
           Case{"stdver 0.8\n",
                "demo.a:3:8: error: found '0.8', expected a version of 0.9 or more, such as 0.10 [version-format]"},
           Case{"struct S\n", "demo.a:3:1: error: found no 'end' for this struct, expected one [unclosed-block]"},
       }) {
    CHECK(first_error(check_body(item.body)) == item.expected);
  }
}

TEST_CASE("columns of a statement of several lines lie where the error is", "[robdef]") {
  const auto parsed =
      check_body("object Arm\n    function void move( \\\n        double a, \\\n        doub*le b)\nend\n");
  CHECK(first_error(parsed) ==
        "demo.a:6:13: error: found '*', expected a blank and the name of the parameter [syntax]\n  line 4: the "
        "statement begins here");
  CHECK(parsed.errors()[0].line == 4);
  const auto verified = check_body("object Arm\n    function void move(double a, \\\n        Gone b)\nend\n");
  CHECK(verified.errors()[0].line == 4);
  CHECK(verified.errors()[0].column_line == 5);
  CHECK(verified.errors()[0].column == 9);
  CHECK(verified.errors()[0].end_column == 13);
}

TEST_CASE("notes name the other places", "[robdef]") {
  CHECK(first_error(check_body("struct A\nend\nobject A\nend\n")) ==
        "demo.a:5:8: error: found the name 'A' again in this definition, expected it once [duplicate-name]\n  line 3: "
        "'A' is first declared here");
  const auto checked = check_body("object B\n    wire double w\nend\nobject D\n    implements B\nend\n");
  REQUIRE(checked.errors().size() == 1);
  CHECK(checked.errors()[0].line == 6);
  REQUIRE(checked.errors()[0].notes.size() == 1);
  CHECK(checked.errors()[0].notes[0].line == 7);
}

TEST_CASE("the file comes before the service name", "[robdef]") {
  const auto result = parse_service_definition("service demo.a\nbogus\n", RobdefMode::strict, "dir/a.robdef");
  REQUIRE(result.diagnostics.size() == 1);
  CHECK(format_diagnostic(result.diagnostics[0])
            .starts_with("dir/a.robdef:2:1: error: found 'bogus', expected a statement"));
  CHECK(result.diagnostics[0].service == "demo.a");
  CHECK(format_diagnostic(parse_service_definition("", RobdefMode::strict).diagnostics[0]) ==
        "definition:1: error: found no statement, expected 'service' and the name of the service [no-service]");
}

TEST_CASE("hostile words are quoted and shortened", "[robdef]") {
  const auto message = check_body(std::string(5000, 'x') + "\n").errors().at(0).message;
  CHECK(message.size() < 300);
  CHECK(message.find("5000 bytes") != std::string::npos);
}

TEST_CASE("errors and warnings are cut off, each at its limit", "[robdef]") {
  std::string body;
  for (int i = 0; i < 3000; ++i) body += "bogus\n";
  CHECK(check_body(body).errors().size() == max_diagnostics + 1);
  CHECK(check_body(body).errors().back().code == "too-many");
  std::string options = "service demo.a\n";
  for (int i = 0; i < 3000; ++i) options += "option x\n";
  const auto checked = check(options + "bogus\n");
  CHECK(checked.warnings().size() == max_diagnostics + 1);
  CHECK(checked.errors().size() == 1);
}

TEST_CASE("verification errors come by line", "[robdef]") {
  const auto checked =
      check_body("object Arm\n    property Gone a\n    property double rrx\n    memory double m\nend\n");
  REQUIRE(checked.errors().size() == 3);
  CHECK(checked.errors()[0].line == 4);
  CHECK(checked.errors()[1].line == 5);
  CHECK(checked.errors()[2].line == 6);
}

}  // namespace rr::test
