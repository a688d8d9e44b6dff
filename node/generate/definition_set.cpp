#include "node/generate/definition_set.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include "core/robdef/model/names.hpp"
#include "node/platform/text_file.hpp"

namespace rrgate {

DefinitionSet DefinitionSet::from_files(std::span<const std::string> files, std::span<const std::string> folders,
                                        rr::RobdefMode mode) {
  DefinitionSet set(mode);
  for (const auto& file : files) {
    if (set.add_file(file)) set.requested_.push_back(&set.definitions_.back());
  }
  set.add_imports(folders);
  set.verify();
  return set;
}

DefinitionSet DefinitionSet::from_texts(std::span<const std::string> texts, rr::RobdefMode mode) {
  DefinitionSet set(mode);
  for (const auto& text : texts) set.requested_.push_back(set.add(text, {}));
  set.verify();
  return set;
}

const rr::ServiceDefinition* DefinitionSet::add(std::string_view text, std::string_view file) {
  auto parsed = rr::parse_service_definition(text, mode_, file);
  std::move(parsed.diagnostics.begin(), parsed.diagnostics.end(), std::back_inserter(diagnostics_));
  definitions_.push_back(std::move(parsed.definition));
  return &definitions_.back();
}

bool DefinitionSet::add_file(const std::string& file) {
  const auto text = read_text_file(file);
  if (text) {
    add(*text, file);
    return true;
  }
  rr::Diagnostic diagnostic;
  diagnostic.code = "unreadable";
  diagnostic.message = "found no file that can be read, expected a service definition";
  diagnostic.file = file;
  diagnostics_.push_back(std::move(diagnostic));
  return false;
}

void DefinitionSet::add_imports(std::span<const std::string> folders) {
  // Definitions that come in here are walked as well.
  for (std::size_t i = 0; i < definitions_.size(); ++i) {
    const auto& importer = definitions_[i];
    const auto beside = std::filesystem::path(importer.file).parent_path();
    for (const auto& import : importer.imports) {
      const auto add_from = [&](const std::filesystem::path& folder) {
        const auto file = folder / (import.name + ".robdef");
        std::error_code error;
        return std::filesystem::is_regular_file(file, error) && add_file(file.string());
      };
      if (find_service(import.name) || add_from(beside)) continue;
      // One that is nowhere is reported by verify(), at the line of its import.
      for (const auto& folder : folders)
        if (add_from(folder)) break;
    }
  }
}

void DefinitionSet::verify() {
  std::vector<rr::ServiceDefinition*> set;
  for (auto& definition : definitions_) set.push_back(&definition);
  auto found = rr::verify_service_definitions(set, mode_);
  std::move(found.begin(), found.end(), std::back_inserter(diagnostics_));
}

bool DefinitionSet::is_good() const {
  return std::none_of(diagnostics_.begin(), diagnostics_.end(),
                      [](const auto& diagnostic) { return diagnostic.severity == rr::Severity::error; });
}

class DefinitionSet::ImportsFirst {
 public:
  explicit ImportsFirst(const DefinitionSet& set) : set_(set) {}

  void visit(const rr::ServiceDefinition& definition) {
    if (!seen_.insert(&definition).second) return;
    for (const auto& import : definition.imports) visit(*set_.find_service(import.name));
    order.push_back(&definition);
  }

  std::vector<const rr::ServiceDefinition*> order = {};

 private:
  const DefinitionSet& set_;
  std::set<const rr::ServiceDefinition*> seen_ = {};
};

std::vector<const rr::ServiceDefinition*> DefinitionSet::with_imports(const rr::ServiceDefinition& definition) const {
  ImportsFirst walk(*this);
  walk.visit(definition);
  return std::move(walk.order);
}

std::vector<const rr::ServiceDefinition*> DefinitionSet::in_order() const {
  ImportsFirst walk(*this);
  for (const auto& definition : definitions_) walk.visit(definition);
  return std::move(walk.order);
}

bool DefinitionSet::is_strict(const rr::ServiceDefinition& definition) const {
  std::vector<std::string> texts;
  for (const auto* part : with_imports(definition)) texts.push_back(part->text);
  return from_texts(texts, rr::RobdefMode::strict).is_good();
}

const rr::ServiceDefinition* DefinitionSet::find_service(std::string_view name) const {
  const auto found = std::find_if(definitions_.begin(), definitions_.end(),
                                  [&](const auto& definition) { return definition.name == name; });
  return found == definitions_.end() ? nullptr : &*found;
}

const rr::EntityDefinition* DefinitionSet::find_entity(std::string_view qualified_name) const {
  const auto [service, name] = rr::split_qualified(qualified_name);
  const auto* definition = find_service(service);
  return definition ? definition->find_entity(name) : nullptr;
}

bool DefinitionSet::has_service_within(std::string_view name) const {
  const auto inner = std::string(name) + '.';
  return std::any_of(definitions_.begin(), definitions_.end(), [&](const auto& definition) {
    return definition.name == name || definition.name.starts_with(inner);
  });
}

}  // namespace rrgate
