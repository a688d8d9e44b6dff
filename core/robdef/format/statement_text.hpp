// Single statements as text, spaced canonically, without indent and line end. Layer: robdef.
// Source: service definitions spec section 5.9.
#pragma once

#include <string>

#include "core/robdef/model/canonical_names.hpp"
#include "core/robdef/model/service_definition.hpp"

namespace rr {

std::string using_text(const UsingDefinition& item);
std::string constant_text(const ConstantDefinition& item);
/// Without comma.
std::string enum_value_text(const EnumValueDefinition& item);
std::string entity_header_text(const EntityDefinition& item);
/// `names`  how types of other definitions are called; nullptr: as written.
std::string member_text(const MemberDefinition& item, const CanonicalNames* names);

}  // namespace rr
