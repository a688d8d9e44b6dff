#include "node/values/handler.hpp"

#include <limits>

namespace rr {

namespace {

bool is_integer(DataType type) {
  return type >= DataType::int8_t && type <= DataType::uint64_t;
}
bool is_signed(DataType type) {
  return type == DataType::int8_t || type == DataType::int16_t || type == DataType::int32_t ||
         type == DataType::int64_t;
}
bool is_floating(DataType type) {
  return type == DataType::double_t || type == DataType::single_t;
}
bool is_complex(DataType type) {
  return type == DataType::cdouble_t || type == DataType::csingle_t;
}

/// The number or text type in which values of `type` reach a handler; void_t where only rr::Value can hold them.
HandlerType plain_type(const TypeDefinition& type) {
  if (type.container != ContainerKind::none) return {};
  const DataType item = type.type == DataType::enum_t ? DataType::int32_t : type.type;
  switch (type.array) {
    case ArrayKind::none:
      return {item_size(item) != 0 ? item : DataType::void_t, false};
    case ArrayKind::variable:
    case ArrayKind::fixed:
    case ArrayKind::max:
      return {is_numeric(item) ? item : DataType::void_t, true};
    default:
      return {};
  }
}

/// Whether `to` holds every number of type `from`.
bool widens(DataType from, DataType to) {
  if (from == to) return true;
  if (is_integer(from) && is_integer(to))
    return is_signed(from) ? is_signed(to) && item_size(to) >= item_size(from) : item_size(to) > item_size(from);
  return is_floating(from) && is_floating(to) && item_size(to) >= item_size(from);
}

bool is_same_family(DataType a, DataType b) {
  return a == b || (is_integer(a) && is_integer(b)) || (is_floating(a) && is_floating(b)) ||
         (is_complex(a) && is_complex(b));
}

}  // namespace

std::string handler_type_text(const HandlerType& type) {
  if (type.type == DataType::varvalue_t) return "any value";
  if (type.type == DataType::void_t) return "nothing";
  return std::string(data_type_name(type.type)) + (type.is_array ? "[]" : "");
}

bool accepts(const HandlerType& handler, const TypeDefinition& type) {
  if (handler.type == DataType::varvalue_t) return true;
  const HandlerType plain = plain_type(type);
  if (plain.type == DataType::void_t || plain.is_array != handler.is_array) return false;
  return plain.is_array ? plain.type == handler.type : widens(plain.type, handler.type);
}

bool returns(const HandlerType& handler, const TypeDefinition& type) {
  const bool is_void = type.type == DataType::void_t && type.container == ContainerKind::none;
  if (is_void) return handler.type == DataType::void_t;
  if (handler.type == DataType::varvalue_t) return true;
  const HandlerType plain = plain_type(type);
  if (plain.type == DataType::void_t || plain.is_array != handler.is_array) return false;
  return plain.is_array ? plain.type == handler.type : is_same_family(plain.type, handler.type);
}

}  // namespace rr
