#include "core/types/multidim.hpp"

#include <algorithm>

namespace rr {

bool has_declared_dims(const TypeDefinition& type, std::span<const std::uint32_t> dims) {
  if (type.array != ArrayKind::fixed_multidim) return true;
  return std::equal(
      dims.begin(), dims.end(), type.sizes.begin(), type.sizes.end(),
      [](std::uint32_t dim, std::int32_t size) { return size >= 0 && dim == static_cast<std::uint32_t>(size); });
}

std::string wrong_count(const TypeDefinition& type, std::size_t count) {
  if (type.array != ArrayKind::fixed && type.array != ArrayKind::max && type.array != ArrayKind::fixed_multidim)
    return {};
  const auto declared = product_of(std::span<const std::int32_t>(type.sizes));
  const bool is_max = type.array == ArrayKind::max;
  if (declared && (is_max ? count <= *declared : count == *declared)) return {};
  return "has " + std::to_string(count) + ", expected " + (is_max ? "at most " : "") +
         (declared ? std::to_string(*declared) : "more than any value can hold");
}

std::string dims_text(std::span<const std::uint32_t> dims) {
  std::string text = "[";
  for (const auto dim : dims) {
    if (text.size() > 60) return text + ",...]";
    if (text.size() > 1) text += ',';
    text += std::to_string(dim);
  }
  return text + "]";
}

std::string item_type_text(const TypeDefinition& type) {
  auto item = type;
  item.container = ContainerKind::none;
  return format_type(item);
}

}  // namespace rr
