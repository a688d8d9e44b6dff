// Rules of verification beyond the shared cases: resolution, sizes of namedarrays, cycles, inheritance.
#include <catch2/catch.hpp>

#include "core/robdef/model/cycles.hpp"
#include "test/core/robdef/checked.hpp"

namespace rr::test {

namespace {

std::string one_error(const Checked& checked) {
  INFO(checked.report());
  CHECK(checked.errors().size() == 1);
  return checked.errors().empty() ? "" : checked.errors()[0].code;
}

std::string member_error(const std::string& member, RobdefMode mode = RobdefMode::strict) {
  return one_error(check_body("object O\n    " + member + "\nend\n", mode));
}

bool is_member_fine(const std::string& member, RobdefMode mode = RobdefMode::strict) {
  const auto checked = check_body(
      "enum E\n    a = 0\nend\nstruct S\nend\npod P\nend\nnamedarray N\n    field double x\nend\n"
      "object O\n    " +
          member + "\nend\n",
      mode);
  UNSCOPED_INFO(checked.report());
  return checked.ok();
}

}  // namespace

TEST_CASE("value types of members", "[robdef]") {
  for (const auto* type : {"double", "bool[]", "cdouble[3,4]", "string{list}", "varvalue{string}", "E", "E{int32}",
                           "S{list}", "P[*]", "N[4-]{string}", "csingle[7,]"}) {
    for (const auto* kind : {"property", "wire", "pipe"}) {
      CHECK(is_member_fine(std::string(kind) + ' ' + type + " x"));
    }
    CHECK(is_member_fine("function " + std::string(type) + " f(" + type + " a)"));
    CHECK(is_member_fine("callback void f(" + std::string(type) + " a)"));
    CHECK(is_member_fine("event e(" + std::string(type) + " a)"));
  }
  for (const auto* type : {"void", "O", "string[]", "E[]", "S[3]", "void{list}"}) {
    CHECK_FALSE(is_member_fine("property " + std::string(type) + " x", RobdefMode::compat));
    CHECK_FALSE(is_member_fine("event e(" + std::string(type) + " x)", RobdefMode::compat));
  }
  for (const auto* type : {"varvalue[]", "object", "varobject", "varobject[3]{list}"}) {
    CHECK_FALSE(is_member_fine("property " + std::string(type) + " x"));
    CHECK(is_member_fine("property " + std::string(type) + " x", RobdefMode::compat));
  }
  CHECK_FALSE(is_member_fine("pipe double{generator} p", RobdefMode::compat));
}

TEST_CASE("generators", "[robdef]") {
  CHECK(is_member_fine("function double{generator} f()"));
  CHECK(is_member_fine("function S{generator} f(double[3]{generator} a)"));
  CHECK(is_member_fine("function void f(int32 n, E{generator} a)"));
  for (const auto* member :
       {"function double f(double{generator} a)", "function void{generator} f()", "event e(double{generator} a)",
        "callback void c(double{generator} a)", "function void f(double{generator} a, double{generator} b)",
        "function void f(void{generator} a)"}) {
    INFO(member);
    CHECK_FALSE(is_member_fine(member, RobdefMode::compat));
  }
  CHECK(member_error("function int32 f(double{generator} a)") == "generator");
}

TEST_CASE("memories and object references", "[robdef]") {
  CHECK(is_member_fine("memory bool[] m"));
  CHECK(is_member_fine("memory N[*] m"));
  for (const auto* member : {"memory double m", "memory double[3] m", "memory string[] m", "memory E[] m",
                             "memory S[] m", "memory varvalue[] m", "memory O[] m"}) {
    INFO(member);
    CHECK_FALSE(is_member_fine(member, RobdefMode::compat));
  }
  CHECK(is_member_fine("objref O[] o"));
  CHECK(is_member_fine("objref varobject{string} o"));
  for (const auto* member : {"objref S o", "objref double o", "objref object o", "objref varvalue o", "objref O[*] o",
                             "objref O[3] o", "objref O{list} o", "objref O{generator} o"}) {
    INFO(member);
    CHECK_FALSE(is_member_fine(member, RobdefMode::compat));
  }
}

TEST_CASE("types are found by alias and by full name, seen from where they are used", "[robdef]") {
  const std::vector<std::string> imports = {
      "service demo.lib\nstdver 0.10\nimport demo.deep\nenum Mode\nend\nobject Tool\n    objref Part part\nend\nobject "
      "Part\nend\n",
      "service demo.deep\nstdver 0.10\nstruct Deep\nend\n"};
  auto checked = check_body(
      "import demo.lib\nusing demo.lib.Mode as State\nobject O\n    property State a\n    property demo.lib.Mode b\n   "
      " objref demo.lib.Tool c\nend\n",
      RobdefMode::strict, imports);
  INFO(checked.report());
  REQUIRE(checked.ok());
  const auto& members = checked.first().entities[0].members;
  CHECK(members[0].type.qualified_name == "demo.lib.Mode");
  CHECK(members[0].type.type == DataType::enum_t);
  CHECK(members[1].type.qualified_name == "demo.lib.Mode");
  CHECK(members[2].type.type == DataType::object_t);
  CHECK(checked.definitions[1].entities[0].members[0].type.qualified_name == "demo.lib.Part");
  CHECK(one_error(check_body("import demo.lib\nstruct S\n    field demo.deep.Deep d\nend\n", RobdefMode::strict,
                             imports)) == "type-unknown");
  CHECK(one_error(check_body("import demo.lib\nstruct S\n    field demo.lib.Gone d\nend\n", RobdefMode::strict,
                             imports)) == "type-unknown");
  CHECK(one_error(check_body("import demo.lib\nstruct S\n    field Mode d\nend\n", RobdefMode::strict, imports)) ==
        "type-unknown");
  CHECK(one_error(check_body("import demo.lib\nusing demo.lib.Gone\nstruct S\n    field Gone d\nend\n",
                             RobdefMode::strict, imports)) == "alias-invalid");
  CHECK(one_error(check_body("constant int32 K 1\nstruct S\n    field K d\nend\n")) == "type-unknown");
  // A missing import is one error, whatever hangs on it.
  CHECK(one_error(check_body(
            "import demo.gone\nusing demo.gone.A as B\nstruct S\n    field B b\n    field demo.gone.C c\nend\n")) ==
        "import-missing");
}

TEST_CASE("self-qualified names resolve in compat mode", "[robdef]") {
  auto checked = check_body("struct A\nend\nstruct B\n    field demo.a.A x\nend\n", RobdefMode::compat);
  REQUIRE(checked.ok());
  CHECK(checked.first().entities[1].members[0].type.qualified_name == "demo.a.A");
  CHECK_FALSE(check_body("struct B\n    field demo.a.A x\nend\n", RobdefMode::compat).ok());
}

TEST_CASE("namedarrays know their numbers", "[robdef]") {
  auto checked = check_body(
      "import demo.lib\n"
      "namedarray Pose\n    field demo.lib.Vector position\n    field Turn[2] turns\nend\n"
      "namedarray Turn\n    field double w\n    field double[3] xyz\nend\n",
      RobdefMode::strict,
      {"service demo.lib\nstdver 0.10\nnamedarray Vector\n    field double x\n    field double y\nend\n"});
  INFO(checked.report());
  REQUIRE(checked.ok());
  CHECK(checked.first().entities[0].namedarray_type == DataType::double_t);
  CHECK(checked.first().entities[0].namedarray_count == 10);
  CHECK(checked.first().entities[1].namedarray_count == 4);
  // Beyond 32 bits the count stays at its maximum.
  auto large =
      check_body("namedarray A\n    field B[2147483647] x\nend\nnamedarray B\n    field double[2147483647] x\nend\n");
  REQUIRE(large.ok());
  CHECK(large.first().entities[0].namedarray_count == 0xffffffffu);
}

TEST_CASE("what pods and namedarrays cannot hold", "[robdef]") {
  for (const auto* field : {"string x", "S x", "E x", "O x", "varvalue x", "double[] x", "double[*] x",
                            "double{list} x", "double[0] x", "double[0-] x", "void x"}) {
    INFO(field);
    const std::string others =
        "enum E\n    a = 1\nend\nstruct S\nend\nobject O\nend\nnamedarray N\n    field double x\nend\n";
    CHECK_FALSE(check_body(others + "pod T\n    field " + field + "\nend\n", RobdefMode::compat).ok());
    const bool is_zero_size = std::string_view(field) == "double[0] x";
    CHECK(check_body(others + "namedarray T\n    field double y\n    field " + field + "\nend\n", RobdefMode::compat)
              .ok() == is_zero_size);
  }
  CHECK(one_error(check_body("namedarray T\nend\n")) == "namedarray-field");
  CHECK(one_error(check_body("namedarray T\n    field double x\n    field T y\nend\n")) == "recursion");
  CHECK(one_error(check_body("pod T\n    field U[2] x\nend\npod U\n    field V x\nend\npod V\n    field T x\nend\n")) ==
        "recursion");
}

TEST_CASE("names of every name space", "[robdef]") {
  CHECK(one_error(check_body("struct A\nend\nenum A\nend\n")) == "order");
  CHECK(one_error(check_body("enum A\nend\nstruct A\nend\n")) == "duplicate-name");
  CHECK(one_error(check_body("exception A\nconstant int32 A 1\n")) == "duplicate-name");
  CHECK(one_error(check("service demo.a\noption constant int32 A 1\nstruct A\nend\n")) == "duplicate-name");
  CHECK(one_error(check("service demo.a\nobject O\n    option constant int32 A.B 1\n    property double A_B\nend\n",
                        RobdefMode::compat)) == "duplicate-name");
  CHECK(one_error(check_body("enum E\n    a = 1,\n    a = 2\nend\n")) == "duplicate-name");
  CHECK(one_error(check_body("enum E\n    a = 1,\n    set_b = 2\nend\n")) == "name-reserved");
  CHECK(member_error("function void f(int32 a, int32 a)") == "duplicate-name");
  CHECK(member_error("property double self") == "name-reserved");
  CHECK(is_member_fine("property double Self"));
  CHECK(one_error(check("service demo.a_signed\n")) == "name-reserved");
  CHECK(one_error(check("service Me\n")) == "name-reserved");
  CHECK(one_error(check("service robotraconteur.x\n")) == "name-reserved");
  CHECK(check("service RobotRaconteurTestService2\n").ok());
  CHECK(check("service RobotRaconteurServiceIndex\n").ok());
  CHECK(one_error(check("service RobotRaconteurServiceIndex2\n")) == "name-reserved");
  CHECK(check_body("struct Abc\nend\nstruct ABC\nend\n").has(Severity::warning, "case-clash"));
  CHECK(one_error(check_body("struct X\nend\n", RobdefMode::strict, {"service demo.a\n"})) == "duplicate-name");
}

TEST_CASE("inheritance compares all that counts", "[robdef]") {
  const auto with = [](const std::string& base, const std::string& own) {
    return check_body("import demo.lib\nusing demo.lib.S as T\nobject B\n    " + base +
                          "\nend\nobject D\n    implements B\n    " + own + "\nend\n",
                      RobdefMode::strict, {"service demo.lib\nstdver 0.10\nstruct S\nend\n"});
  };
  CHECK(with("property T x [readonly]", "## other text\n    property demo.lib.S x [ readonly ]").ok());
  CHECK(with("function void f(int32 a, T{list} b)", "function void f( int32 a,demo.lib.S{list} b )").ok());
  for (const auto& [base, own] :
       {std::pair("property double x", "wire double x"), std::pair("property double x", "property single x"),
        std::pair("property double[] x", "property double[3] x"),
        std::pair("property double x", "property double{list} x"),
        std::pair("function void f(int32 a)", "function void f()"),
        std::pair("function void f(int32 a)", "function void f(int64 a)"),
        std::pair("wire double x", "wire double x [readonly]"), std::pair("property T x", "property double x"),
        std::pair("wire double x [a(1)]", "wire double x [a(2)]")}) {
    INFO(own);
    CHECK(one_error(with(base, own)) == "implements-mismatch");
  }
  CHECK(one_error(with("property double x", "property double y")) == "implements-missing");
  CHECK(one_error(check_body("object D\n    implements Gone\nend\n")) == "implements-unknown");
  CHECK(one_error(check_body("struct S\nend\nobject D\n    implements S\nend\n")) == "implements-unknown");
  CHECK(one_error(check_body("object D\n    implements D\nend\n")) == "implements-cycle");
  CHECK(check_body("object B\nend\nobject D\n    implements B\n    implements B\nend\n")
            .has(Severity::warning, "duplicate-implements"));
}

TEST_CASE("modifiers that mean nothing give warnings", "[robdef]") {
  const auto warnings = [](const std::string& member) {
    const auto checked = check_body("object O\n    constant int32 K 1\n    " + member + "\nend\n");
    CHECK(checked.ok());
    std::string codes;
    for (const auto& item : checked.warnings()) codes += item.code + ' ';
    return codes;
  };
  CHECK(warnings("property double x [readonly,perclient,urgent,nolockread]").empty());
  CHECK(warnings("pipe double x [unreliable,nolock]").empty());
  CHECK(warnings("event e() [urgent]").empty());
  CHECK(warnings("event e() [readonly]") == "unknown-modifier ");
  CHECK(warnings("wire double x [Readonly]") == "unknown-modifier ");
  CHECK(warnings("wire double x [rate(K)]") == "unknown-modifier ");
  CHECK(warnings("wire double x [rate(L)]") == "unknown-modifier modifier-argument ");
  CHECK(warnings("wire double x [readonly,readonly]") == "modifier-combination ");
  CHECK(warnings("memory double[] x [nolock,nolockread]") == "modifier-combination ");
}

TEST_CASE("features of later versions are gated where they are first used", "[robdef]") {
  const auto checked = check(
      "service demo.a\noption version 0.8\nconstant int32 A 1\nenum E\n    a = 1\nend\nobject O\n    constant int32 K "
      "1\n    wire double w [readonly]\nend\n");
  INFO(checked.report());
  REQUIRE(checked.errors().size() == 3);
  CHECK(checked.errors()[0].line == 3);
  CHECK(checked.errors()[1].line == 4);
  CHECK(checked.errors()[2].line == 9);
  CHECK(check("service demo.a\noption version 0.8\nstruct S\n    constant int32 K 1\nend\n").ok());
  CHECK(check("service demo.a\noption version 0.9\nconstant int32 K 1\n").ok());
}

TEST_CASE("cycles of a graph", "[robdef]") {
  using Cycles = std::vector<std::vector<std::size_t>>;
  CHECK(find_cycles({}).empty());
  CHECK(find_cycles({{1}, {2}, {}}).empty());
  CHECK(find_cycles({{0}}) == Cycles{{0}});
  CHECK(find_cycles({{1}, {2, 4}, {1, 3}, {3}, {}}) == Cycles{{1, 2}, {3}});
  CHECK(dependencies_first({{1, 2}, {2}, {}}) == std::vector<std::size_t>{2, 1, 0});
  Graph chain(200000);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) chain[i] = {i + 1};
  CHECK(find_cycles(chain).empty());
  chain.back() = {0};
  CHECK(find_cycles(chain).at(0).size() == chain.size());
}

}  // namespace rr::test
