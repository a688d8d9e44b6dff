#include "node/generate/definition_set.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <set>

#include "core/robdef/model/names.hpp"
#include "node/platform/text_file.hpp"

namespace rrgate {

namespace {

/// Where each definition begins: comments above its "service" belong to it.
std::vector<std::size_t> find_definitions(std::string_view text) {
  std::vector<std::size_t> begins{0};
  std::size_t after_statement = 0;  // of the last line that says something
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find('\n', at), text.size() - 1) + 1;
    auto line = text.substr(at, end - at);
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r\n"), line.size()));
    if (line.starts_with("service ") && after_statement != 0) begins.push_back(after_statement);
    if (!line.empty() && !line.starts_with('#')) after_statement = end;
    at = end;
  }
  return begins;
}

std::vector<rr::ParseResult> parse_standard_input(rr::RobdefMode mode) {
  const std::string text(std::istreambuf_iterator<char>(std::cin), {});
  const auto begins = find_definitions(text);
  std::vector<rr::ParseResult> out;
  for (std::size_t i = 0; i < begins.size(); ++i) {
    const auto end = i + 1 < begins.size() ? begins[i + 1] : text.size();
    const auto part = text.substr(begins[i], end - begins[i]);
    const auto lines = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(begins[i]), '\n');
    out.push_back(rr::parse_service_definition(std::string(static_cast<std::size_t>(lines), '\n') + part, mode, "-"));
    out.back().definition.text = part;
  }
  return out;
}

}  // namespace

std::optional<std::vector<rr::ParseResult>> parse_definitions(const std::string& file, rr::RobdefMode mode) {
  if (file == "-") return parse_standard_input(mode);
  const auto text = read_text_file(file);
  if (!text) return std::nullopt;
  return std::vector{rr::parse_service_definition(*text, mode, file)};
}

DefinitionSet DefinitionSet::from_files(std::span<const std::string> files, std::span<const std::string> folders,
                                        rr::RobdefMode mode) {
  DefinitionSet set(mode);
  for (const auto& file : files) {
    const auto before = set.definitions_.size();
    set.add_file(file);
    for (auto i = before; i < set.definitions_.size(); ++i) set.requested_.push_back(&set.definitions_[i]);
  }
  set.add_imports(folders);
  set.verify();
  return set;
}

DefinitionSet DefinitionSet::from_texts(std::span<const std::string> texts, rr::RobdefMode mode) {
  DefinitionSet set(mode);
  for (const auto& text : texts) set.requested_.push_back(set.add(rr::parse_service_definition(text, mode)));
  set.verify();
  return set;
}

const rr::ServiceDefinition* DefinitionSet::add(rr::ParseResult parsed) {
  std::move(parsed.diagnostics.begin(), parsed.diagnostics.end(), std::back_inserter(diagnostics_));
  definitions_.push_back(std::move(parsed.definition));
  return &definitions_.back();
}

bool DefinitionSet::add_file(const std::string& file) {
  if (auto parsed = parse_definitions(file, mode_)) {
    for (auto& each : *parsed) add(std::move(each));
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
