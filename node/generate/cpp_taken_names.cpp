#include "node/generate/cpp_taken_names.hpp"

#include <algorithm>

namespace rrgate {

namespace {

// Both sorted.
constexpr std::string_view cpp_macros[] = {
#include "node/generate/cpp_macros.inc"
};
constexpr std::string_view cpp_globals[] = {
#include "node/generate/cpp_globals.inc"
};

}  // namespace

bool is_macro(std::string_view name) {
  return std::ranges::binary_search(cpp_macros, name);
}

bool is_global(std::string_view name) {
  return std::ranges::binary_search(cpp_globals, name);
}

}  // namespace rrgate
