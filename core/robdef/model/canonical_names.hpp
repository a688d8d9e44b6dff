// How names of other definitions are written in the canonical text. Layer: robdef.
// Source: service definitions spec section 5.9.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// Borrows the definition for life.
class CanonicalNames {
 public:
  explicit CanonicalNames(const ServiceDefinition& definition);

  /// Qualified names that have an alias become the first one; later aliases too; self-qualified names lose the service.
  std::string_view name(std::string_view written) const;
  TypeDefinition type(const TypeDefinition& written) const;

 private:
  std::string_view service_;
  std::map<std::string_view, std::string_view> targets_ = {};      ///< alias -> qualified name
  std::map<std::string_view, std::string_view> first_alias_ = {};  ///< qualified name -> alias
};

/// Whether options stand before the version: the one order that existing peers read at stdver 0.9.2 and up.
bool has_options_before_version(const ServiceDefinition& definition);
/// Whether one of the options is `option version`.
bool has_option_version(const ServiceDefinition& definition);

}  // namespace rr
