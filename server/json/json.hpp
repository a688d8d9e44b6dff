// JSON and CBOR as text and bytes. Layer: server/json. Source: RFC 8259, RFC 8949; service definitions spec
// section 5.12.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rr {

/// What is read: keys sorted, so that finding one in a large map stays cheap.
using Json = nlohmann::json;
/// What is written: fields in the order of their definition.
using OrderedJson = nlohmann::ordered_json;

/// Reads one document strictly: every key once, text that has a UTF-8 form, numbers that a double holds (an integer
/// beyond 64 bits becomes a double), "-0" with its sign, at most 64 levels.
/// Errors   data_serialization_error: what and at which byte.
Result<Json> read_json(std::string_view text);

/// Bytes of the heap that read_json() takes at most for this text, while arrays grow. About a nanosecond a byte.
std::size_t memory_of_json(std::string_view text);

/// As read_json(), for CBOR; byte strings become binary values whose subtype is their tag. Only what JSON can say, and
/// bytes. Errors   data_serialization_error.
Result<Json> read_cbor(ByteSpan bytes);

/// As memory_of_json(), for read_cbor().
std::size_t memory_of_cbor(ByteSpan bytes);

/// Compact text. What is no UTF-8 in the strings of `json` is written as U+FFFD.
std::string write_json(const OrderedJson& json);
Bytes write_cbor(const OrderedJson& json);

/// Adds a key that is not there yet: ordered_json would look through all that are.
inline OrderedJson& add_key(OrderedJson& object, std::string_view key) {
  auto& items = object.get_ref<OrderedJson::object_t&>();
  static_cast<OrderedJson::object_t::Container&>(items).emplace_back(std::string(key), OrderedJson());
  return items.back().second;
}

}  // namespace rr
