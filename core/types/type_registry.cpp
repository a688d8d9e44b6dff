#include "core/types/type_registry.hpp"

#include <algorithm>
#include <set>

#include "core/robdef/model/names.hpp"

namespace rr {

namespace {

template <class Index>
auto find_in(const Index& index, std::string_view name) {
  const auto found = index.find(name);
  return found == index.end() ? nullptr : found->second;
}

Error definition_error(const Diagnostic& diagnostic) {
  const auto service = diagnostic.service.empty() ? std::string() : " " + quote(diagnostic.service);
  return make_error(ErrorCode::service_definition_error,
                    "service definition" + service + ": " + format_diagnostic(diagnostic));
}

/// The first error, if there is one; warnings go to `warnings`.
const Diagnostic* sort_out(const std::vector<Diagnostic>& diagnostics, std::vector<Diagnostic>& warnings) {
  for (const auto& diagnostic : diagnostics) {
    if (diagnostic.severity == Severity::error) return &diagnostic;
    warnings.push_back(diagnostic);
  }
  return nullptr;
}

/// Orders verified definitions (no cycles among imports) with imports before importers.
class ImportOrder {
 public:
  explicit ImportOrder(std::vector<std::unique_ptr<ServiceDefinition>>& from) : from_(from) {}

  std::vector<std::unique_ptr<ServiceDefinition>> take() {
    // Depth first without recursion: a peer decides how long a chain of imports is.
    for (std::size_t start = 0; start < from_.size(); ++start) {
      if (from_[start]) open_.push_back({start});
      while (!open_.empty()) step();
    }
    return std::move(ordered_);
  }

 private:
  struct Visit {
    std::size_t index;
    std::size_t next_import = 0;
  };

  void step() {
    auto& visit = open_.back();
    if (!from_[visit.index]) return open_.pop_back();
    const auto& imports = from_[visit.index]->imports;
    if (visit.next_import < imports.size()) {
      const auto wanted = find(imports[visit.next_import++].name);
      if (wanted < from_.size()) open_.push_back({wanted});
      return;
    }
    ordered_.push_back(std::move(from_[visit.index]));
    open_.pop_back();
  }

  std::size_t find(std::string_view name) const {
    const auto found = std::find_if(from_.begin(), from_.end(),
                                    [name](const auto& definition) { return definition && definition->name == name; });
    return static_cast<std::size_t>(found - from_.begin());
  }

  std::vector<std::unique_ptr<ServiceDefinition>>& from_;
  std::vector<std::unique_ptr<ServiceDefinition>> ordered_;
  std::vector<Visit> open_;
};

}  // namespace

Result<> TypeRegistry::add(const std::vector<std::string>& texts, RobdefMode mode) {
  Definitions added;
  std::vector<Diagnostic> warnings;
  for (const auto& text : texts) {
    auto parsed = parse_service_definition(text, mode);
    const auto& name = parsed.definition.name;
    if (find_service(name)) continue;
    const auto is_same = [&](const auto& other) {
      return other->name == name && other->text == parsed.definition.text;
    };
    if (std::any_of(added.begin(), added.end(), is_same)) continue;
    if (const auto* error = sort_out(parsed.diagnostics, warnings)) return definition_error(*error);
    added.push_back(std::make_unique<ServiceDefinition>(std::move(parsed.definition)));
  }
  if (added.empty()) return {};

  std::vector<ServiceDefinition*> set;
  for (const auto& definition : added) set.push_back(definition.get());
  auto findings = verify_service_definitions(set, known_imports(added), mode);
  std::erase_if(findings, [&](const Diagnostic& finding) {
    return finding.severity == Severity::warning && find_service(finding.service);
  });
  if (const auto* error = sort_out(findings, warnings)) return definition_error(*error);

  for (auto& definition : ImportOrder(added).take()) {
    services_.emplace(definition->name, definition.get());
    for (const auto& entity : definition->entities) entities_.emplace(entity.qualified_name, &entity);
    for (const auto& enumeration : definition->enums)
      enums_.emplace(definition->name + "." + enumeration.name, &enumeration);
    definitions_.push_back(std::move(definition));
  }
  warnings_.insert(warnings_.end(), warnings.begin(), warnings.end());
  return {};
}

std::vector<const ServiceDefinition*> TypeRegistry::known_imports(const Definitions& importers) const {
  std::vector<const ServiceDefinition*> known;
  std::set<std::string_view> seen;
  const auto add_from = [&](const ServiceDefinition& importer) {
    for (const auto& import : importer.imports)
      if (const auto* found = find_service(import.name); found && seen.insert(found->name).second)
        known.push_back(found);
  };
  for (const auto& importer : importers) add_from(*importer);
  for (std::size_t i = 0; i < known.size(); ++i) add_from(*known[i]);
  return known;
}

const ServiceDefinition* TypeRegistry::find_service(std::string_view name) const {
  return find_in(services_, name);
}

const EntityDefinition* TypeRegistry::find_entity(std::string_view qualified_name) const {
  return find_in(entities_, qualified_name);
}

const EnumDefinition* TypeRegistry::find_enum(std::string_view qualified_name) const {
  return find_in(enums_, qualified_name);
}

}  // namespace rr
