// Names that the headers of generated C++ take, so that it cannot declare them. Layer: definitions.
// The list, cpp_macros.inc, is written by cpp_taken_names.py.
#pragma once

#include <string_view>

namespace rrgate {

/// Would be replaced wherever it stands.
bool is_macro(std::string_view name);

}  // namespace rrgate
