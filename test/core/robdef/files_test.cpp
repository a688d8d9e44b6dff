// The definitions of the project's robdef folder.
#include <catch2/catch.hpp>

#include "core/robdef/model/constant_value.hpp"
#include "core/robdef/parse/statement.hpp"
#include "test/core/robdef/checked.hpp"
#include "test/support/golden.hpp"
#include "test/support/is_equal.hpp"

namespace rr::test {

namespace {

std::string definition_text(const std::string& name) {
  return read_golden("../../robdef/" + name + ".robdef");
}

}  // namespace

TEST_CASE("the Create of the paper needs compat mode", "[robdef]") {
  const auto text = definition_text("experimental.create");
  CHECK_FALSE(check(text).ok());
  auto checked = check(text, RobdefMode::compat);
  INFO(checked.report());
  REQUIRE(checked.ok());
  CHECK(checked.has(Severity::warning, "legacy-syntax"));
  CHECK(checked.has(Severity::warning, "option-deprecated"));
  const auto* const create = checked.first().find_entity("Create");
  REQUIRE(create != nullptr);
  const auto constants = option_constants(create->options);
  REQUIRE(constants.size() == 3);
  CHECK(constants[0].name == "DRIVE_STRAIGHT");
  CHECK(create->options[0].text == "constant int16 DRIVE.STRAIGHT 32767");
  const auto* const callback = create->find_member("play_callback");
  REQUIRE(callback != nullptr);
  REQUIRE(callback->parameters.size() == 2);
  CHECK(callback->parameters[0].name == "DistanceTraveled");
  CHECK(callback->parameters[1].name == "AngleTraveled");
}

TEST_CASE("the webcam of the paper is valid in both modes", "[robdef]") {
  for (const auto mode : {RobdefMode::strict, RobdefMode::compat}) {
    auto checked = check(definition_text("experimental.createwebcam"), mode);
    INFO(checked.report());
    REQUIRE(checked.ok());
    const auto* const host = checked.first().find_entity("WebcamHost");
    REQUIRE(host != nullptr);
    CHECK(host->find_member("Webcams")->type.qualified_name == "experimental.createwebcam.Webcam");
    CHECK(host->find_member("Webcams")->type.container == ContainerKind::map_int32);
  }
}

TEST_CASE("the modern definitions are valid without a warning", "[robdef]") {
  for (const auto* name : {"modern/experimental.create2", "modern/experimental.createwebcam2"}) {
    auto checked = check(definition_text(name));
    INFO(checked.report());
    CHECK(checked.diagnostics.empty());
    CHECK_FALSE(checked.first().documentation.empty());
  }
}

TEST_CASE("the modern definitions have the members of the old ones", "[robdef]") {
  for (const auto* name : {"experimental.create", "experimental.createwebcam"}) {
    auto old_form = check(definition_text(name), RobdefMode::compat);
    auto modern = check(definition_text("modern/" + std::string(name) + "2"));
    REQUIRE(old_form.first().entities.size() == modern.first().entities.size());
    for (const auto& old_entity : old_form.first().entities) {
      const auto* const entity = modern.first().find_entity(old_entity.name);
      REQUIRE(entity != nullptr);
      CHECK(entity->constants.size() == option_constants(old_entity.options).size());
      REQUIRE(entity->members.size() == old_entity.members.size());
      for (const auto& old_member : old_entity.members) {
        const auto* const member = entity->find_member(old_member.name);
        REQUIRE(member != nullptr);
        CHECK(member->kind == old_member.kind);
        CHECK(format_type(member->type) == format_type(old_member.type));
        CHECK(member->parameters.size() == old_member.parameters.size());
      }
    }
  }
}

TEST_CASE("the project's definitions print and parse again", "[robdef]") {
  for (const auto* name : {"experimental.create", "experimental.createwebcam", "modern/experimental.create2",
                           "modern/experimental.createwebcam2"}) {
    auto checked = check(definition_text(name), RobdefMode::compat);
    const auto printed = format_service_definition(checked.first());
    auto again = check(printed, RobdefMode::compat);
    INFO(printed << again.report());
    REQUIRE(again.ok());
    CHECK(is_equal(again.first(), checked.first()));
    CHECK(format_service_definition(again.first()) == printed);
  }
}

}  // namespace rr::test
