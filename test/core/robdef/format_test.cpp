// The canonical text. The expected texts are those that Robot Raconteur 1.2.9 prints for the same definitions.
#include <catch2/catch.hpp>

#include "test/core/robdef/checked.hpp"
#include "test/support/is_equal.hpp"

namespace rr::test {

namespace {

std::string canonical(std::string_view text, RobdefMode mode = RobdefMode::strict) {
  const auto result = parse_service_definition(text, mode);
  for (const auto& item : result.diagnostics) UNSCOPED_INFO(format_diagnostic(item));
  CHECK(result.ok());
  return format_service_definition(result.definition);
}

}  // namespace

TEST_CASE("the canonical text has one form and one order", "[robdef]") {
  const auto printed = canonical(
      "## doc\n  service  demo.a \n\nstdver 0.10.0.0\n\n# comment\nimport demo.lib\n"
      "using  demo.lib.Pose as Place\nusing demo.lib.Tool\n"
      "exception Jam\n"
      "constant   double[]  GAINS   {1,  2.5 } \n"
      "enum Mode\n  off=-1,on\\\n, fast=0x1F,\n  faster, none = -0x0F,,\nend\n"
      "exception Late\n"
      "enum Empty\nend\n"
      "object Arm\n  constant int32 RATE 4\n  implements  demo.lib.Tool\n"
      "  function   void  move ( double a ,demo.lib.Pose[03] b )   [ urgent , rate( RATE , 0x2 ), ]\n"
      "  event moved( )\n  property Place{list} places\nend\n"
      "struct S\n  field double[3,] x\nend\n"
      "pod P\nend\n");
  CHECK(printed ==
        "service demo.a\n\nstdver 0.10\n\nimport demo.lib\n\nusing demo.lib.Pose as Place\nusing demo.lib.Tool\n\n"
        "constant double[] GAINS {1,  2.5 }\n\n"
        "enum Mode\n    off = -1,\n    on,\n    fast = 0x1f,\n    faster,\n    none = -0xf\nend\n\n"
        "enum Empty\n\nend\n\n\n"
        "exception Jam\nexception Late\n\n"
        "struct S\n    field double[3,] x\nend\n\n"
        "pod P\nend\n\n"
        "object Arm\n    implements Tool\n    constant int32 RATE 4\n"
        "    function void move(double a, Place[3] b) [urgent,rate( RATE , 0x2 )]\n"
        "    event moved()\n    property Place{list} places\nend\n\n");
}

TEST_CASE("versions and options print in the order that peers read", "[robdef]") {
  CHECK(canonical("service a") == "service a\n\n");
  CHECK(canonical("service a\nstdver 0.9\noption  x  y \n") == "service a\n\nstdver 0.9\n\noption x  y\n\n");
  CHECK(canonical("service a\noption version 0.8\noption b\n") == "service a\n\noption version 0.8\noption b\n\n");
  CHECK(canonical("service a\noption x\nstdver 0.10\n", RobdefMode::compat) ==
        "service a\n\noption x\n\nstdver 0.10\n\n");
  ServiceDefinition built;
  built.name = "a";
  built.version = {0, 8, 0, 0};
  CHECK(format_service_definition(built) == "service a\n\noption version 0.8\n\n");
}

TEST_CASE("names print by their first alias, own names without the service", "[robdef]") {
  CHECK(canonical("service a\nimport b\nusing b.T as X\nusing b.T as Y\nstruct S\nfield Y y\nfield b.T t\nfield b.U "
                  "u\nfield a.S s\nend\n",
                  RobdefMode::compat) ==
        "service a\n\nimport b\n\nusing b.T as X\nusing b.T as Y\n\nstruct S\n    field X y\n    field X t\n    field "
        "b.U u\n    field S s\nend\n\n");
}

TEST_CASE("array sizes print as they are", "[robdef]") {
  CHECK(canonical("service a\nstruct S\nfield double[0] x\nfield double[0-] y\nfield double[007-] z\nend\n",
                  RobdefMode::compat) ==
        "service a\n\nstruct S\n    field double[0] x\n    field double[] y\n    field double[7-] z\nend\n\n");
}

TEST_CASE("equality is blind to what the canonical text loses", "[robdef]") {
  const auto parse = [](const char* text) { return parse_service_definition(text, RobdefMode::compat).definition; };
  const auto base = parse(
      "service a\nimport b\nusing b.T\nconstant int32 K 1\nenum E\nx = 1,\ny\nend\nexception X\nstruct S\nfield T "
      "t\nend\nobject O\nconstant int32 K 2\nwire S w [readonly]\nend\n");
  CHECK(is_equal(
      base,
      parse("## d\nservice a\n\nimport b\nusing b.T\nexception X\n# c\nenum E\nx = 1,\ny\nend\nconstant int32  K  1 "
            "\nobject O\nconstant int32 K 2\nwire S w [ readonly, ]\nend\nstruct S\nfield b.T t\nend struct\n")));
  for (const auto* other : {
           "service a\n",
           "service a\nimport b\nusing b.T as U\nconstant int32 K 1\nenum E\nx = 1,\ny\nend\nexception X\nstruct "
           "S\nfield U t\nend\nobject O\nconstant int32 K 2\nwire S w [readonly]\nend\n",
           "service a\nimport b\nusing b.T\nconstant int32 K 0x1\nenum E\nx = 1,\ny\nend\nexception X\nstruct S\nfield "
           "T t\nend\nobject O\nconstant int32 K 2\nwire S w [readonly]\nend\n",
           "service a\nimport b\nusing b.T\nconstant int32 K 1\nenum E\nx = 1,\ny = 2\nend\nexception X\nstruct "
           "S\nfield T t\nend\nobject O\nconstant int32 K 2\nwire S w [readonly]\nend\n",
           "service a\nimport b\nusing b.T\nconstant int32 K 1\nenum E\nx = 1,\ny\nend\nexception X\nstruct S\nfield T "
           "t\nend\nobject O\nconstant int32 K 2\nwire S w\nend\n",
           "service a\nimport b\nusing b.T\nconstant int32 K 1\nenum E\nx = 1,\ny\nend\nexception X\nstruct S\nfield "
           "T{list} t\nend\nobject O\nconstant int32 K 2\nwire S w [readonly]\nend\n",
       }) {
    CHECK_FALSE(is_equal(base, parse(other)));
  }
}

}  // namespace rr::test
