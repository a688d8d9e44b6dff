// Numbers and arrays of them from JSON and CBOR; the ground of what reads values. Layer: server/json.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "core/support/error.hpp"
#include "core/types/field_path.hpp"
#include "core/types/value.hpp"
#include "server/json/json.hpp"

namespace rr {

/// What reads returns false where it can't; then there is an error to take.
class NumbersFromJson {
 public:
  Error take_error() { return std::move(*error_); }

 protected:
  bool read_scalar(const FieldPath& path, const Json& json, DataType type, Scalar& out);
  /// One dimension of numbers: base64 for uint8, a list, {"b64", "count"}, or bytes.
  bool read_numbers(const FieldPath& path, const Json& json, DataType type, Array& out);
  /// Adds the bytes of a list's numbers.
  bool add_numbers(const FieldPath& path, const Json& list, DataType type, Bytes& out);
  /// {"b64", "count"}; `each`: bytes a counted item.
  bool read_packed(const FieldPath& path, const Json& json, DataType type, std::size_t each, std::size_t& count,
                   Array& out);

  bool fail(ErrorCode code, const FieldPath& path, std::string_view text);
  bool fail_kind(const FieldPath& path, const Json& found, const std::string& expected);

 private:
  bool read_wide(const FieldPath& path, const std::string& text, DataType type, Scalar& out);
  bool read_complex(const FieldPath& path, const Json& json, DataType type, Scalar& out);
  bool read_binary(const FieldPath& path, const Json::binary_t& bytes, DataType type, Array& out);

  std::optional<Error> error_;
};

}  // namespace rr
