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

const Diagnostic* first_error(const std::vector<Diagnostic>& diagnostics) {
  const auto found = std::find_if(diagnostics.begin(), diagnostics.end(),
                                  [](const Diagnostic& diagnostic) { return diagnostic.severity == Severity::error; });
  return found == diagnostics.end() ? nullptr : &*found;
}

/// Orders verified definitions (no cycles among imports) with imports before importers.
class ImportOrder {
 public:
  explicit ImportOrder(TypeRegistry::Definitions& from) : from_(from) {}

  TypeRegistry::Definitions take() {
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

  TypeRegistry::Definitions& from_;
  TypeRegistry::Definitions ordered_;
  std::vector<Visit> open_;
};

}  // namespace

Result<> TypeRegistry::add(const std::vector<std::string>& texts, RobdefMode mode) {
  std::vector<ParseResult> parsed;
  for (const auto& text : texts) parsed.push_back(parse_service_definition(text, mode));
  return add_parsed(std::move(parsed), mode);
}

Result<> TypeRegistry::add_parsed(std::vector<ParseResult> parsed, RobdefMode mode) {
  Definitions added;
  std::vector<ServiceDefinition*> set;
  for (auto& [definition, diagnostics] : parsed) {
    if (find_service(definition.name)) continue;
    const auto is_same = [&definition = definition](const auto& other) {
      return other->name == definition.name && other->text == definition.text;
    };
    if (std::any_of(added.begin(), added.end(), is_same)) continue;
    if (const auto* error = first_error(diagnostics)) return definition_error(*error);
    auto made = std::make_shared<ServiceDefinition>(std::move(definition));
    set.push_back(made.get());
    added.push_back(std::move(made));
  }
  if (added.empty()) return {};
  const auto findings = verify_service_definitions(set, known_imports(added), mode);
  if (const auto* error = first_error(findings)) return definition_error(*error);
  for (auto& definition : ImportOrder(added).take()) insert(std::move(definition));
  return {};
}

void TypeRegistry::share(const TypeRegistry& from) {
  for (const auto& definition : from.definitions_)
    if (!find_service(definition->name)) insert(definition);
}

void TypeRegistry::insert(std::shared_ptr<const ServiceDefinition> definition) {
  services_.emplace(definition->name, definition.get());
  for (const auto& entity : definition->entities) entities_.emplace(entity.qualified_name, &entity);
  definitions_.push_back(std::move(definition));
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
  const auto [service, name] = split_qualified(qualified_name);
  const auto* definition = find_service(service);
  return definition ? definition->find_enum(name) : nullptr;
}

}  // namespace rr
