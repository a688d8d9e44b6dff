#include "core/wire/data_type.hpp"

namespace rr {

std::string_view data_type_name(DataType type) {
  switch (type) {
    case DataType::void_t:
      return "void";
    case DataType::double_t:
      return "double";
    case DataType::single_t:
      return "single";
    case DataType::int8_t:
      return "int8";
    case DataType::uint8_t:
      return "uint8";
    case DataType::int16_t:
      return "int16";
    case DataType::uint16_t:
      return "uint16";
    case DataType::int32_t:
      return "int32";
    case DataType::uint32_t:
      return "uint32";
    case DataType::int64_t:
      return "int64";
    case DataType::uint64_t:
      return "uint64";
    case DataType::string_t:
      return "string";
    case DataType::cdouble_t:
      return "cdouble";
    case DataType::csingle_t:
      return "csingle";
    case DataType::bool_t:
      return "bool";
    case DataType::structure_t:
      return "structure";
    case DataType::map_int32_t:
      return "vector";
    case DataType::map_string_t:
      return "dictionary";
    case DataType::object_t:
      return "object";
    case DataType::varvalue_t:
      return "varvalue";
    case DataType::varobject_t:
      return "varobject";
    case DataType::list_t:
      return "list";
    case DataType::pod_t:
      return "pod";
    case DataType::pod_array_t:
      return "pod_array";
    case DataType::pod_multidimarray_t:
      return "pod_multidimarray";
    case DataType::enum_t:
      return "enum";
    case DataType::namedtype_t:
      return "namedtype";
    case DataType::namedarray_t:
      return "namedarray";
    case DataType::namedarray_array_t:
      return "namedarray_array";
    case DataType::namedarray_multidimarray_t:
      return "namedarray_multidimarray";
    case DataType::multidimarray_t:
      return "multidimarray";
  }
  return "unknown";
}

}  // namespace rr
