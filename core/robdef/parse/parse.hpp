// Text of a service definition -> ServiceDefinition. Layer: robdef. Source: service definitions spec.
#pragma once

#include <string_view>
#include <vector>

#include "core/robdef/model/diagnostic.hpp"
#include "core/robdef/model/service_definition.hpp"

namespace rr {

struct ParseResult {
  ServiceDefinition definition;  ///< usable where no diagnostic is an error
  std::vector<Diagnostic> diagnostics;
  bool ok() const;
};

/// Parses one definition; reports all errors, not only the first. Types are not resolved yet: verify() does that.
/// Time and memory are linear in the length of the text, whatever it holds.
ParseResult parse_service_definition(std::string_view text, RobdefMode mode, std::string_view file = {});

}  // namespace rr
