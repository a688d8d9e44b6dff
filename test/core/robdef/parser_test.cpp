// The model that a text gives, and recovery after errors.
#include <catch2/catch.hpp>

#include "test/core/robdef/checked.hpp"

namespace rr::test {

namespace {

std::vector<std::uint32_t> error_lines(const Checked& checked) {
  std::vector<std::uint32_t> lines;
  for (const auto& error : checked.errors()) lines.push_back(error.line);
  return lines;
}

using Lines = std::vector<std::uint32_t>;

}  // namespace

TEST_CASE("a definition becomes its model", "[robdef]") {
  auto checked = check_body(
      "import demo.lib\n"
      "using demo.lib.Pose as Place\n"
      "exception Jam\n"
      "constant double[] GAINS {1, 2.5}\n"
      "enum Mode\n    off = -1, on,\n    fast = 0x10, faster\nend\n"
      "struct Reading\n    field Place{list} places\n    field double[3,4] grid\n    field double[7,] column\nend\n"
      "object Arm\n"
      "    implements demo.lib.Tool\n"
      "    constant int32 RATE 4\n"
      "    property uint8[16-] key [ writeonly , nolock ]\n"
      "    function varvalue{string} ask ( string what , int32{list} list )  [urgent]\n"
      "    function double{generator} scan(int32 n, double{generator} feed)\n"
      "    event moved()\n"
      "    objref Arm{string} parts\n"
      "    wire Mode mode [readonly,rate(RATE, 0x2)]\n"
      "    memory Reading2[*] cells\n"
      "end\n"
      "pod Reading2\nend\n",
      RobdefMode::strict, {"service demo.lib\nstdver 0.9\nstruct Pose\nend\nobject Tool\nend\n"});
  INFO(checked.report());
  REQUIRE(checked.ok());
  const auto& definition = checked.first();
  CHECK(definition.name == "demo.a");
  CHECK(definition.line == 1);
  CHECK(definition.version_line == 2);
  CHECK(definition.version == Version{0, 10, 0, 0});
  CHECK_FALSE(definition.version_is_option);
  CHECK(definition.imports.at(0).name == "demo.lib");
  CHECK(definition.usings.at(0).qualified_name == "demo.lib.Pose");
  CHECK(definition.usings.at(0).alias == "Place");
  CHECK(definition.find_exception("Jam")->line == 5);
  CHECK(definition.constants.at(0).value_text == "{1, 2.5}");
  const auto& values = definition.find_enum("Mode")->values;
  REQUIRE(values.size() == 4);
  CHECK(values[1].value == 0);
  CHECK(values[1].is_implicit);
  CHECK(values[3].value == 17);
  CHECK(values[3].is_hex);
  CHECK(values[3].line == 9);
  const auto* const reading = definition.find_entity("Reading");
  CHECK(reading->kind == EntityKind::structure);
  const auto& places = reading->members.at(0).type;
  CHECK(places.type == DataType::structure_t);
  CHECK(places.name == "Place");
  CHECK(places.qualified_name == "demo.lib.Pose");
  CHECK(places.container == ContainerKind::list);
  CHECK(reading->members.at(1).type.array == ArrayKind::fixed_multidim);
  CHECK(reading->members.at(1).type.sizes == std::vector<std::int32_t>{3, 4});
  CHECK(reading->members.at(2).type.sizes == std::vector<std::int32_t>{7});
  const auto* const arm = definition.find_entity("Arm");
  CHECK(arm->implements.at(0).qualified_name == "demo.lib.Tool");
  const auto* const key = arm->find_member("key");
  CHECK(key->type.array == ArrayKind::max);
  CHECK(key->direction() == MemberDirection::writeonly);
  CHECK(key->has_modifier("nolock"));
  const auto* const ask = arm->find_member("ask");
  CHECK(ask->type.type == DataType::varvalue_t);
  REQUIRE(ask->parameters.size() == 2);
  CHECK(ask->parameters[1].name == "list");
  CHECK(arm->find_member("scan")->is_generator());
  CHECK_FALSE(ask->is_generator());
  REQUIRE(arm->find_member("scan")->step_parameter());
  CHECK(arm->find_member("scan")->step_parameter()->name == "feed");
  CHECK_FALSE(ask->step_parameter());
  CHECK(arm->find_member("moved")->parameters.empty());
  CHECK(arm->find_member("parts")->type.qualified_name == "demo.a.Arm");
  const auto* const mode = arm->find_member("mode");
  CHECK(mode->type.type == DataType::enum_t);
  CHECK(mode->modifiers.at(1).arguments == std::vector<std::string>{"RATE", "0x2"});
  CHECK(mode->modifiers.at(1).text == "rate(RATE, 0x2)");
  CHECK(arm->find_member("cells")->type.type == DataType::pod_t);
}

TEST_CASE("the source text and the file stay with the definition", "[robdef]") {
  const std::string text = "service demo.a \n\n# x\n";
  const auto result = parse_service_definition(text, RobdefMode::strict, "a.robdef");
  CHECK(result.definition.text == text);
  CHECK(result.definition.file == "a.robdef");
}

TEST_CASE("all errors are reported, not only the first", "[robdef]") {
  const auto checked = check_body(
      "constant int32 A x\n"                   // 3
      "enum Mode\n    off\n    on = 1\nend\n"  // 5 (no value), 6 (comma)
      "struct S\n"
      "    field double[3 x\n"   // 9
      "    property double y\n"  // 10
      "    field double z\n"
      "end\n"
      "object\n    nonsense\nend\n"                                 // 13
      "bogus\n"                                                     // 16
      "object Arm\n    function f()\n    event e(double)\nend\n");  // 18, 19
  INFO(checked.report());
  CHECK(error_lines(checked) == Lines{3, 5, 6, 9, 10, 13, 16, 18, 19});
}

TEST_CASE("verification reports all errors, too", "[robdef]") {
  const auto checked = check_body(
      "struct S\n    field Unknown a\n    field string[] b\n    field void c\nend\n"          // 4, 5, 6
      "object Arm\n    property S rr_x\n    property S rr_x\n    memory string[] m\nend\n");  // 9, 10 (twice), 11
  INFO(checked.report());
  CHECK(error_lines(checked) == Lines{4, 5, 6, 9, 10, 10, 11});
}

TEST_CASE("a missing end is assumed before the next block", "[robdef]") {
  auto checked = check_body("struct A\n    field double x\nstruct B\nend\nobject C\n    property A a\n");
  CHECK(error_lines(checked) == Lines{3, 7});
  CHECK(checked.first().entities.size() == 3);
  CHECK(error_lines(check_body("enum E\n    a = 1\nenum F\n    b = 1\nend\n")) == Lines{3});
}

TEST_CASE("a reserved word as the name of an enum value is no block", "[robdef]") {
  const auto checked = check_body("enum E\n    object = 1,\n    struct, pod\nend\n");
  INFO(checked.report());
  CHECK(error_lines(checked) == Lines{4, 5, 5});
  CHECK(checked.errors()[0].code == "name-reserved");
}

TEST_CASE("an illegal character costs its own statement only", "[robdef]") {
  const auto checked = check_body(
      "object Arm\xc3\xa9\n    property double x\nend\nstruct S\n    field double \x01 y\n    field double z\nend\n");
  CHECK(error_lines(checked) == Lines{3, 7});
  CHECK(error_lines(check("\x01service demo.a\nstruct S\nend\n")) == Lines{1, 2});
}

TEST_CASE("wrapped parameters are joined in compat mode", "[robdef]") {
  const std::string text =
      "service demo.a\nobject Arm\n    function void move(double a,\n        double b\n        , string\n     c) "
      "[urgent]\n"
      "    property double x\nend\n";
  const auto strict = check(text);
  CHECK(error_lines(strict) == Lines{3});
  auto checked = check(text, RobdefMode::compat);
  INFO(checked.report());
  REQUIRE(checked.ok());
  CHECK(checked.has(Severity::warning, "legacy-syntax"));
  const auto* const move = checked.first().entities.at(0).find_member("move");
  REQUIRE(move != nullptr);
  CHECK(move->parameters.size() == 3);
  CHECK(move->has_modifier("urgent"));
  CHECK(checked.first().entities.at(0).members.size() == 2);
}

TEST_CASE("wrapped parameters stop at keywords, comments and blank lines", "[robdef]") {
  for (const auto* next :
       {"    end\n", "    wire double w\n", "# c\n    double b)\n", "\n    double b)\n", "## d\n    double b)\n"}) {
    const auto checked =
        check("service demo.a\nobject Arm\n    function void move(double a,\n" + std::string(next) + "end\n",
              RobdefMode::compat);
    INFO(next << checked.report());
    REQUIRE_FALSE(checked.ok());
    CHECK(checked.errors()[0].line == 3);
  }
  // Other members do not wrap.
  CHECK_FALSE(check("service demo.a\nobject Arm\n    property double x [a(\n    1)]\nend\n", RobdefMode::compat).ok());
}

TEST_CASE("an unreliable pipe of the old form", "[robdef]") {
  auto checked = check(
      "service demo.a\nobject Arm\n    option pipe  p unreliable\n    pipe double p\n    pipe double q\n    pipe "
      "double r [unreliable]\nend\n");
  REQUIRE(checked.ok());
  const auto& arm = checked.first().entities.at(0);
  CHECK(arm.is_unreliable_pipe(arm.members.at(0)));
  CHECK_FALSE(arm.is_unreliable_pipe(arm.members.at(1)));
  CHECK(arm.is_unreliable_pipe(arm.members.at(2)));
}

TEST_CASE("versions in options", "[robdef]") {
  auto checked = check("service demo.a\noption version 0.8\n");
  CHECK(checked.first().version == Version{0, 8, 0, 0});
  CHECK(checked.first().version_is_option);
  CHECK(checked.first().options.at(0).text == "version 0.8");
  CHECK(error_lines(check("service demo.a\noption version 0.8\noption version 0.8\n")) == Lines{3});
  CHECK(error_lines(check("service demo.a\noption version 0.9\nstdver 0.9\n")) == Lines{3});
  CHECK(error_lines(check("service demo.a\noption version 1.2.9\n")) == Lines{2});
  // No gate of syntax hangs on an option, and inside an object it means nothing.
  CHECK(check("service demo.a\noption version 0.10\nstruct S\nend struct\n").ok());
  CHECK(check("service demo.a\nstdver 0.9\nobject Arm\n    option version x\nend\n").ok());
}

TEST_CASE("what compat takes from stdver comes with a warning", "[robdef]") {
  auto checked = check("service demo.a\nstdver 0.9\nstdver 0.10\n", RobdefMode::compat);
  CHECK(checked.ok());
  CHECK(checked.first().version == Version{0, 10, 0, 0});
  CHECK(checked.has(Severity::warning, "version-duplicate"));
}

}  // namespace rr::test
