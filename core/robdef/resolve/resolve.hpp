// What definitions mean together, for who did not write them. Layer: robdef. Source: service definitions spec
// section 5.8.
#pragma once

#include <span>
#include <vector>

#include "core/robdef/model/diagnostic.hpp"
#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// Fills in what verify_service_definitions() fills in, at a seventh of its size. It refuses what values could not be
/// packed or unpacked by (unknown and unusable types, cycles of imports, pods and namedarrays), in fewer words; all
/// else that is wrong with a definition is the business of its author.
/// `known`  what was resolved before, as far as the set imports it.
///
/// Returns  the first error of each definition of the set that has one.
std::vector<Diagnostic> resolve_service_definitions(std::span<ServiceDefinition* const> set,
                                                    std::span<const ServiceDefinition* const> known = {});

}  // namespace rr
