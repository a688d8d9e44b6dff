// The walk behind pack(): one value into one element, recursively. Layer: types. Source: messages spec section 9.
#pragma once

#include <optional>
#include <string_view>

#include "core/types/field_path.hpp"
#include "core/types/pack.hpp"

namespace rr {

/// One use, one value. Functions return false after the first failure, which take_error() then holds: an Error is large
/// and most values have none. `path` is the way to the value; its last step is the element's key.
class Packer {
 public:
  Packer(Message& message, const TypeRegistry& types) : message_(message), types_(types) {}

  bool pack(const FieldPath& path, const Value& value, const TypeDefinition& type) {
    return pack_value(path, value, type, Place::anywhere);
  }
  bool pack_varvalue(const FieldPath& path, const Value& value);
  Error take_error() { return std::move(*error_); }

 private:
  /// In a pod a multi-dim array travels as a plain array (rule 2).
  enum class Place : std::uint8_t { anywhere, in_pod };

  // pack.cpp
  bool pack_value(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place);
  bool pack_item(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place);
  bool pack_scalar(const FieldPath& path, const Value& value, DataType type);
  bool pack_text(const FieldPath& path, std::string_view text);
  bool pack_array(const FieldPath& path, const Array& array);
  bool pack_typed_array(const FieldPath& path, const Value& value, const TypeDefinition& type);
  bool pack_multidim(const FieldPath& path, const MultiDimArray& value, DataType type);
  bool pack_typed_multidim(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place);
  bool pack_dims(const FieldPath& path, const std::vector<std::uint32_t>& dims, std::size_t count);
  template <class PackOne>
  bool pack_list(const FieldPath& path, const Value& value, PackOne pack_one);
  template <class Map, class PackOne>
  bool pack_map(const FieldPath& path, const Value& value, DataType type, PackOne pack_one);

  // pack_named.cpp
  bool pack_named(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place);
  bool pack_named_varvalue(const FieldPath& path, const Value& value, std::string_view type_name);
  bool pack_structure(const FieldPath& path, const Structure& value, const EntityDefinition& entity,
                      std::string_view type_name);
  bool pack_fields(const FieldPath& path, const Structure& value, const EntityDefinition& entity,
                   std::string_view type_name, Place place);
  bool pack_pods(const FieldPath& path, const PodArray& value, const EntityDefinition& entity,
                 std::string_view type_name, bool as_multidim);
  bool pack_pod_items(const FieldPath& path, const FieldPath& key, std::span<const Structure> items,
                      const EntityDefinition& entity, std::string_view type_name);
  bool pack_named_arrays(const FieldPath& path, const NamedArray& value, const EntityDefinition& entity,
                         std::string_view type_name, bool as_multidim);
  /// How many values `value` holds, or none where its numbers are not those of the named array.
  std::optional<std::size_t> count_named_arrays(const FieldPath& path, const NamedArray& value,
                                                const EntityDefinition& entity);
  template <class Named>
  bool check_shape(const FieldPath& path, const Named& value, std::size_t count, const TypeDefinition& type);
  bool check_type_name(const FieldPath& path, std::string_view found, std::string_view expected);

  // elements, in pack.cpp
  bool add_leaf(const FieldPath& key, DataType type, std::size_t count, ByteSpan data);
  ByteSpan borrow(ByteSpan bytes);  ///< of the value being packed; not of an Array
  bool add_payload(const FieldPath& key, DataType type, const Array& array);
  bool begin_nested(const FieldPath& key, DataType type, std::string_view type_name = {});
  bool end_nested();  ///< true, always
  bool has_room(const FieldPath& key);

  // failures, in pack.cpp: all return false
  bool fail(ErrorCode code, const FieldPath& path, std::string_view text);
  bool fail_mismatch(const FieldPath& path, const Value& found, std::string_view expected);

  Message& message_;
  const TypeRegistry& types_;
  std::optional<Error> error_;
};

}  // namespace rr
