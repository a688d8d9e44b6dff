// Lays out the source of a definition for its authors. Layer: robdef. Source: service definitions spec section 5.9.
#pragma once

#include <string>

#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// `definition.text` with comments, documentation, order and grouping kept: one statement or enum value a line,
/// indented by four, spaced canonically; at most one blank line in a row; members of more than 79 columns wrapped by
/// '\'. The canonical text of the result is that of the source. `definition`  parsed in strict mode, without errors.
std::string format_source(const ServiceDefinition& definition);

}  // namespace rr
