// Value <-> message elements, checked against a definition. Layer: types. Source: messages spec section 9.
#pragma once

#include <string_view>

#include "core/types/type_registry.hpp"
#include "core/types/value.hpp"

namespace rr {

/// An element's key for packing: a name, or a number.
struct ElementKey {
  ElementKey(std::string_view text) : name(text) {}
  ElementKey(const char* text) : name(text) {}
  ElementKey(std::int32_t index) : number(index), is_number(true) {}
  std::string_view name = {};
  std::int32_t number = 0;
  bool is_number = false;
};

/// Adds `value` as one element under `key`. The message borrows payload and text of `value` and names of `types`: both
/// must outlive it (large arrays are kept alive by the message). On error the message must be cleared.
/// Numbers convert where they fit exactly (an int32 value for an int16 property); nothing else converts.
/// Errors   null_value, data_type_mismatch, data_type_error, out_of_range; the text names the field path, e.g.
///          "pack 'pose.q' (com.x.Pose): has 3 doubles, expected 4".
Result<> pack(Message& message, ElementKey key, const Value& value, const TypeDefinition& type,
              const TypeRegistry& types);

/// Adds a varvalue: the value decides its own type.
Result<> pack_varvalue(Message& message, ElementKey key, const Value& value, const TypeRegistry& types);

/// Reads one element as `type`. Unknown extra struct fields are ignored, missing ones are an error.
/// Errors   null_value, data_type_mismatch, data_type_error, out_of_range, message_element_not_found (text as above).
Result<Value> unpack(const Message& message, const MessageElement& element, const TypeDefinition& type,
                     const TypeRegistry& types);

Result<Value> unpack_varvalue(const Message& message, const MessageElement& element, const TypeRegistry& types);

/// The default of spec 5.4: zeros, empty, null; named types from `types`.
Value default_value(const TypeDefinition& type, const TypeRegistry& types);

}  // namespace rr
