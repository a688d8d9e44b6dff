#include "core/types/type_registry.hpp"

#include <catch2/catch.hpp>

#include "test/core/types/show_result.hpp"

using namespace rr;

namespace {

const std::string base =
    "service a.base\nstdver 0.10\nexception Broken\nenum mode\n  off = 0\nend\nstruct S\n  field double x\nend\n";
const std::string user =
    "service a.user\nstdver 0.10\nimport a.base\nusing a.base.S as T\nobject O\n  property T t\nend\n";
const std::string top = "service top\nstdver 0.10\nimport a.user\nimport a.base\nobject O\n  objref a.user.O o\nend\n";

std::vector<std::string> names_of(const TypeRegistry& types) {
  std::vector<std::string> names;
  for (const auto& definition : types.definitions()) names.push_back(definition->name);
  return names;
}

}  // namespace

TEST_CASE("definitions are added in any order and kept with imports before importers") {
  TypeRegistry types;
  REQUIRE(types.add({top, user, base}, RobdefMode::strict));
  CHECK(names_of(types) == std::vector<std::string>{"a.base", "a.user", "top"});
  REQUIRE(types.find_service("a.user"));
  CHECK(types.find_service("a.user")->text == user);
  CHECK_FALSE(types.find_service("a"));
}

TEST_CASE("entities and enums are found by qualified name") {
  TypeRegistry types;
  REQUIRE(types.add({user, base}, RobdefMode::strict));
  REQUIRE(types.find_entity("a.base.S"));
  CHECK(types.find_entity("a.base.S")->kind == EntityKind::structure);
  CHECK_FALSE(types.find_entity("S"));
  CHECK_FALSE(types.find_entity("a.base.mode"));
  CHECK_FALSE(types.find_entity("a.user.S"));
  REQUIRE(types.find_enum("a.base.mode"));
  CHECK_FALSE(types.find_enum("a.base.S"));
  const auto* member = types.find_entity("a.user.O")->find_member("t");
  REQUIRE(member);
  CHECK(member->type.type == DataType::structure_t);
  CHECK(member->type.qualified_name == "a.base.S");
}

TEST_CASE("later definitions build on earlier ones, which stay where they are") {
  TypeRegistry types;
  REQUIRE(types.add({base}, RobdefMode::strict));
  const auto* structure = types.find_entity("a.base.S");
  REQUIRE(types.add({user}, RobdefMode::strict));
  REQUIRE(types.add({top}, RobdefMode::strict));
  CHECK(types.find_entity("a.base.S") == structure);
  CHECK(names_of(types) == std::vector<std::string>{"a.base", "a.user", "top"});
}

TEST_CASE("a definition that is there already is skipped") {
  TypeRegistry types;
  REQUIRE(types.add({base}, RobdefMode::strict));
  const auto* structure = types.find_entity("a.base.S");
  REQUIRE(types.add({base, user, user}, RobdefMode::strict));
  CHECK(types.find_entity("a.base.S") == structure);
  CHECK(types.definitions().size() == 2);
}

TEST_CASE("two different texts of one name are refused") {
  TypeRegistry types;
  const auto added = types.add({base, base + "struct Other\nend\n"}, RobdefMode::strict);
  REQUIRE_FALSE(added);
  CHECK(added.error().code == ErrorCode::service_definition_error);
  CHECK(types.definitions().empty());
}

TEST_CASE("all are added or none") {
  TypeRegistry types;
  SECTION("a syntax error") {
    const auto added = types.add({base, "service b\nstdver 0.10\nstruct\n"}, RobdefMode::strict);
    REQUIRE_FALSE(added);
    CHECK(added.error().code == ErrorCode::service_definition_error);
    CHECK(added.error().message.find("3") != std::string::npos);
  }
  SECTION("an import that is nowhere") {
    const auto added = types.add({user}, RobdefMode::strict);
    REQUIRE_FALSE(added);
    CHECK(added.error().code == ErrorCode::service_definition_error);
    CHECK(added.error().message.find("a.base") != std::string::npos);
  }
  CHECK(types.definitions().empty());
  CHECK_FALSE(types.find_service("a.base"));
  CHECK_FALSE(types.find_entity("a.base.S"));
}

TEST_CASE("a long chain of imports is put in order") {
  TypeRegistry types;
  std::vector<std::string> texts;
  for (int i = 0; i < 300; ++i) {
    const auto import = i < 299 ? "import s" + std::to_string(i + 1) + "\n" : std::string();
    texts.push_back("service s" + std::to_string(i) + "\nstdver 0.10\n" + import);
  }
  REQUIRE(types.add(texts, RobdefMode::strict));
  CHECK(types.definitions().front()->name == "s299");
  CHECK(types.definitions().back()->name == "s0");
}

TEST_CASE("a copy has the same definitions, and what is added to one is not added to the other") {
  TypeRegistry types;
  REQUIRE(types.add({base, user}, RobdefMode::strict));
  auto copy = std::make_unique<TypeRegistry>(types);
  CHECK(copy->find_entity("a.user.O") == types.find_entity("a.user.O"));
  REQUIRE(copy->add({top}, RobdefMode::strict));
  CHECK_FALSE(types.find_service("top"));
  copy.reset();
  CHECK(types.find_enum("a.base.mode")->name == "mode");
  CHECK(types.find_entity("a.base.S")->qualified_name == "a.base.S");
}

TEST_CASE("definitions that are shared are those of the other registry, and outlive it") {
  TypeRegistry types;
  REQUIRE(types.add({base}, RobdefMode::strict));
  const auto* structure = types.find_entity("a.base.S");
  const ServiceDefinition* shared = nullptr;
  {
    TypeRegistry other;
    REQUIRE(other.add({top, user, base}, RobdefMode::strict));
    shared = other.find_service("a.user");
    types.share(other);
  }
  CHECK(names_of(types) == std::vector<std::string>{"a.base", "a.user", "top"});
  CHECK(types.find_service("a.user") == shared);
  CHECK(types.find_entity("a.base.S") == structure);
  CHECK(types.find_entity("a.user.O")->find_member("t")->type.qualified_name == "a.base.S");
}
