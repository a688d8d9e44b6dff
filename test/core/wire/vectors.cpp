#include "test/core/wire/vectors.hpp"

#include <stdexcept>

namespace rr::test {

namespace {

StringTableMode parse_mode(const nlohmann::json& mode) {
  if (mode.is_null()) return {};
  const auto text = mode.get<std::string>();
  return {.local = text.find("local") != std::string::npos, .standard = text.find("standard") != std::string::npos};
}

ErrorCode parse_error_class(const nlohmann::json& error_class) {
  if (error_class.is_null()) return ErrorCode::none;
  for (const auto code : {ErrorCode::protocol_error, ErrorCode::connection_error, ErrorCode::data_type_error,
                          ErrorCode::data_serialization_error})
    if (error_class == error_code_name(code)) return code;
  throw std::runtime_error("unknown error class " + error_class.dump());
}

void append(Bytes& to, const Bytes& bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

/// PropertyGetRes svc/d1 with an element `x` of type list that holds an element `x` ... `depth` elements in all, the
/// innermost void.
Bytes nested_lists(std::uint32_t depth, std::uint16_t version) {
  Message message;
  message.header.version = version;
  message.header.sender_node_id = parse_node_id("00112233445566778899aabbccddeeff").value();
  message.header.receiver_node_id = parse_node_id("0102030405060708090a0b0c0d0e0f10").value();
  message.header.sender_endpoint = 1;
  message.header.receiver_endpoint = 2000;
  message.header.message_id = 7;
  message.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
  for (std::uint32_t level = 1; level < depth; ++level) message.begin_nested("x", DataType::list_t);
  message.add("x", DataType::void_t, 0, {});
  EncodedMessage encoded;
  encode(message, {}, encoded).value();
  return encoded.to_bytes();
}

Bytes build_bytes(const nlohmann::json& vector) {
  if (vector.contains("hex")) return from_hex(vector["hex"].get<std::string>());
  Bytes bytes;
  for (const auto& part : vector["recipe"]) {
    if (part.contains("nested_lists")) {
      append(bytes, nested_lists(part["nested_lists"], vector["version"]));
    } else if (part.contains("repeat")) {
      const auto repeated = from_hex(part["repeat"].get<std::string>());
      for (auto left = part["count"].get<std::size_t>(); left > 0; --left) append(bytes, repeated);
    } else {
      append(bytes, from_hex(part["hex"].get<std::string>()));
    }
  }
  return bytes;
}

}  // namespace

const std::vector<MessageVector>& message_vectors() {
  static const auto vectors = [] {
    std::vector<MessageVector> list;
    for (auto& vector : read_golden_json("messages/messages.json"))
      list.push_back({vector["name"], parse_mode(vector["string_table"]), vector["message"],
                      from_hex(vector["hex"].get<std::string>())});
    return list;
  }();
  return vectors;
}

const MessageVector& message_vector(const std::string& name) {
  for (const auto& vector : message_vectors())
    if (vector.name == name) return vector;
  throw std::runtime_error("no vector " + name);
}

const std::vector<MalformedVector>& malformed_vectors() {
  static const auto vectors = [] {
    std::vector<MalformedVector> list;
    for (auto& vector : read_golden_json("messages/malformed.json")) {
      list.push_back({vector["name"], parse_mode(vector["string_table"]), vector["verdict_ours"] == "accept",
                      parse_error_class(vector["error_class"]), build_bytes(vector)});
      if (list.back().bytes.size() != vector["size"]) throw std::runtime_error("size of " + list.back().name);
    }
    return list;
  }();
  return vectors;
}

}  // namespace rr::test
