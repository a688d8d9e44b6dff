// Which text goes to which statement (service definitions spec section 5.1).
#include <catch2/catch.hpp>

#include "test/core/robdef/checked.hpp"

namespace rr::test {

TEST_CASE("documentation goes to everything that can carry it", "[robdef]") {
  auto checked = check(
      "## the service\n## of arms\nservice demo.a\nstdver 0.10\n"
      "## limit\nconstant int32 LIMIT 3\n"
      "## mode\nenum Mode\n    ## off value\n    off = 0, on,\n    ## later\n\n    third\nend\n"
      "## jam\nexception Jam\n"
      "## arm\nobject Arm\n    ## rate\n    constant int32 RATE 1\n    ## angle\n    property double angle\n    ## "
      "end\nend\n"
      "## lost at the end\n");
  REQUIRE(checked.ok());
  const auto& definition = checked.first();
  CHECK(definition.documentation == " the service\n of arms");
  CHECK(definition.constants[0].documentation == " limit");
  CHECK(definition.enums[0].documentation == " mode");
  CHECK(definition.enums[0].values[0].documentation == " off value");
  CHECK(definition.enums[0].values[1].documentation.empty());
  CHECK(definition.enums[0].values[2].documentation == " later");
  CHECK(definition.exceptions[0].documentation == " jam");
  CHECK(definition.entities[0].documentation == " arm");
  CHECK(definition.entities[0].constants[0].documentation == " rate");
  CHECK(definition.entities[0].members[0].documentation == " angle");
}

TEST_CASE("a gap keeps documentation unless more follows", "[robdef]") {
  CHECK(check_body("## a\n\n\nstruct S\nend\n").first().entities[0].documentation == " a");
  CHECK(check_body("## a\n\n## b\n##\n## c\nstruct S\nend\n").first().entities[0].documentation == " b\n\n c");
}

TEST_CASE("comments discard documentation outside of blocks only", "[robdef]") {
  CHECK(check_body("## a\n# c\nstruct S\nend\n").first().entities[0].documentation.empty());
  CHECK(check_body("struct S\n## a\n# c\nfield double x\nend\n").first().entities[0].members[0].documentation == " a");
  CHECK(check_body("struct S\n## a\n# c\n## b\nfield double x\nend\n").first().entities[0].members[0].documentation ==
        " b");
}

TEST_CASE("statements without documentation drop it", "[robdef]") {
  const std::vector<std::string> imports = {"service demo.b\nstdver 0.10\n"};
  CHECK(check_body("## a\nimport demo.b\nstruct S\nend\n", RobdefMode::strict, imports)
            .first()
            .entities[0]
            .documentation.empty());
  CHECK(check("service demo.a\n## a\noption x\nstruct S\nend\n").first().entities[0].documentation.empty());
  CHECK(check_body("object B\nend\nobject A\n## a\nimplements B\nproperty double x\nend\n")
            .first()
            .entities[1]
            .members[0]
            .documentation.empty());
}

TEST_CASE("documentation that ends in a backslash is kept, with a warning inside a block", "[robdef]") {
  auto checked = check_body("## top \\\nstruct S\n    ## inner \\\n    field double x\nend\n");
  REQUIRE(checked.ok());
  CHECK(checked.first().entities[0].documentation == " top \\");
  CHECK(checked.first().entities[0].members.at(0).documentation == " inner \\");
  REQUIRE(checked.warnings().size() == 1);
  CHECK(checked.warnings()[0].code == "interop");
  CHECK(checked.warnings()[0].line == 5);
}

}  // namespace rr::test
