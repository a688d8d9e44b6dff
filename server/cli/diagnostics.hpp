// What is wrong with service definitions, for the terminal. Layer: server/cli.
#pragma once

#include <iostream>

#include "node/generate/definition_set.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

inline rr::RobdefMode mode_of(const ParsedArguments& parsed) {
  return parsed.flags.count("--compat") != 0 ? rr::RobdefMode::compat : rr::RobdefMode::strict;
}

/// Prints all diagnostics to stderr; returns whether the definitions can be used.
inline bool report_diagnostics(const DefinitionSet& set) {
  for (const auto& diagnostic : set.diagnostics()) std::cerr << rr::format_diagnostic(diagnostic) << "\n";
  return set.is_good();
}

}  // namespace rrgate
