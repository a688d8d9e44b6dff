// resolve_service_definitions() beside the verifier: the same meaning, and nothing let through that values depend on.
#include <catch2/catch.hpp>

#include "core/robdef/resolve/resolve.hpp"
#include "test/core/robdef/checked.hpp"
#include "test/support/golden.hpp"

namespace rr::test {

namespace {

struct Resolved {
  std::deque<ServiceDefinition> definitions = {};
  std::vector<Diagnostic> errors = {};
};

Resolved resolve(const std::vector<std::string>& texts) {
  Resolved out;
  std::vector<ServiceDefinition*> set;
  for (const auto& text : texts)
    set.push_back(&out.definitions.emplace_back(parse_service_definition(text, RobdefMode::compat).definition));
  out.errors = resolve_service_definitions(set);
  return out;
}

/// Everything that verification fills in, one line an entity or type.
std::string meaning(const ServiceDefinition& definition) {
  std::string out;
  const auto add = [&](const TypeDefinition& type) {
    out += "  " + std::to_string(static_cast<int>(type.type)) + ' ' + type.qualified_name + '\n';
  };
  for (const auto& entity : definition.entities) {
    out += entity.qualified_name + ' ' + std::to_string(static_cast<int>(entity.namedarray_type)) + ' ' +
           std::to_string(entity.namedarray_count) + '\n';
    for (const auto& base : entity.implements) out += "  implements " + base.qualified_name + '\n';
    for (const auto& member : entity.members) {
      add(member.type);
      for (const auto& parameter : member.parameters) add(parameter.type);
    }
  }
  return out;
}

std::string body(std::string_view text) {
  return "service demo.a\nstdver 0.10\n" + std::string(text);
}

}  // namespace

TEST_CASE("resolved definitions mean what verified ones mean", "[robdef]") {
  std::size_t compared = 0;
  for (const auto& item : read_golden_json("robdef/robdef-cases.json")) {
    const auto text = item.at("text").get<std::string>();
    const auto imports = item.value("imports", std::vector<std::string>{});
    const auto checked = check(text, RobdefMode::compat, imports);
    if (!checked.ok()) continue;
    std::vector<std::string> texts{text};
    texts.insert(texts.end(), imports.begin(), imports.end());
    const auto resolved = resolve(texts);
    INFO(item.at("name") << '\n' << text);
    for (const auto& error : resolved.errors) UNSCOPED_INFO(format_diagnostic(error));
    CHECK(resolved.errors.empty());
    REQUIRE(resolved.definitions.size() == checked.definitions.size());
    for (std::size_t i = 0; i < resolved.definitions.size(); ++i)
      CHECK(meaning(resolved.definitions[i]) == meaning(checked.definitions[i]));
    ++compared;
  }
  CHECK(compared > 60);
}

TEST_CASE("what is known already is imported without being touched", "[robdef]") {
  const std::string base =
      "service demo.b\nstdver 0.10\nenum E\na=1\nend\nnamedarray N\nfield double x\nfield double[2] y\nend\n";
  const std::string text =
      body("import demo.b\nusing demo.b.N as M\nnamedarray T\nfield M[2] a\nend\nstruct S\nfield demo.b.E e\nend\n");
  const auto together = resolve({text, base});
  const auto known = resolve({base});
  auto later = parse_service_definition(text, RobdefMode::compat).definition;
  ServiceDefinition* const set[] = {&later};
  const ServiceDefinition* const imported[] = {&known.definitions.front()};
  CHECK(resolve_service_definitions(set, imported).empty());
  CHECK(meaning(later) == meaning(together.definitions.front()));
  CHECK(later.entities.front().namedarray_count == 6);
  CHECK(resolve_service_definitions(set).size() == 1);
}

TEST_CASE("definitions that values could not be read by are refused without the verifier, too", "[robdef]") {
  const std::pair<std::string, std::string> cases[] = {
      {"struct S\nfield Missing a\nend\n", "unknown type 'Missing'"},
      {"struct S\nfield demo.b.T a\nend\n", "unknown type 'demo.b.T'"},
      {"import demo.b\n", "'demo.b', but no such definition was given"},
      {"import demo.a\n", "cycle of imports"},
      {"pod P\nfield P a\nend\n", "'P' contains itself"},
      {"pod P\nfield Q[2] a\nend\npod Q\nfield P[2-] a\nend\n", "contains itself"},
      {"namedarray N\nfield N a\nend\n", "'N' contains itself"},
      {"namedarray N\nfield double a\nfield int32 b\nend\n", "one numeric type"},
      {"namedarray N\nend\n", "one numeric type"},
      {"pod P\nfield string a\nend\n", "'a' of 'P'"},
      {"pod P\nfield double[] a\nend\n", "'a' of 'P'"},
      {"struct S\nfield string[] a\nend\n", "'a' of 'S'"},
      {"object O\nproperty void a\nend\n", "'a' of 'O'"},
      {"object O\nmemory string[] a\nend\n", "'a' of 'O'"},
      {"object O\nmemory double a\nend\n", "'a' of 'O'"},
      {"object O\nobjref double a\nend\n", "'a' of 'O'"},
      {"object O\nfunction double a(double{generator} b, double c)\nend\n", "'a' of 'O'"},
      {"object O\nevent a(double{generator} b)\nend\n", "'a' of 'O'"},
  };
  for (const auto& [text, expected] : cases) {
    const auto resolved = resolve({body(text)});
    INFO(text);
    REQUIRE(resolved.errors.size() == 1);
    CHECK_THAT(format_diagnostic(resolved.errors.front()), Catch::Contains(expected));
    CHECK_FALSE(check(body(text), RobdefMode::compat).ok());
  }
}

}  // namespace rr::test
