// Large and hostile texts: linear time, bounded findings, no deep recursion.
#include <catch2/catch.hpp>
#include <ctime>

#include "core/robdef/model/names.hpp"
#include "test/core/robdef/checked.hpp"

namespace rr::test {

namespace {

std::string repeated(std::string_view part, std::size_t count) {
  std::string out;
  out.reserve(part.size() * count);
  for (std::size_t i = 0; i < count; ++i) out += part;
  return out;
}

template <class Make>
std::string numbered(std::size_t count, Make make) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += make(std::to_string(i));
  return out;
}

/// Each takes a fraction of a second; a quadratic one would take minutes, sanitizers and emulators or not.
void check_quickly(const std::string& text, const std::vector<std::string>& imports = {}) {
  for (const auto mode : {RobdefMode::strict, RobdefMode::compat}) {
    const auto start = std::clock();  // processor time: the machine may be busy with other things
    auto checked = check(text, mode, imports);
    const auto printed = format_service_definition(checked.first());
    CHECK(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC < 60.0);
    CHECK(checked.diagnostics.size() <= 4 * (max_diagnostics + 1));
    CHECK(printed.size() < 4 * text.size() + 100);
  }
}

const std::string head = "service demo.a\nstdver 0.9\n";

}  // namespace

TEST_CASE("a million lines", "[robdef][hostile]") {
  check_quickly(head + repeated("\n", 1000000));
  check_quickly(head + repeated("x\n", 1000000));
}

TEST_CASE("many lines of one kind", "[robdef][hostile]") {
  const std::size_t count = 100000;
  check_quickly(head + repeated("# comment\n", count));
  check_quickly(head + repeated("## text\n", count));
  check_quickly(head + repeated("option x\n", count));
  check_quickly(head + "struct S\n" + repeated("f\n", count));
  check_quickly(head + "enum S\n" + repeated("f\n", count));
  check_quickly(head + repeated("struct S\n", count));
  check_quickly(repeated("service a\n", count));
}

TEST_CASE("lines of a megabyte", "[robdef][hostile]") {
  const std::size_t size = 1000000;
  check_quickly(std::string(size, 'a'));
  check_quickly(std::string(size, '\0'));
  check_quickly(std::string(size, '\xff'));
  check_quickly(std::string(size, '\r'));
  check_quickly("service " + repeated("a.", size / 2));
  check_quickly(head + repeated("\\\n", size / 2));
  check_quickly(head + "constant string S \"" + repeated("\\u00e9", size / 6) + "\"\n");
  check_quickly(head + "constant int32[] S {" + repeated("1,", size / 2) + "1}\n");
  check_quickly(head + "constant double S 1." + repeated("1", size) + "\n");
  check_quickly(head + "constant struct S {" + repeated("a:b,", size / 4) + "a:b}\n");
  check_quickly(head + "struct S\n    field double[" + repeated("1,", size / 2) + "1] x\nend\n");
  check_quickly(head + "object O\n    function void f(" + repeated("int32 a,", size / 8) + "int32 a)\nend\n");
  check_quickly(head + "object O\n    wire int32 f [" + repeated("a,", size / 2) + "a]\nend\n");
  check_quickly(head + "object O\n    wire int32 f [a(" + repeated("1 ,", size / 3) + "1)]\nend\n");
  check_quickly(head + "enum E\n a=1" + repeated(",b", size / 2) + "\nend\n");
  check_quickly(head + "enum E\n a=1" + repeated(",", size) + "\nend\n");
}

TEST_CASE("what no definition needs is refused before it takes gigabytes", "[robdef][hostile]") {
  const auto refused = [](const std::string& body, const std::string& expected) {
    auto checked = check(head + body, RobdefMode::compat);
    REQUIRE_FALSE(checked.ok());
    CHECK_THAT(checked.errors().front().message, Catch::Contains(expected));
  };
  const auto accepted = [](const std::string& body) {
    auto checked = check(head + body, RobdefMode::compat);
    INFO(checked.report());
    CHECK(checked.ok());
  };
  const auto sizes = [](std::size_t count) {
    return "struct S\n    field double[" + repeated("1,", count - 1) + "1] x\nend\n";
  };
  accepted(sizes(max_dimensions));
  refused(sizes(max_dimensions + 1), "at most 64 of these");
  const auto parameters = [](std::size_t count) {
    const auto list = numbered(count, [](const std::string& number) { return "int32 a" + number + ","; });
    return "object O\n    event e(" + list.substr(0, list.size() - 1) + ")\nend\n";
  };
  accepted(parameters(max_parameters));
  refused(parameters(max_parameters + 1), "at most 1024 of these");
  const auto members = [](std::size_t count) {
    return "struct S\n" + numbered(count, [](const std::string& number) { return "field int32 a" + number + "\n"; }) +
           "end\n";
  };
  accepted(members(max_members));
  refused(members(max_members + 1), "at most 8192 of these");
  refused(repeated("import demo.b\n", max_imports + 1), "at most 1024 of these");
  refused(repeated("using demo.b.C\n", max_imports + 1), "at most 1024 of these");
  const auto named = [](std::size_t size) { return "service demo." + std::string(size - 5, 'a') + "\nstdver 0.9\n"; };
  CHECK(check(named(longest_qualified_name), RobdefMode::compat).ok());
  CHECK_FALSE(check(named(longest_qualified_name + 1), RobdefMode::compat).ok());
}

TEST_CASE("parameters that wrap without end", "[robdef][hostile]") {
  check_quickly(head + "object O\nfunction void f(\n" + repeated("int32 a,\n", 100000));
  check_quickly(head + "object O\n" + repeated("function void f(\n", 60000));
  check_quickly(head + "object O\n" + repeated("function void f(\nx\n", 60000) + "end\n");
}

TEST_CASE("many of everything", "[robdef][hostile]") {
  const std::size_t count = 10000;
  check_quickly(head + numbered(count, [](const auto& i) { return "struct S" + i + "\n field S" + i + " x\nend\n"; }));
  check_quickly(head + "enum E\n a=0,\n" + numbered(count, [](const auto& i) { return " v" + i + ",\n"; }) + "end\n");
  check_quickly(head + "object O\n" +
                numbered(count, [](const auto& i) { return " wire double w" + i + " [a(K)]\n"; }) + "end\n");
  check_quickly(head + "object O\n" + numbered(count, [](const auto& i) { return " constant int32 K" + i + " 1\n"; }) +
                "end\n");
  check_quickly(head + numbered(count, [](const auto& i) { return "import demo.x" + i + "\n"; }));
  check_quickly(head + "import demo.b\n" +
                    numbered(count, [](const auto& i) { return "using demo.b.T as A" + i + "\n"; }) + "struct S\n" +
                    numbered(count, [](const auto& i) { return "field A" + i + " f" + i + "\n"; }) + "end\n",
                {"service demo.b\nstdver 0.9\nstruct T\nend\n"});
}

TEST_CASE("long chains and large cycles", "[robdef][hostile]") {
  const std::size_t count = 10000;
  const auto next = [](const std::string& i) { return std::to_string(std::stoul(i) + 1); };
  for (const auto* last : {"field double x", "field P0 x"}) {
    check_quickly(head +
                  numbered(count, [&](const auto& i) { return "pod P" + i + "\n field P" + next(i) + " x\nend\n"; }) +
                  "pod P" + std::to_string(count) + "\n " + last + "\nend\n");
    check_quickly(
        head +
        numbered(count, [&](const auto& i) { return "namedarray P" + i + "\n field P" + next(i) + "[2] x\nend\n"; }) +
        "namedarray P" + std::to_string(count) + "\n " + last + "\nend\n");
  }
  check_quickly(head +
                numbered(count, [&](const auto& i) { return "constant struct C" + i + " {a: C" + next(i) + "}\n"; }) +
                "constant struct C" + std::to_string(count) + " {a: C0}\n");
  check_quickly(
      head + numbered(count, [&](const auto& i) { return "object O" + i + "\n implements O" + next(i) + "\nend\n"; }) +
      "object O" + std::to_string(count) + "\nend\n");
}

TEST_CASE("one large base and many objects that lack its members", "[robdef][hostile]") {
  check_quickly(head + "object B\n" + numbered(10000, [](const auto& i) { return " wire double w" + i + "\n"; }) +
                "end\n" + numbered(10000, [](const auto& i) { return "object O" + i + "\n implements B\nend\n"; }));
}

TEST_CASE("a base whose members and bases are repeated, and many objects of it", "[robdef][hostile]") {
  const std::size_t count = 100000;
  const auto body = " implements A\n wire double w\n";
  check_quickly(head + "object A\nend\nobject B\n" + repeated(" implements A\n", count) +
                repeated(" wire double w\n", count) + "end\n" +
                numbered(count, [&](const auto& i) { return "object O" + i + "\n implements B\n" + body + "end\n"; }));
}

TEST_CASE("imports in a circle of thousands", "[robdef][hostile]") {
  std::vector<std::string> imports;
  for (int i = 0; i < 3000; ++i) {
    imports.push_back("service demo.s" + std::to_string(i) + "\nimport demo.s" + std::to_string((i + 1) % 3000) + "\n");
  }
  const auto checked = check("service demo.a\nimport demo.s0\n", RobdefMode::strict, imports);
  REQUIRE(checked.errors().size() == 1);
  CHECK(checked.errors()[0].code == "import-cycle");
}

}  // namespace rr::test
