// The shared cases of the service definitions spec (section 5.13), in both modes.
#include <catch2/catch.hpp>

#include "test/core/robdef/checked.hpp"
#include "test/support/golden.hpp"
#include "test/support/is_equal.hpp"

namespace rr::test {

namespace {

std::vector<std::string> imports_of(const nlohmann::json& item) {
  return item.value("imports", std::vector<std::string>{});
}

void check_round_trip(Checked& checked, RobdefMode mode) {
  const auto printed = format_service_definition(checked.first());
  INFO(printed);
  auto again = parse_service_definition(printed, mode);
  for (const auto& item : again.diagnostics) UNSCOPED_INFO(format_diagnostic(item));
  CHECK(again.ok());
  CHECK(is_equal(again.definition, checked.first()));
  CHECK(format_service_definition(again.definition) == printed);
}

}  // namespace

TEST_CASE("shared cases have their verdict and line", "[robdef]") {
  const auto cases = read_golden_json("robdef/robdef-cases.json");
  REQUIRE(cases.size() == 161);
  for (const auto& item : cases) {
    const auto text = item.at("text").get<std::string>();
    for (const auto mode : {RobdefMode::strict, RobdefMode::compat}) {
      const bool is_strict = mode == RobdefMode::strict;
      const bool is_valid =
          is_strict ? item.at("valid").get<bool>() : item.value("compat", item.at("valid").get<bool>());
      auto checked = check(text, mode, imports_of(item));
      INFO(item.at("name") << (is_strict ? " (strict)" : " (compat)") << "\n" << text << "\n" << checked.report());
      CHECK(checked.ok() == is_valid);
      if (is_valid) {
        for (const auto& code : item.value("warnings", std::vector<std::string>{})) {
          CHECK(checked.has(Severity::warning, code));
        }
        // What only compat lets through gives a warning.
        if (!item.at("valid").get<bool>()) CHECK_FALSE(checked.warnings().empty());
        check_round_trip(checked, mode);
      } else {
        // An invalid case holds one error.
        const auto errors = checked.errors();
        CHECK(errors.size() == 1);
        for (const auto& error : errors) {
          CHECK(error.line == item.at("line").get<std::uint32_t>());
          CHECK(error.column_line >= error.line * (error.column != 0));
        }
      }
    }
  }
}

TEST_CASE("verification of verified definitions changes nothing", "[robdef]") {
  for (const auto& item : read_golden_json("robdef/robdef-cases.json")) {
    const auto text = item.at("text").get<std::string>();
    auto checked = check(text, RobdefMode::compat, imports_of(item));
    std::vector<ServiceDefinition*> set;
    for (auto& definition : checked.definitions) set.push_back(&definition);
    const auto first = verify_service_definitions(set, RobdefMode::compat);
    const auto second = verify_service_definitions(set, RobdefMode::compat);
    INFO(item.at("name"));
    REQUIRE(first.size() == second.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      CHECK(format_diagnostic(first[i]) == format_diagnostic(second[i]));
    }
  }
}

}  // namespace rr::test
