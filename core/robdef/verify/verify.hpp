// What definitions mean together: imports, names, types. Layer: robdef. Source: service definitions spec section 5.8.
#pragma once

#include <span>
#include <vector>

#include "core/robdef/model/diagnostic.hpp"
#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// Verifies a set that holds all imports transitively and fills in resolved types (TypeDefinition::type and
/// qualified_name, ImplementsDefinition::qualified_name, namedarray_type/_count).
/// Definitions that were verified before may be in the set again.
/// Returns  every finding, by definition and line; the set is usable where none is an error.
std::vector<Diagnostic> verify_service_definitions(std::span<ServiceDefinition* const> set, RobdefMode mode);

/// The same for a set whose imports are in use already: those are not written to.
/// `known`  verified before, as far as the set imports it. What is found in them is found again.
std::vector<Diagnostic> verify_service_definitions(std::span<ServiceDefinition* const> set,
                                                   std::span<const ServiceDefinition* const> known, RobdefMode mode);

}  // namespace rr
