// ServiceDefinition -> its canonical text. Layer: robdef. Source: service definitions spec section 5.9.
#pragma once

#include <string>

#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// The canonical text (spec section 5.9).
std::string format_service_definition(const ServiceDefinition& definition);

}  // namespace rr
