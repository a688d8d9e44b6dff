// Value: any value that Robot Raconteur can carry, owned. Layer: types. Source: messages spec section 9.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "core/wire/message.hpp"

namespace rr {

using CDouble = std::complex<double>;
using CSingle = std::complex<float>;

/// DataType of a C++ number type; void_t for anything else.
template <class T>
constexpr DataType data_type_of() {
  if constexpr (std::is_same_v<T, double>)
    return DataType::double_t;
  else if constexpr (std::is_same_v<T, float>)
    return DataType::single_t;
  else if constexpr (std::is_same_v<T, std::int8_t>)
    return DataType::int8_t;
  else if constexpr (std::is_same_v<T, std::uint8_t>)
    return DataType::uint8_t;
  else if constexpr (std::is_same_v<T, std::int16_t>)
    return DataType::int16_t;
  else if constexpr (std::is_same_v<T, std::uint16_t>)
    return DataType::uint16_t;
  else if constexpr (std::is_same_v<T, std::int32_t>)
    return DataType::int32_t;
  else if constexpr (std::is_same_v<T, std::uint32_t>)
    return DataType::uint32_t;
  else if constexpr (std::is_same_v<T, std::int64_t>)
    return DataType::int64_t;
  else if constexpr (std::is_same_v<T, std::uint64_t>)
    return DataType::uint64_t;
  else if constexpr (std::is_same_v<T, CDouble>)
    return DataType::cdouble_t;
  else if constexpr (std::is_same_v<T, CSingle>)
    return DataType::csingle_t;
  else if constexpr (std::is_same_v<T, bool>)
    return DataType::bool_t;
  else
    return DataType::void_t;
}

template <class T>
concept Number = data_type_of<T>()
!= DataType::void_t;

/// One number, complex number, bool or enum value (int32_t).
struct Scalar {
  DataType type = DataType::int32_t;
  alignas(8) std::array<std::uint8_t, 16> storage{};  ///< item_size(type) bytes, little-endian

  template <Number T>
  static Scalar of(T value) {
    Scalar scalar{data_type_of<T>()};
    std::memcpy(scalar.storage.data(), &value, sizeof(T));
    return scalar;
  }
  /// From the first item_size(type) bytes of `bytes`, which must be there. A bool becomes 0 or 1.
  static Scalar from_bytes(DataType type, ByteSpan bytes);
  ByteSpan bytes() const { return {storage.data(), item_size(type)}; }
  bool operator==(const Scalar& other) const;  ///< same type, same bytes
};

/// Numbers of one type in a shared, immutable payload: copies are cheap, and encoding references it in place.
/// The payload is aligned for the item type.
class Array {
 public:
  Array() = default;
  /// Copies `bytes`, whose size must be a multiple of item_size(type). Bools become 0 or 1.
  static Array copy(DataType type, ByteSpan bytes);
  /// Takes over the vector without copying (std::vector<bool>, which has no items to borrow, is copied).
  template <Number T>
  static Array take(std::vector<T> items) {
    if constexpr (std::is_same_v<T, bool>) {
      const Bytes bytes(items.begin(), items.end());
      return copy(DataType::bool_t, bytes);
    } else {
      return take_items(std::move(items));
    }
  }
  template <Number T>
  static Array copy(std::span<const T> items) {
    return copy(data_type_of<T>(), {reinterpret_cast<const std::uint8_t*>(items.data()), items.size_bytes()});
  }
  static Array empty(DataType type);

  DataType type() const { return type_; }
  std::size_t size() const { return type_ == DataType::void_t ? 0 : bytes_.size() / item_size(type_); }
  ByteSpan bytes() const { return bytes_; }
  /// Items as T; empty where the type differs.
  template <Number T>
  std::span<const T> items() const {
    if (data_type_of<T>() != type_) return {};
    return {reinterpret_cast<const T*>(bytes_.data()), bytes_.size() / sizeof(T)};
  }
  /// Items [first, first + count), which must be there; shares the payload.
  Array slice(std::size_t first, std::size_t count) const {
    Array part = *this;
    part.bytes_ = bytes_.subspan(first * item_size(type_), count * item_size(type_));
    return part;
  }
  const std::shared_ptr<const void>& owner() const { return owner_; }
  bool operator==(const Array& other) const;  ///< same type, same bytes

 private:
  template <Number T>
  static Array take_items(std::vector<T> items) {
    auto owner = std::make_shared<const std::vector<T>>(std::move(items));
    Array array;
    array.type_ = data_type_of<T>();
    array.bytes_ = {reinterpret_cast<const std::uint8_t*>(owner->data()), owner->size() * sizeof(T)};
    array.owner_ = std::move(owner);
    return array;
  }

  DataType type_ = DataType::void_t;
  ByteSpan bytes_;
  std::shared_ptr<const void> owner_;
};

/// dims = {rows, columns, ...}, column-major (first index fastest), length of `array` = product of dims.
struct MultiDimArray {
  std::vector<std::uint32_t> dims;
  Array array;
  bool operator==(const MultiDimArray&) const = default;
};

/// A name and a value. A template only because Value is not complete yet where Structure names it.
template <class V>
struct NamedValue {
  std::string name;
  V value;
  bool operator==(const NamedValue& other) const { return name == other.name && value == other.value; }
};
using Field = NamedValue<Value>;

/// A structure, or one pod: fields in definition order. A pod's multi-dim fields are MultiDimArray.
struct Structure {
  std::string type_name;  ///< qualified, "com.x.Pose"
  std::vector<Field> fields;

  const Value* find(std::string_view name) const;
  bool operator==(const Structure&) const;
};

/// Pods: a scalar, an array, or a multi-dim array (dims not empty, column-major).
struct PodArray {
  std::string type_name;
  std::vector<Structure> items;  ///< their type_name is empty as read, and may be when packed: the pods' is above
  std::vector<std::uint32_t> dims = {};
  bool is_scalar = false;  ///< declared as a scalar: one item
  bool is_multidim = false;
  bool operator==(const PodArray&) const;
};

/// Named arrays: `array` holds k numbers a value, flattened depth-first in field order.
struct NamedArray {
  std::string type_name;
  Array array;
  std::vector<std::uint32_t> dims = {};
  bool is_scalar = false;  ///< declared as a scalar: one value
  bool is_multidim = false;
  bool operator==(const NamedArray&) const = default;
};

struct List {
  std::vector<Value> items;
  bool operator==(const List&) const;
};

struct MapInt32 {
  std::vector<std::pair<std::int32_t, Value>> items;  ///< keys unique; read and written in ascending order
  bool operator==(const MapInt32&) const;
};

struct MapString {
  std::vector<std::pair<std::string, Value>> items;  ///< keys unique; read and written in order of unsigned bytes
  const Value* find(std::string_view key) const;
  bool operator==(const MapString&) const;
};

/// Any value. The default is null, which struct, list, map and varvalue may be.
class Value {
 public:
  using Storage = std::variant<std::monostate, Scalar, std::string, Array, MultiDimArray, Structure, PodArray,
                               NamedArray, List, MapInt32, MapString>;

  Value() = default;
  template <Number T>
  Value(T number) : storage_(Scalar::of(number)) {}
  Value(const char* text) : storage_(std::string(text)) {}
  Value(std::string_view text) : storage_(std::string(text)) {}
  template <Number T>
  Value(std::vector<T> items) : storage_(Array::take(std::move(items))) {}
  template <class T>
  requires std::is_same_v<T, Scalar> || std::is_same_v<T, std::string> || std::is_same_v<T, Array> ||
      std::is_same_v<T, MultiDimArray> || std::is_same_v<T, Structure> || std::is_same_v<T, PodArray> ||
      std::is_same_v<T, NamedArray> || std::is_same_v<T, List> || std::is_same_v<T, MapInt32> ||
      std::is_same_v<T, MapString>
      Value(T value) : storage_(std::move(value)) {}

  bool is_null() const { return std::holds_alternative<std::monostate>(storage_); }
  template <class T>
  const T* get_if() const {
    return std::get_if<T>(&storage_);
  }
  template <class T>
  T* get_if() {
    return std::get_if<T>(&storage_);
  }
  const Storage& storage() const { return storage_; }

  /// A number as T: from a scalar or an array of length 1, converted by the rules of convert_number().
  /// Errors   data_type_mismatch, out_of_range.
  template <Number T>
  Result<T> to() const;
  /// Errors   data_type_mismatch.
  Result<std::string_view> to_text() const;
  /// Items of an array, or of a scalar as an array of one, whose type is exactly T. Borrows from this value.
  template <Number T>
  Result<std::span<const T>> to_items() const;
  /// "double", "int32[]", "string", "com.x.Pose", "list", "map{string}", "null", ...: for messages.
  std::string type_text() const;

  bool operator==(const Value& other) const { return storage_ == other.storage_; }

 private:
  Storage storage_;
};

}  // namespace rr
