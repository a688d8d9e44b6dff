// On which terms an agent may write or call something. Layer: server/access. See docs/mcp.md.
#pragma once

#include <chrono>
#include <map>
#include <string>

#include "core/support/error.hpp"
#include "server/json/json.hpp"

namespace rrgate {

/// Mirrors "agent" of a rule in gateway.schema.json.
struct AgentTerms {
  struct Range {
    double least = 0;
    double most = 0;
    bool operator==(const Range&) const = default;
  };
  /// By the name of a parameter or of the property, with a dot before each field: "velocity", "goal.speed".
  std::map<std::string, Range> limits = {};
  bool needs_approval = true;    ///< of a person, each time
  bool needs_lease = true;       ///< of the object, for as long as it moves
  std::chrono::seconds hold{5};  ///< how long the lease is held behind the answer

  /// Whether values may be sent at all. `values`  an object, by the names of parameters, or of the property.
  /// Errors   out_of_range: a place that has a limit is not there, is no finite number, or lies outside.
  rr::Result<> check(const rr::OrderedJson& values) const;
  /// What both ask for.
  void add(const AgentTerms& other);
  bool operator==(const AgentTerms&) const = default;
};

}  // namespace rrgate
