// TypeScript types of service definitions, for rrgate-client. Layer: definitions.
// Source: service definitions spec section 5.12.
#pragma once

#include <string>

#include "node/generate/definition_set.hpp"

namespace rrgate {

enum class TypeScriptFlavour {
  declarations,  ///< .d.ts: types alone
  module,        ///< .ts: also constants, and the values of enums
};

/// One module for all definitions of a good set. Docs: docs/definition-tools.md.
std::string generate_typescript(const DefinitionSet& set, TypeScriptFlavour flavour);

}  // namespace rrgate
