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

/// Adds `value` as one element under `key`. The message borrows payload and text of `value`, the key, and names of
/// `type` and `types`: they must outlive it (payloads that the encoder references in place are kept alive by the
/// message). On error the message must be cleared.
///
/// A number converts where the type holds it (convert_number(): int32 5 for a uint8 or double property); arrays must
/// have the declared item type unless they are empty; nothing else converts. Structures give their fields in any order,
/// all of them and no others; their type_name, as that of pods and named arrays, may be empty. A scalar pod may be
/// given as a Structure. Errors   null_value, data_type_mismatch, data_type_error, out_of_range; the text names the
/// field path, e.g.
///          "pack 'pose.q' (com.x.Pose): has 3, expected 4 (double[4])".
/// Source   messages spec, section 9.
Result<> pack(Message& message, ElementKey key, const Value& value, const TypeDefinition& type,
              const TypeRegistry& types);

/// Adds a varvalue: the value decides its own type, so that type names must be there. Scalars travel as arrays of one
/// number, items of containers are varvalues. Errors and lifetimes as for pack().
Result<> pack_varvalue(Message& message, ElementKey key, const Value& value, const TypeRegistry& types);

/// Reads one element, which lies in `message`, as `type`. The value owns all that it holds. Unknown extra struct fields
/// are ignored, missing ones are an error; text is not checked for UTF-8; bools become 0 or 1; a void type reads
/// anything as null.
/// Errors   null_value, data_type_mismatch, data_type_error, out_of_range, message_element_not_found (text as above).
Result<Value> unpack(const Message& message, const MessageElement& element, const TypeDefinition& type,
                     const TypeRegistry& types);

/// Reads a varvalue: the element decides. A single number arrives as an Array of size 1, an enum as an int32 Array, one
/// pod or named array as an array of one (is_scalar false): the wire does not tell them apart.
Result<Value> unpack_varvalue(const Message& message, const MessageElement& element, const TypeRegistry& types);

/// The default of spec 5.4: zeros, empty, null; enums 0; named types from `types`. Null also where the declared sizes
/// ask for more than 12 MiB, which a definition from a peer may.
Value default_value(const TypeDefinition& type, const TypeRegistry& types);

}  // namespace rr
