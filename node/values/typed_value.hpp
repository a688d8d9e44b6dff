// C++ types of generated code <-> Value. Layer: node/values. Source: service definitions spec section 5.12 (C++).
//
// Types and their C++ types: double: double, double[]: std::vector<double>, double[3]: std::array<double, 3>,
// double[*]: MultiDim<double>, double{list}: Nullable<std::vector<double>>, double{string}:
// Nullable<std::map<std::string, double>>, a struct: Nullable<Pose>, varvalue: Value. Enums, structs, pods and named
// arrays are classes of generated code, which tell what they are by members that begin with rr_.
#pragma once

#include <array>
#include <cstring>
#include <iterator>
#include <map>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/robdef/model/service_definition.hpp"
#include "core/types/value.hpp"
#include "node/values/exception.hpp"

namespace rr {

/// Null or a T, by value: copies copy the T. May hold a type that is not complete yet, so that structs nest.
template <class T>
class Nullable {
 public:
  Nullable() = default;
  Nullable(std::nullptr_t) {}
  Nullable(T value) : value_(std::make_unique<T>(std::move(value))) {}
  Nullable(const Nullable& other) : value_(other.value_ ? std::make_unique<T>(*other.value_) : nullptr) {}
  Nullable(Nullable&& other) noexcept = default;
  Nullable& operator=(const Nullable& other) { return *this = Nullable(other); }
  Nullable& operator=(Nullable&& other) noexcept = default;
  ~Nullable() = default;

  explicit operator bool() const { return value_ != nullptr; }
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return value_.get(); }
  const T* operator->() const { return value_.get(); }

  friend bool operator==(const Nullable& a, const Nullable& b) {
    return a.value_ && b.value_ ? *a.value_ == *b.value_ : !a.value_ && !b.value_;
  }

 private:
  std::unique_ptr<T> value_;
};

/// dims = {rows, columns, ...}; `data` column-major (first index fastest), as many as the product of dims.
template <class T>
struct MultiDim {
  std::vector<std::uint32_t> dims = {1, 0};
  std::vector<T> data = {};
  bool operator==(const MultiDim&) const = default;
};

namespace detail {

[[noreturn]] inline void refuse_value(const Value& value, const std::string& expected) {
  throw Exception(make_error(ErrorCode::data_type_mismatch, "found " + value.type_text() + ", expected " + expected));
}

template <class T>
T checked(Result<T> result) {
  if (!result) throw Exception(result.error());
  return std::move(*result);
}

enum class ArrayForm { scalar, array, multidim };

/// Numbers, pods or named arrays as one value.
template <class T>
Value pack_items(std::vector<T> items, ArrayForm form, std::vector<std::uint32_t> dims = {}) {
  const bool is_multidim = form == ArrayForm::multidim;
  if constexpr (Number<T>) {
    if (is_multidim) return MultiDimArray{std::move(dims), Array::take(std::move(items))};
    return Array::take(std::move(items));
  } else if constexpr (T::rr_kind == EntityKind::pod) {
    PodArray pods{std::string(T::rr_type), {}, std::move(dims), form == ArrayForm::scalar, is_multidim};
    pods.items.reserve(items.size());
    for (T& item : items) pods.items.push_back(rr_pack(std::move(item)));
    return pods;
  } else {
    using Item = typename T::rr_item;
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) == T::rr_count * sizeof(Item));
    const ByteSpan bytes{reinterpret_cast<const std::uint8_t*>(items.data()), items.size() * sizeof(T)};
    return NamedArray{std::string(T::rr_type), Array::copy(data_type_of<Item>(), bytes), std::move(dims),
                      form == ArrayForm::scalar, is_multidim};
  }
}

/// `dims` is set where the value has some.
template <class T>
std::vector<T> unpack_items(const Value& value, std::vector<std::uint32_t>& dims) {
  std::vector<T> items;
  if constexpr (Number<T>) {
    const auto* grid = value.get_if<MultiDimArray>();
    if (grid) dims = grid->dims;
    const Value plain = grid ? Value(grid->array) : value;
    const auto numbers = checked(plain.template to_items<T>());
    items.assign(numbers.begin(), numbers.end());
  } else if constexpr (T::rr_kind == EntityKind::pod) {
    const auto* pods = value.get_if<PodArray>();
    if (!pods) refuse_value(value, std::string(T::rr_type) + "[]");
    dims = pods->dims;
    items.resize(pods->items.size());
    for (std::size_t i = 0; i < items.size(); ++i) rr_unpack(pods->items[i], items[i]);
  } else {
    const auto* named = value.get_if<NamedArray>();
    if (!named || named->array.bytes().size() % sizeof(T) != 0 ||
        (named->array.size() != 0 && named->array.type() != data_type_of<typename T::rr_item>()))
      refuse_value(value, std::string(T::rr_type) + "[]");
    dims = named->dims;
    items.resize(named->array.bytes().size() / sizeof(T));
    if (!items.empty()) std::memcpy(items.data(), named->array.bytes().data(), named->array.bytes().size());
  }
  return items;
}

/// How a C++ type becomes a Value and back. This one: enums, and pods and named arrays as scalars.
template <class T>
struct Typed {
  static Value pack(T value) {
    if constexpr (std::is_enum_v<T>)
      return Value(static_cast<std::int32_t>(value));
    else if constexpr (Number<T>)
      return Value(value);
    else {
      std::vector<T> one;
      one.push_back(std::move(value));
      return pack_items(std::move(one), ArrayForm::scalar);
    }
  }
  static T unpack(const Value& value) {
    if constexpr (std::is_enum_v<T>)
      return static_cast<T>(checked(value.to<std::int32_t>()));
    else if constexpr (Number<T>)
      return checked(value.to<T>());
    else {
      std::vector<std::uint32_t> dims;
      auto items = unpack_items<T>(value, dims);
      if (items.size() != 1) refuse_value(value, std::string(T::rr_type));
      return std::move(items.front());
    }
  }
};

template <>
struct Typed<Value> {
  static Value pack(Value value) { return value; }
  static Value unpack(const Value& value) { return value; }
};

template <>
struct Typed<std::string> {
  static Value pack(std::string value) { return value; }
  static std::string unpack(const Value& value) { return std::string(checked(value.to_text())); }
};

template <class T>
struct Typed<std::vector<T>> {
  static Value pack(std::vector<T> items) { return pack_items(std::move(items), ArrayForm::array); }
  static std::vector<T> unpack(const Value& value) {
    std::vector<std::uint32_t> dims;
    return unpack_items<T>(value, dims);
  }
};

template <class T, std::size_t size>
struct Typed<std::array<T, size>> {
  static Value pack(std::array<T, size> items) {
    return pack_items(std::vector<T>(std::move_iterator(items.begin()), std::move_iterator(items.end())),
                      ArrayForm::array);
  }
  static std::array<T, size> unpack(const Value& value) {
    std::vector<std::uint32_t> dims;
    auto items = unpack_items<T>(value, dims);
    if (items.size() != size) refuse_value(value, "an array of " + std::to_string(size));
    std::array<T, size> out{};
    std::move(items.begin(), items.end(), out.begin());
    return out;
  }
};

template <class T>
struct Typed<MultiDim<T>> {
  static Value pack(MultiDim<T> grid) {
    return pack_items(std::move(grid.data), ArrayForm::multidim, std::move(grid.dims));
  }
  static MultiDim<T> unpack(const Value& value) {
    MultiDim<T> grid;
    grid.dims.clear();
    grid.data = unpack_items<T>(value, grid.dims);
    if (grid.dims.empty()) refuse_value(value, "an array with dims");
    return grid;
  }
};

/// Structs.
template <class T>
struct Typed<Nullable<T>> {
  static Value pack(Nullable<T> value) { return value ? Value(rr_pack(std::move(*value))) : Value(); }
  static Nullable<T> unpack(const Value& value) {
    if (value.is_null()) return {};
    const auto* structure = value.get_if<Structure>();
    if (!structure) refuse_value(value, std::string(T::rr_type));
    T out;
    rr_unpack(*structure, out);
    return out;
  }
};

template <class T>
struct Typed<Nullable<std::vector<T>>> {
  static Value pack(Nullable<std::vector<T>> items) {
    if (!items) return {};
    List list;
    list.items.reserve(items->size());
    for (auto&& item : *items) list.items.push_back(Typed<T>::pack(std::move(item)));
    return list;
  }
  static Nullable<std::vector<T>> unpack(const Value& value) {
    if (value.is_null()) return {};
    const auto* list = value.get_if<List>();
    if (!list) refuse_value(value, "a list");
    std::vector<T> items;
    items.reserve(list->items.size());
    for (const Value& item : list->items) items.push_back(Typed<T>::unpack(item));
    return items;
  }
};

template <class Key, class T>
struct Typed<Nullable<std::map<Key, T>>> {
  using Map = std::conditional_t<std::is_same_v<Key, std::string>, MapString, MapInt32>;
  static Value pack(Nullable<std::map<Key, T>> items) {
    if (!items) return {};
    Map map;
    map.items.reserve(items->size());
    for (auto& [key, item] : *items) map.items.emplace_back(key, Typed<T>::pack(std::move(item)));
    return map;
  }
  static Nullable<std::map<Key, T>> unpack(const Value& value) {
    if (value.is_null()) return {};
    const auto* map = value.get_if<Map>();
    if (!map) refuse_value(value, "a map");
    std::map<Key, T> items;
    for (const auto& [key, item] : map->items) items.emplace(key, Typed<T>::unpack(item));
    return items;
  }
};

}  // namespace detail

/// Moves what it can: hand over temporaries, or std::move().
template <class T>
Value pack_value(T value) {
  return detail::Typed<T>::pack(std::move(value));
}

/// Throws   Exception, data_type_mismatch or out_of_range: the value is of another type.
template <class T>
T unpack_value(const Value& value) {
  if constexpr (!std::is_void_v<T>) return detail::Typed<T>::unpack(value);
}

/// The same without exceptions.
template <class T>
Result<T> try_unpack_value(const Value& value) {
  try {
    if constexpr (std::is_void_v<T>)
      return {};
    else
      return unpack_value<T>(value);
  } catch (const Exception& failure) {
    return failure.error();
  }
}

/// For rr_pack() of generated code: the fields of a struct or pod, in definition order.
class FieldPacker {
 public:
  FieldPacker(std::string_view type, std::size_t count) : structure_{std::string(type), {}} {
    structure_.fields.reserve(count);
  }
  template <class T>
  FieldPacker& add(const char* name, T value) {
    structure_.fields.push_back({name, pack_value(std::move(value))});
    return *this;
  }
  Structure take() { return std::move(structure_); }

 private:
  Structure structure_;
};

/// For rr_unpack() of generated code.
/// Throws   Exception: the field is missing or of another type; the text names it.
template <class T>
void unpack_field(const Structure& fields, std::string_view name, T& out) {
  const Value* value = fields.find(name);
  if (!value)
    throw Exception(make_error(ErrorCode::message_element_not_found,
                               fields.type_name + ": field '" + std::string(name) + "' is missing"));
  try {
    out = unpack_value<T>(*value);
  } catch (const Exception& failure) {
    auto error = failure.error();
    error.message = "field '" + std::string(name) + "': " + error.message;
    throw Exception(std::move(error));
  }
}

}  // namespace rr
