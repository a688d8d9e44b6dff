// The layout for authors, which keeps what the canonical text loses.
#include <catch2/catch.hpp>

#include "core/robdef/format/format_source.hpp"
#include "test/core/robdef/checked.hpp"
#include "test/support/golden.hpp"

namespace rr::test {

namespace {

ServiceDefinition parsed(std::string_view text) {
  const auto result = parse_service_definition(text, RobdefMode::strict);
  for (const auto& item : result.diagnostics) UNSCOPED_INFO(format_diagnostic(item));
  CHECK(result.ok());
  return result.definition;
}

std::string laid_out(std::string_view text) {
  return format_source(parsed(text));
}

}  // namespace

TEST_CASE("the layout keeps comments, documentation, order and groups", "[robdef]") {
  CHECK(laid_out("\n\n  ## What it is. \n  service   demo.a\n\n\n\n stdver  0.10.0\n# why\n"
                 "import   demo.b\nusing demo.b.T  as   U\n constant int32[]  N   { 1,  2 }\n"
                 "exception Jam\nenum Mode\n a=1,b,\n## last\n c = 0x1F\nend\n"
                 "object Arm  \n# inside\n\tconstant  int32 X 5\n\n   ## moves\n"
                 "  function void  move ( double  a,U b )  [ urgent ]\n property  U{list}  us\nend \n\n") ==
        "## What it is.\nservice demo.a\n\nstdver 0.10\n# why\nimport demo.b\nusing demo.b.T as U\n"
        "constant int32[] N { 1,  2 }\nexception Jam\nenum Mode\n    a = 1,\n    b,\n    ## last\n    c = 0x1f\nend\n"
        "object Arm\n    # inside\n    constant int32 X 5\n\n    ## moves\n"
        "    function void move(double a, U b) [urgent]\n    property U{list} us\nend\n");
}

TEST_CASE("members that are too long are wrapped, and unwrapped where they fit", "[robdef]") {
  const std::string head = "service demo.a\nstdver 0.10\nobject Arm\n";
  CHECK(laid_out(head + "function void \\\n f( \\\n int32 a)\nend\n") == head + "    function void f(int32 a)\nend\n");
  CHECK(laid_out(head + "function void move_everything(double the_first_parameter, double the_second_parameter, "
                        "double the_third_parameter) [urgent]\nend\n") ==
        head +
            "    function void move_everything(double the_first_parameter, double \\\n"
            "        the_second_parameter, double the_third_parameter) [urgent]\nend\n");
}

TEST_CASE("the layout is stable and changes nothing that counts", "[robdef]") {
  for (const auto& item : read_golden_json("robdef/robdef-cases.json")) {
    if (!item.at("valid").get<bool>()) continue;
    const auto source = parsed(item.at("text").get<std::string>());
    const auto text = format_source(source);
    INFO(item.at("name") << "\n" << source.text << "\n" << text);
    const auto again = parsed(text);
    CHECK(format_service_definition(again) == format_service_definition(source));
    CHECK(format_source(again) == text);
  }
}

}  // namespace rr::test
