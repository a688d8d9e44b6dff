// The walk behind unpack(): one element into one value, recursively. Layer: types. Source: messages spec section 9.
#pragma once

#include <optional>
#include <string_view>

#include "core/types/field_path.hpp"
#include "core/types/pack.hpp"

namespace rr {

/// One use, one element. Functions return false after the first failure, which take_error() then holds. `path` is the
/// way to the value, for messages. Each level of recursion takes a level of the message, whose depth the decoder
/// bounds.
class Unpacker {
 public:
  Unpacker(const Message& message, const TypeRegistry& types) : message_(message), types_(types) {}

  bool unpack(const FieldPath& path, const MessageElement& element, const TypeDefinition& type, Value& out) {
    return unpack_value(path, element, type, Place::anywhere, out);
  }
  bool unpack_varvalue(const FieldPath& path, const MessageElement& element, Value& out);
  Error take_error() { return std::move(*error_); }

 private:
  enum class Place : std::uint8_t { anywhere, in_pod };

  // unpack.cpp
  bool unpack_value(const FieldPath& path, const MessageElement& element, const TypeDefinition& type, Place place,
                    Value& out);
  bool unpack_item(const FieldPath& path, const MessageElement& element, const TypeDefinition& type, Place place,
                   Value& out);
  bool unpack_scalar(const FieldPath& path, const MessageElement& element, const TypeDefinition& type, Value& out);
  bool unpack_array(const FieldPath& path, const MessageElement& element, DataType type, Array& out);
  bool unpack_multidim(const FieldPath& path, const MessageElement& element, const TypeDefinition& type, Place place,
                       Value& out);
  /// Reads the child `dims` and finds the child `array`, which is returned; nullptr on failure.
  const MessageElement* unpack_dims(const FieldPath& path, const MessageElement& element,
                                    std::vector<std::uint32_t>& dims);
  bool check_dims(const FieldPath& path, std::span<const std::uint32_t> dims, std::size_t count);
  template <class UnpackOne>
  bool unpack_list(const FieldPath& path, const MessageElement& element, Value& out, UnpackOne unpack_one);
  template <class Map, class UnpackOne>
  bool unpack_map(const FieldPath& path, const MessageElement& element, Value& out, UnpackOne unpack_one);
  bool read_key(const FieldPath& path, const MessageElement& element, std::int32_t& key);
  bool read_key(const FieldPath& path, const MessageElement& element, std::string& key);
  bool check_position(const FieldPath& path, const MessageElement& element, std::int32_t position);

  // unpack_named.cpp
  bool unpack_named(const FieldPath& path, const MessageElement& element, const TypeDefinition& type, Place place,
                    Value& out);
  bool unpack_named_varvalue(const FieldPath& path, const MessageElement& element, Value& out);
  bool unpack_structure(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                        std::string_view type_name, Value& out);
  bool unpack_fields(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                     std::string_view type_name, Place place, Structure& out);
  bool unpack_pods(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                   std::string_view type_name, PodArray& out);
  bool unpack_pod_items(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                        std::string_view type_name, PodArray& out);
  bool unpack_named_arrays(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                           std::string_view type_name, NamedArray& out);
  bool unpack_named_numbers(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                            std::string_view type_name, NamedArray& out);
  template <class Named>
  bool set_shape(const FieldPath& path, Named& value, std::size_t count, const TypeDefinition& type, Place place);
  bool check_element(const FieldPath& path, const MessageElement& element, DataType type, std::string_view type_name);

  /// Child elements by name, in unpack.cpp; fails where there is none.
  const MessageElement* find_child(const FieldPath& path, const MessageElement& element, std::string_view name);

  // failures, in unpack.cpp: all return false
  bool fail(ErrorCode code, const FieldPath& path, std::string_view text);
  bool fail_mismatch(const FieldPath& path, const MessageElement& found, std::string_view expected);

  const Message& message_;
  const TypeRegistry& types_;
  std::optional<Error> error_;
};

}  // namespace rr
