#include "node/generate/cpp_taken_names.hpp"

#include <algorithm>

namespace rrgate {

namespace {

constexpr std::string_view cpp_macros[] = {
#include "node/generate/cpp_macros.inc"
};

}  // namespace

bool is_macro(std::string_view name) {
  return std::ranges::binary_search(cpp_macros, name);
}

}  // namespace rrgate
