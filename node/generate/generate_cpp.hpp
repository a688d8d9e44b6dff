// C++ classes of service definitions: values, clients, services. Layer: definitions.
// Source: service definitions spec sections 5.9 (identifiers), 5.12.
#pragma once

#include <string>

#include "node/generate/definition_set.hpp"

namespace rrgate {

struct CppFiles {
  std::string name;  ///< without suffix: "com__example__robot"
  std::string header;
  std::string source;
};

/// Header and source of one definition of a good set. Docs: docs/definition-tools.md.
CppFiles generate_cpp(const DefinitionSet& set, const rr::ServiceDefinition& definition);

}  // namespace rrgate
