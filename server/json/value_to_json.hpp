// Value -> JSON, in the shape of the declared type. Layer: server/json. Source: service definitions spec section 5.12.
#pragma once

#include "core/types/type_registry.hpp"
#include "core/types/value.hpp"
#include "server/json/json.hpp"

namespace rr {

/// What may differ from the default forms. Readers take all of them, whatever is asked for.
struct JsonForm {
  bool packs_arrays = false;  ///< numeric arrays as {"b64", "count"}, little-endian
  bool numbers_enums = false;
  /// For CBOR: arrays of real numbers as byte strings, uint8 plain, others with the typed-array tag of RFC 8746.
  bool has_bytes = false;
  bool ignores_unknown = false;  ///< when reading: fields that a structure doesn't declare

  bool operator==(const JsonForm&) const = default;
};

/// `value`  as unpack() gives it for `type`.
/// Errors   data_serialization_error: text that is not UTF-8; says where, from `name` on.
Result<OrderedJson> value_to_json(const Value& value, const TypeDefinition& type, const TypeRegistry& types,
                                  const JsonForm& form = {}, std::string_view name = "value");

/// {"error": {"name", "message", "subname"?, "param"?}}. Text that is not UTF-8 is mended with U+FFFD.
OrderedJson error_to_json(const Error& error, const TypeRegistry& types);

}  // namespace rr
