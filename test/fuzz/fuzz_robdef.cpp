// Service definitions from hostile peers: parse and verify in both modes, print, parse again. NUL separates the
// definitions of a set.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <string_view>
#include <vector>

#include "core/robdef/robdef.hpp"
#include "test/fuzz/memory_bound.hpp"
#include "test/support/is_equal.hpp"

namespace {

void require(bool claim) {
  if (!claim) std::abort();
}

constexpr std::size_t most_definitions = 256;  // no service imports more: 10 s for an input would be few

bool has_errors(const std::vector<rr::Diagnostic>& diagnostics) {
  for (const auto& diagnostic : diagnostics) {
    require(!diagnostic.message.empty() && !diagnostic.code.empty());
    require(!rr::format_diagnostic(diagnostic).empty());
    if (diagnostic.severity == rr::Severity::error) return true;
  }
  return false;
}

void check_print(const rr::ServiceDefinition& definition, rr::RobdefMode mode) {
  const auto printed = rr::format_service_definition(definition);
  const auto again = rr::parse_service_definition(printed, mode);
  require(again.ok());
  require(rr::test::is_equal(again.definition, definition));
  require(rr::format_service_definition(again.definition) == printed);
}

/// Whether the set is accepted.
bool check_set(std::string_view text, rr::RobdefMode mode) {
  std::deque<rr::ServiceDefinition> definitions;
  std::vector<rr::ServiceDefinition*> set;
  bool is_good = true;
  while (true) {
    const auto end = text.find('\0');
    auto result = rr::parse_service_definition(text.substr(0, end), mode);
    is_good = !has_errors(result.diagnostics) && is_good;
    set.push_back(&definitions.emplace_back(std::move(result.definition)));
    if (end == std::string_view::npos || definitions.size() == most_definitions) break;
    text.remove_prefix(end + 1);
  }
  // Broken definitions must be harmless, too.
  const auto first = rr::verify_service_definitions(set, mode);
  is_good = !has_errors(first) && is_good;
  require(rr::verify_service_definitions(set, mode).size() == first.size());
  for (const auto& definition : definitions) {
    rr::format_service_definition(definition);
    if (is_good) check_print(definition, mode);
  }
  return is_good;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const bool is_strict = check_set(text, rr::RobdefMode::strict);
  const bool is_compat = check_set(text, rr::RobdefMode::compat);
  require(is_compat || !is_strict);
  return 0;
}
