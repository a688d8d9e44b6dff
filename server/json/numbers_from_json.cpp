#include "server/json/numbers_from_json.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/support/whole_number.hpp"
#include "core/types/number.hpp"
#include "node/tls/base64.hpp"
#include "server/json/typed_array_tags.hpp"

namespace rr {

namespace {

constexpr double largest_safe_integer = 9007199254740991.0;

std::string kind_of(const Json& json) {
  switch (json.type()) {
    case Json::value_t::null:
      return "null";
    case Json::value_t::boolean:
      return "a boolean";
    case Json::value_t::string:
      return "a string";
    case Json::value_t::array:
      return "an array";
    case Json::value_t::object:
      return "an object";
    case Json::value_t::binary:
      return "bytes";
    default:
      return "a number";
  }
}

}  // namespace

bool NumbersFromJson::read_scalar(const FieldPath& path, const Json& json, DataType type, Scalar& out) {
  const std::string expected(data_type_name(type));
  Scalar found;
  switch (type) {
    case DataType::bool_t:
      if (!json.is_boolean()) return fail_kind(path, json, "true or false");
      out = Scalar::of(json.get<bool>());
      return true;
    case DataType::cdouble_t:
    case DataType::csingle_t:
      return read_complex(path, json, type, out);
    case DataType::int64_t:
    case DataType::uint64_t:
      if (json.is_string()) return read_wide(path, json.get_ref<const std::string&>(), type, out);
      if (json.is_number() && std::abs(json.get<double>()) > largest_safe_integer)
        return fail(ErrorCode::out_of_range, path,
                    "is a number beyond 2^53 - 1; write " + expected + " as a string of digits");
      break;
    case DataType::double_t:
    case DataType::single_t:
      if (json.is_string()) {
        const auto& word = json.get_ref<const std::string&>();
        const double value = word == "NaN"         ? std::numeric_limits<double>::quiet_NaN()
                             : word == "Infinity"  ? std::numeric_limits<double>::infinity()
                             : word == "-Infinity" ? -std::numeric_limits<double>::infinity()
                                                   : 0;
        if (value == 0) return fail_kind(path, json, "a number, \"NaN\", \"Infinity\" or \"-Infinity\"");
        out = type == DataType::double_t ? Scalar::of(value) : Scalar::of(static_cast<float>(value));
        return true;
      }
      break;
    default:
      break;
  }
  if (json.is_number_unsigned())
    found = Scalar::of(json.get<std::uint64_t>());
  else if (json.is_number_integer())
    found = Scalar::of(json.get<std::int64_t>());
  else if (json.is_number_float())
    found = Scalar::of(json.get<double>());
  else
    return fail_kind(path, json, expected);
  // As a reader of JSON's own numbers would: the nearest double, also of integers beyond its digits.
  if (type == DataType::double_t || type == DataType::single_t) found = Scalar::of(json.get<double>());
  switch (convert_number(found, type, out)) {
    case Conversion::ok:
      return true;
    case Conversion::wrong_kind:
      return fail(ErrorCode::data_type_mismatch, path, number_text(found) + " is no " + expected);
    case Conversion::out_of_range:
      break;
  }
  return fail(ErrorCode::out_of_range, path, number_text(found) + " does not fit " + expected);
}

bool NumbersFromJson::read_wide(const FieldPath& path, const std::string& text, DataType type, Scalar& out) {
  if (const auto number = canonical_number<std::int64_t>(text); number && type == DataType::int64_t) {
    out = Scalar::of(*number);
    return true;
  }
  if (const auto number = canonical_number<std::uint64_t>(text); number && type == DataType::uint64_t) {
    out = Scalar::of(*number);
    return true;
  }
  return fail(
      ErrorCode::out_of_range, path,
      "found " + rr::quote(text) + ", expected " + std::string(data_type_name(type)) + " in plain decimal digits");
}

bool NumbersFromJson::read_complex(const FieldPath& path, const Json& json, DataType type, Scalar& out) {
  if (!json.is_array() || json.size() != 2) return fail_kind(path, json, "[real, imaginary]");
  const auto part_type = type == DataType::cdouble_t ? DataType::double_t : DataType::single_t;
  out.type = type;
  for (std::int32_t i = 0; i < 2; ++i) {
    Scalar part;
    if (!read_scalar(path.index(i), json[static_cast<std::size_t>(i)], part_type, part)) return false;
    std::memcpy(out.storage.data() + i * item_size(part_type), part.storage.data(), item_size(part_type));
  }
  return true;
}

bool NumbersFromJson::read_numbers(const FieldPath& path, const Json& json, DataType type, Array& out) {
  if (json.is_binary()) return read_binary(path, json.get_binary(), type, out);
  if (json.is_string() && type == DataType::uint8_t) {
    const auto bytes = decode_base64(json.get_ref<const std::string&>());
    if (!bytes) return fail(ErrorCode::data_type_error, path, "is no base64 (RFC 4648, with padding, no blanks)");
    out = Array::copy(type, *bytes);
    return true;
  }
  if (json.is_object()) {
    std::size_t count = 0;
    return read_packed(path, json, type, item_size(type), count, out);
  }
  if (!json.is_array()) return fail_kind(path, json, std::string(data_type_name(type)) + "[]");
  Bytes bytes;
  bytes.reserve(json.size() * item_size(type));
  if (!add_numbers(path, json, type, bytes)) return false;
  out = Array::copy(type, bytes);
  return true;
}

bool NumbersFromJson::add_numbers(const FieldPath& path, const Json& list, DataType type, Bytes& out) {
  std::int32_t index = 0;
  for (const auto& item : list) {
    Scalar number;
    if (!read_scalar(path.index(index++), item, type, number)) return false;
    out.insert(out.end(), number.bytes().begin(), number.bytes().end());
  }
  return true;
}

bool NumbersFromJson::read_binary(const FieldPath& path, const Json::binary_t& bytes, DataType type, Array& out) {
  const auto tag = typed_array_tag(type);
  const bool is_right = tag && (bytes.has_subtype() ? bytes.subtype() == *tag : type == DataType::uint8_t);
  if (!is_right)
    return fail(ErrorCode::data_type_mismatch, path,
                "found bytes, expected " + std::string(data_type_name(type)) + "[]" +
                    (tag ? " as a typed array of tag " + std::to_string(*tag) : ""));
  if (bytes.size() % item_size(type) != 0)
    return fail(ErrorCode::data_type_error, path, "has bytes for a fraction of a number");
  out = Array::copy(type, bytes);
  return true;
}

bool NumbersFromJson::read_packed(const FieldPath& path, const Json& json, DataType type, std::size_t each,
                                  std::size_t& count, Array& out) {
  const auto bad = [&](std::string_view why) { return fail(ErrorCode::data_type_error, path, why); };
  if (json.size() != 2 || !json.contains("b64") || !json.contains("count") || !json["b64"].is_string() ||
      !json["count"].is_number_unsigned())
    return bad("expected an array, or {\"b64\": text, \"count\": number}");
  const auto bytes = decode_base64(json["b64"].get_ref<const std::string&>());
  if (!bytes) return bad("b64 is no base64 (RFC 4648, with padding, no blanks)");
  count = json["count"].get<std::size_t>();
  if (bytes->size() % each != 0 || bytes->size() / each != count)
    return bad("has " + std::to_string(bytes->size()) + " bytes, expected " + std::to_string(each) + " for each of " +
               std::to_string(count));
  if (type == DataType::bool_t && std::any_of(bytes->begin(), bytes->end(), [](auto byte) { return byte > 1; }))
    return bad("has a bool that is neither 0 nor 1");
  out = Array::copy(type, *bytes);
  return true;
}

bool NumbersFromJson::fail(ErrorCode code, const FieldPath& path, std::string_view text) {
  error_ = value_error(code, "read", path, text);
  return false;
}

bool NumbersFromJson::fail_kind(const FieldPath& path, const Json& found, const std::string& expected) {
  return fail(found.is_null() ? ErrorCode::null_value : ErrorCode::data_type_mismatch, path,
              "found " + kind_of(found) + ", expected " + expected);
}

}  // namespace rr
