// The canonical text. Layer: robdef. Source: service definitions spec section 5.9.
#include <algorithm>

#include "core/robdef/format/format.hpp"
#include "core/robdef/format/statement_text.hpp"
#include "core/robdef/model/canonical_names.hpp"
#include "core/robdef/model/names.hpp"
#include "core/robdef/model/version_levels.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

class Writer {
 public:
  explicit Writer(const ServiceDefinition& definition) : definition_(definition), names_(definition) {}

  std::string write();

 private:
  void write_version();
  void write_options();
  void write_enum(const EnumDefinition& item);
  void write_entity(const EntityDefinition& item);

  const ServiceDefinition& definition_;
  CanonicalNames names_;
  std::string out_ = {};
};

std::string Writer::write() {
  out_ = "service " + definition_.name + "\n\n";
  const bool options_first = has_options_before_version(definition_);
  if (options_first) write_options();
  write_version();
  for (const auto& item : definition_.imports) out_ += "import " + item.name + '\n';
  if (!definition_.imports.empty()) out_ += '\n';
  for (const auto& item : definition_.usings) out_ += using_text(item) + '\n';
  if (!definition_.usings.empty()) out_ += '\n';
  if (!options_first) write_options();
  for (const auto& item : definition_.constants) out_ += constant_text(item) + '\n';
  if (!definition_.constants.empty()) out_ += '\n';
  for (const auto& item : definition_.enums) write_enum(item);
  if (!definition_.enums.empty()) out_ += '\n';
  for (const auto& item : definition_.exceptions) out_ += "exception " + item.name + '\n';
  if (!definition_.exceptions.empty()) out_ += '\n';
  for (const auto kind : {EntityKind::structure, EntityKind::pod, EntityKind::namedarray, EntityKind::object}) {
    for (const auto& item : definition_.entities) {
      if (item.kind == kind) write_entity(item);
    }
  }
  return std::move(out_);
}

void Writer::write_version() {
  if (definition_.version.is_unspecified() || has_option_version(definition_)) return;
  out_ += definition_.version < first_stdver ? "option version " : "stdver ";
  out_ += format_version(definition_.version) + "\n\n";
}

void Writer::write_options() {
  for (const auto& item : definition_.options) out_ += "option " + item.text + '\n';
  if (!definition_.options.empty()) out_ += '\n';
}

void Writer::write_enum(const EnumDefinition& item) {
  out_ += "enum " + item.name + '\n';
  for (std::size_t i = 0; i < item.values.size(); ++i) {
    out_ += "    " + enum_value_text(item.values[i]) + (i + 1 < item.values.size() ? ",\n" : "\n");
  }
  if (item.values.empty()) out_ += '\n';
  out_ += "end\n\n";
}

void Writer::write_entity(const EntityDefinition& item) {
  out_ += entity_header_text(item) + '\n';
  for (const auto& base : item.implements) out_ += "    implements " + std::string(names_.name(base.name)) + '\n';
  for (const auto& option : item.options) out_ += "    option " + option.text + '\n';
  for (const auto& constant : item.constants) out_ += "    " + constant_text(constant) + '\n';
  for (const auto& member : item.members) out_ += "    " + member_text(member, &names_) + '\n';
  out_ += "end\n\n";
}

}  // namespace

CanonicalNames::CanonicalNames(const ServiceDefinition& definition) : service_(definition.name) {
  for (const auto& item : definition.usings) {
    targets_.emplace(item.alias, item.qualified_name);
    first_alias_.emplace(item.qualified_name, item.alias);
  }
}

std::string_view CanonicalNames::name(std::string_view written) const {
  const auto parts = split_qualified(written);
  if (!parts.service.empty() && parts.service == service_) return parts.name;
  const auto target = targets_.find(written);
  const auto alias = first_alias_.find(target == targets_.end() ? written : target->second);
  return alias == first_alias_.end() ? written : alias->second;
}

TypeDefinition CanonicalNames::type(const TypeDefinition& written) const {
  auto out = written;
  out.name = name(written.name);
  return out;
}

bool has_option_version(const ServiceDefinition& definition) {
  return std::any_of(definition.options.begin(), definition.options.end(), [](const OptionDefinition& option) {
    const auto words = split_words(option.text);
    return words.size() == 2 && words.front() == "version";
  });
}

bool has_options_before_version(const ServiceDefinition& definition) {
  return !definition.options.empty() && !definition.version_is_option && definition.version >= first_without_options;
}

std::string format_service_definition(const ServiceDefinition& definition) {
  return Writer(definition).write();
}

}  // namespace rr
