// Names that the headers of generated C++ take, so that it cannot declare them. Layer: definitions.
// The lists, cpp_*.inc, are written by cpp_taken_names.py.
#pragma once

#include <string_view>

namespace rrgate {

/// Would be replaced wherever it stands.
bool is_macro(std::string_view name);
/// A function, variable or type outside namespaces: no namespace there has this name.
bool is_global(std::string_view name);

}  // namespace rrgate
