// Sizes of arrays: what a declared type allows and what dims multiply to. Layer: types.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "core/robdef/model/service_definition.hpp"

namespace rr {

inline bool is_multidim(const TypeDefinition& type) {
  return type.array == ArrayKind::multidim || type.array == ArrayKind::fixed_multidim;
}

/// Product of dims or of declared sizes (dims = {rows, columns, ...}); none where it does not fit 64 bits.
/// No dims at all: 1, a single item.
template <class Size>
std::optional<std::uint64_t> product_of(std::span<const Size> dims) {
  std::uint64_t product = 1;
  bool fits = true;
  for (const auto dim : dims) {
    const auto size = static_cast<std::uint64_t>(dim);
    if (size == 0) return 0;
    fits = fits && product <= std::numeric_limits<std::uint64_t>::max() / size;
    if (fits) product *= size;
  }
  return fits ? std::optional(product) : std::nullopt;
}

/// Whether `dims` are those that a fixed_multidim type declares. Any other type takes every shape.
bool has_declared_dims(const TypeDefinition& type, std::span<const std::uint32_t> dims);

/// "", or what is wrong with `count` values where `type` declares an array: "has 3, expected 4".
/// Multi-dim types in pods travel as plain arrays: their count must be the product of the declared sizes.
std::string wrong_count(const TypeDefinition& type, std::size_t count);

/// "[2,3]".
std::string dims_text(std::span<const std::uint32_t> dims);

/// The type without its container: what one item of a list or map is, and what a type without container is itself.
std::string item_type_text(const TypeDefinition& type);

}  // namespace rr
