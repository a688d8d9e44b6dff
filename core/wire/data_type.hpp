// What an element holds, as a number on the wire. Layer: wire. Source: messages spec section 7.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rr {

/// ElementType on the wire, and the type words of service definitions.
enum class DataType : std::uint16_t {
  void_t = 0,
  double_t = 1,
  single_t = 2,
  int8_t = 3,
  uint8_t = 4,
  int16_t = 5,
  uint16_t = 6,
  int32_t = 7,
  uint32_t = 8,
  int64_t = 9,
  uint64_t = 10,
  string_t = 11,
  cdouble_t = 12,
  csingle_t = 13,
  bool_t = 14,
  structure_t = 101,
  map_int32_t = 102,   ///< "vector" on the wire
  map_string_t = 103,  ///< "dictionary" on the wire
  object_t = 104,
  varvalue_t = 105,
  varobject_t = 106,
  list_t = 108,
  pod_t = 109,
  pod_array_t = 110,
  pod_multidimarray_t = 111,
  enum_t = 112,
  namedtype_t = 113,
  namedarray_t = 114,
  namedarray_array_t = 115,
  namedarray_multidimarray_t = 116,
  multidimarray_t = 117,
};

/// Bytes of one item of types 1..14 (string: 1); 0 for every other type.
constexpr std::size_t item_size(DataType type) {
  constexpr std::uint8_t sizes[] = {0, 8, 4, 1, 1, 2, 2, 4, 4, 8, 8, 1, 16, 8, 1};
  const auto index = static_cast<std::uint16_t>(type);
  return index < sizeof(sizes) ? sizes[index] : 0;
}

/// Whether elements of this type hold elements (101, 102, 103, 108..111, 115..117).
constexpr bool is_nested(DataType type) {
  switch (type) {
    case DataType::structure_t:
    case DataType::map_int32_t:
    case DataType::map_string_t:
    case DataType::list_t:
    case DataType::pod_t:
    case DataType::pod_array_t:
    case DataType::pod_multidimarray_t:
    case DataType::namedarray_array_t:
    case DataType::namedarray_multidimarray_t:
    case DataType::multidimarray_t:
      return true;
    default:
      return false;
  }
}

/// Numeric in the sense of service definitions: 1..10 and 12..14 (complex and bool included).
constexpr bool is_numeric(DataType type) {
  return item_size(type) != 0 && type != DataType::string_t;
}

/// "double", "int32", "structure", "vector", ... ; "type 99" style names are never returned: unknown gives "unknown".
std::string_view data_type_name(DataType type);

}  // namespace rr
