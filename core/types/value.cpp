#include "core/types/value.hpp"

#include <algorithm>

#include "core/support/sort.hpp"
#include "core/types/number.hpp"

namespace rr {

namespace {

/// Maps are equal whatever the order of their items; keys are unique.
template <class Map>
bool is_same_map(const Map& left, const Map& right) {
  if (left.items == right.items) return true;
  if (left.items.size() != right.items.size()) return false;
  using Item = typename decltype(left.items)::value_type;
  const auto sorted = [](const Map& map) {
    std::vector<const Item*> items;
    items.reserve(map.items.size());
    for (const auto& item : map.items) items.push_back(&item);
    rr::sort(items, [](const Item* a, const Item* b) { return a->first < b->first; });
    return items;
  };
  const auto left_items = sorted(left);
  const auto right_items = sorted(right);
  return std::equal(left_items.begin(), left_items.end(), right_items.begin(),
                    [](const Item* a, const Item* b) { return *a == *b; });
}

bool is_same_bytes(ByteSpan left, ByteSpan right) {
  return std::equal(left.begin(), left.end(), right.begin(), right.end());
}

template <class Named>
std::string named_text(const Named& value) {
  const std::string name = value.type_name.empty() ? "unnamed" : value.type_name;
  return name + (value.is_scalar ? "" : value.is_multidim ? "[*]" : "[]");
}

}  // namespace

Scalar Scalar::from_bytes(DataType type, ByteSpan bytes) {
  Scalar scalar{type};
  std::memcpy(scalar.storage.data(), bytes.data(), item_size(type));
  if (type == DataType::bool_t) scalar.storage[0] = scalar.storage[0] != 0;
  return scalar;
}

bool Scalar::operator==(const Scalar& other) const {
  return type == other.type && is_same_bytes(bytes(), other.bytes());
}

Array Array::copy(DataType type, ByteSpan bytes) {
  Array array = empty(type);
  if (bytes.empty()) return array;
  // new[] aligns for every item type; a vector would first fill with zeros.
  std::shared_ptr<std::uint8_t[]> owner(new std::uint8_t[bytes.size()]);
  std::memcpy(owner.get(), bytes.data(), bytes.size());
  if (type == DataType::bool_t)
    for (std::size_t i = 0; i < bytes.size(); ++i) owner[i] = owner[i] != 0;
  array.bytes_ = {owner.get(), bytes.size()};
  array.owner_ = std::move(owner);
  return array;
}

Array Array::empty(DataType type) {
  Array array;
  array.type_ = type;
  return array;
}

bool Array::operator==(const Array& other) const {
  return type_ == other.type_ && is_same_bytes(bytes_, other.bytes_);
}

const Value* Structure::find(std::string_view name) const {
  for (const auto& field : fields)
    if (field.name == name) return &field.value;
  return nullptr;
}

bool Structure::operator==(const Structure& other) const {
  return type_name == other.type_name && fields == other.fields;
}

bool PodArray::operator==(const PodArray& other) const {
  return type_name == other.type_name && items == other.items && dims == other.dims && is_scalar == other.is_scalar &&
         is_multidim == other.is_multidim;
}

bool List::operator==(const List& other) const {
  return items == other.items;
}

bool MapInt32::operator==(const MapInt32& other) const {
  return is_same_map(*this, other);
}

const Value* MapString::find(std::string_view key) const {
  for (const auto& [item_key, value] : items)
    if (item_key == key) return &value;
  return nullptr;
}

bool MapString::operator==(const MapString& other) const {
  return is_same_map(*this, other);
}

template <Number T>
Result<T> Value::to() const {
  constexpr auto type = data_type_of<T>();
  const auto* scalar = get_if<Scalar>();
  Scalar first;
  if (const auto* array = get_if<Array>(); array && array->size() == 1) {
    first = Scalar::from_bytes(array->type(), array->bytes());
    scalar = &first;
  }
  Scalar converted;
  const auto conversion = scalar ? convert_number(*scalar, type, converted) : Conversion::wrong_kind;
  if (conversion == Conversion::ok) return load<T>(converted.storage.data());
  const std::string found = type_text() + (scalar ? " " + number_text(*scalar) : "");
  if (conversion == Conversion::out_of_range)
    return make_error(ErrorCode::out_of_range, found + " does not fit " + std::string(data_type_name(type)));
  return make_error(ErrorCode::data_type_mismatch,
                    "found " + found + ", expected " + std::string(data_type_name(type)));
}

Result<std::string_view> Value::to_text() const {
  if (const auto* text = get_if<std::string>()) return std::string_view(*text);
  return make_error(ErrorCode::data_type_mismatch, "found " + type_text() + ", expected string");
}

template <Number T>
Result<std::span<const T>> Value::to_items() const {
  constexpr auto type = data_type_of<T>();
  if (const auto* array = get_if<Array>(); array && array->type() == type) return array->items<T>();
  if (const auto* scalar = get_if<Scalar>(); scalar && scalar->type == type)
    return std::span<const T>(reinterpret_cast<const T*>(scalar->storage.data()), 1);
  return make_error(ErrorCode::data_type_mismatch,
                    "found " + type_text() + ", expected " + std::string(data_type_name(type)) + "[]");
}

#define RR_INSTANTIATE(T)               \
  template Result<T> Value::to() const; \
  template Result<std::span<const T>> Value::to_items() const;
RR_INSTANTIATE(double)
RR_INSTANTIATE(float)
RR_INSTANTIATE(std::int8_t)
RR_INSTANTIATE(std::uint8_t)
RR_INSTANTIATE(std::int16_t)
RR_INSTANTIATE(std::uint16_t)
RR_INSTANTIATE(std::int32_t)
RR_INSTANTIATE(std::uint32_t)
RR_INSTANTIATE(std::int64_t)
RR_INSTANTIATE(std::uint64_t)
RR_INSTANTIATE(CDouble)
RR_INSTANTIATE(CSingle)
RR_INSTANTIATE(bool)
#undef RR_INSTANTIATE

std::string Value::type_text() const {
  if (const auto* scalar = get_if<Scalar>()) return std::string(data_type_name(scalar->type));
  if (const auto* array = get_if<Array>()) return std::string(data_type_name(array->type())) + "[]";
  if (const auto* multidim = get_if<MultiDimArray>())
    return std::string(data_type_name(multidim->array.type())) + "[*]";
  if (const auto* structure = get_if<Structure>())
    return structure->type_name.empty() ? "unnamed structure" : structure->type_name;
  if (const auto* pods = get_if<PodArray>()) return named_text(*pods);
  if (const auto* named = get_if<NamedArray>()) return named_text(*named);
  if (get_if<std::string>()) return "string";
  if (get_if<List>()) return "list";
  if (get_if<MapInt32>()) return "map{int32}";
  if (get_if<MapString>()) return "map{string}";
  return "null";
}

}  // namespace rr
