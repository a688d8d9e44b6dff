#include "test/core/robdef/checked.hpp"

#include <algorithm>
#include <iterator>

namespace rr::test {

namespace {

std::vector<Diagnostic> of_severity(const std::vector<Diagnostic>& all, Severity severity) {
  std::vector<Diagnostic> out;
  std::copy_if(all.begin(), all.end(), std::back_inserter(out),
               [severity](const Diagnostic& item) { return item.severity == severity; });
  return out;
}

}  // namespace

std::vector<Diagnostic> Checked::errors() const {
  return of_severity(diagnostics, Severity::error);
}

std::vector<Diagnostic> Checked::warnings() const {
  return of_severity(diagnostics, Severity::warning);
}

bool Checked::has(Severity severity, std::string_view code) const {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [&](const Diagnostic& item) { return item.severity == severity && item.code == code; });
}

std::string Checked::report() const {
  std::string out;
  for (const auto& item : diagnostics) out += format_diagnostic(item) + '\n';
  return out;
}

Checked check(std::string_view text, RobdefMode mode, const std::vector<std::string>& imports) {
  Checked checked;
  bool is_parsed = true;
  const auto add = [&](std::string_view source) {
    auto result = parse_service_definition(source, mode);
    is_parsed = is_parsed && result.ok();
    checked.definitions.push_back(std::move(result.definition));
    std::move(result.diagnostics.begin(), result.diagnostics.end(), std::back_inserter(checked.diagnostics));
  };
  add(text);
  for (const auto& import : imports) add(import);
  if (!is_parsed) return checked;
  std::vector<ServiceDefinition*> set;
  for (auto& definition : checked.definitions) set.push_back(&definition);
  auto found = verify_service_definitions(set, mode);
  std::move(found.begin(), found.end(), std::back_inserter(checked.diagnostics));
  return checked;
}

Checked check_body(std::string_view body, RobdefMode mode, const std::vector<std::string>& imports) {
  return check("service demo.a\nstdver 0.10\n" + std::string(body), mode, imports);
}

}  // namespace rr::test
