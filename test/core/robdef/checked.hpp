// Parses and verifies texts, as every user of core/robdef does.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "core/robdef/robdef.hpp"

namespace rr::test {

/// The definitions and all that was found about them; verification is left out where a text did not parse.
struct Checked {
  std::deque<ServiceDefinition> definitions = {};  ///< the first one is the text under test
  std::vector<Diagnostic> diagnostics = {};

  ServiceDefinition& first() { return definitions.front(); }
  bool ok() const { return errors().empty(); }
  std::vector<Diagnostic> errors() const;
  std::vector<Diagnostic> warnings() const;
  bool has(Severity severity, std::string_view code) const;
  /// One line a finding, for failure messages.
  std::string report() const;
};

Checked check(std::string_view text, RobdefMode mode = RobdefMode::strict,
              const std::vector<std::string>& imports = {});

/// "service demo.a\nstdver 0.10\n" and the body: the body begins at line 3.
Checked check_body(std::string_view body, RobdefMode mode = RobdefMode::strict,
                   const std::vector<std::string>& imports = {});

}  // namespace rr::test
