// Rules of encoding and decoding that single messages show best; the recorded ones are in codec_vectors_test.cpp.

#include "core/wire/codec.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <string>

#include "test/core/wire/message_tree.hpp"
#include "test/core/wire/vectors.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// An unrouted message with one entry, into which the test adds elements.
Message make_message(std::uint16_t version = 4) {
  Message message;
  message.header.version = version;
  message.header.has_routing = message.header.has_endpoints = version != 4;
  message.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
  return message;
}

std::string encode_error(const Message& message, const EncodeOptions& options = {}) {
  EncodedMessage encoded;
  const auto done = encode(message, options, encoded);
  CHECK((done || encoded.size() == 0));
  return done ? std::string("encoded") : std::string(error_code_name(done.error().code)) + ": " + done.error().message;
}

bool is_inside(ByteSpan view, ByteSpan whole) {
  return view.data() >= whole.data() && view.data() + view.size() <= whole.data() + whole.size();
}

}  // namespace

TEST_CASE("over-long sizes, as robotraconteurlite writes them, are accepted") {
  const auto bytes = from_hex(
      "52524143 38000000 0400 0c 00"
      "fe2c000000 15 5804 03 737663 02 6431 05 fe01000000"
      "fe17000000 01 05 76616c7565 0100 01 0000000000000c40");
  Message message;
  REQUIRE(decode(bytes, {}, message));
  REQUIRE(message.elements.size() == 1);
  CHECK(message.elements[0].name == "value");
  CHECK(load<double>(message.elements[0].data.data()) == 3.5);
  CHECK_FALSE(message.header.has_routing);
  CHECK_FALSE(message.header.has_endpoints);

  EncodedMessage encoded;
  REQUIRE(encode(message, {}, encoded));
  CHECK(to_hex(encoded.to_bytes()) == to_hex(from_hex("52524143 2c000000 0400 0c 00 20 15 5804 03 737663 02 6431 05 01"
                                                      "13 01 05 76616c7565 0100 01 0000000000000c40")));
}

TEST_CASE("decoded data and texts are views into the received bytes") {
  const auto& vector = message_vector("array_double_1000_v4");
  Message message;
  REQUIRE(decode(vector.bytes, {}, message));
  const auto& element = message.elements.at(0);
  CHECK(element.data.size() == 8000);
  CHECK(is_inside(element.data, vector.bytes));
  CHECK(is_inside(as_bytes(element.name), vector.bytes));
  CHECK(is_inside(as_bytes(message.entries.at(0).service_path), vector.bytes));
}

TEST_CASE("a message without entries decodes in both versions") {
  Message message;
  for (const auto* name : {"zero_entries_v2", "zero_entries_v4"}) {
    REQUIRE(decode(message_vector(name).bytes, {}, message));
    CHECK(message.entries.empty());
    CHECK(message.elements.empty());
    CHECK(message.header.message_id == 7);
  }
}

TEST_CASE("a version 4 message that would be shorter than 16 bytes is not encoded") {
  Message message;
  message.header.has_routing = message.header.has_endpoints = false;
  CHECK(encode_error(message) ==
        "ProtocolError: encode: a message without entries and routing is too short to be sent");
  message.header.message_id = 1;
  CHECK(encode_error(message) == "encoded");
}

TEST_CASE("decode wants exactly one message") {
  auto bytes = message_vector("property_get_request_v4").bytes;
  Message message;
  bytes.push_back(0);
  const auto longer = decode(bytes, {}, message);
  REQUIRE_FALSE(longer);
  CHECK(longer.error().code == ErrorCode::protocol_error);
  CHECK(longer.error().message == "MessageSize at byte 4: 68 bytes, but the input has 69");
  bytes.resize(60);
  const auto shorter = decode(bytes, {}, message);
  REQUIRE_FALSE(shorter);
  CHECK(shorter.error().code == ErrorCode::connection_error);
  CHECK(shorter.error().message == "MessageSize at byte 4: 68 bytes, but the input ends after 60");
}

TEST_CASE("errors name the field, the offset, what was found and what was expected") {
  const auto decode_error = [](const std::string& name) {
    for (const auto& vector : malformed_vectors()) {
      if (vector.name != name) continue;
      Message message;
      const auto decoded = decode(vector.bytes, {.string_table = vector.string_table}, message);
      return decoded ? std::string("decoded") : decoded.error().message;
    }
    return std::string("no such case");
  };
  CHECK(decode_error("count_max_double_v4") ==
        "DataCount at byte 78: 4294967295 items of double in element 'value', but 8 data bytes");
  CHECK(decode_error("nested_count_ffffffff_list_v4") ==
        "DataCount at byte 78: 4294967295 cannot fit into the 15 bytes left");
  CHECK(decode_error("element_count_65535_v2") == "element count at byte 89: 65535 cannot fit into the 29 bytes left");
  CHECK(decode_error("header_size_63_v2") == "HeaderSize at byte 10: 63 is outside 64..120 (MessageSize)");
  CHECK(decode_error("header_size_56_v4") == "HeaderSize at byte 10: 56, but the header fields end at byte 55");
  CHECK(decode_error("name_length_v2") ==
        "ElementName at byte 97: 65535 bytes needed, 23 left before the end of its structure");
  CHECK(decode_error("void_with_data_v4") ==
        "DataCount at byte 78: void element 'value' has count 4 and 4 data bytes, expected none");
  CHECK(decode_error("table_even_312_v4") == "ElementName at byte 27: string code 312 is in no table");
  CHECK(decode_error("table_not_negotiated_even_v4") ==
        "ElementName at byte 27: string code 516, but no string table was agreed on");
  CHECK(decode_error("nesting_129_v4").find("nested deeper than 128 elements") != std::string::npos);
  CHECK(decode_error("trailing_4_v4").find("4 bytes left behind the last of 1 entries") != std::string::npos);
}

TEST_CASE("a size that ends inside its own field is refused") {
  const auto decode_error = [](const char* hex) {
    Message message;
    const auto decoded = decode(from_hex(hex), {}, message);
    return decoded ? std::string("decoded") : decoded.error().message;
  };
  CHECK(decode_error("52524143 14000000 0400 fe0c000000 00 05000000") ==
        "HeaderSize at byte 10: 12 ends inside itself");
  CHECK(decode_error("52524143 15000000 0400 0c 00 fe04000000 00000000") ==
        "EntrySize at byte 12: 4 is less than its own field");
  CHECK(decode_error("52524143 16000000 0400 0c 00 0a 00 5804 01 fe04000000") ==
        "ElementSize at byte 17: 4 is less than its own field");
}

TEST_CASE("the nesting bound is configurable") {
  const auto& vector = message_vector("nesting_64_v4");
  Message message;
  CHECK(decode(vector.bytes, {.max_depth = 64}, message));
  CHECK_FALSE(decode(vector.bytes, {.max_depth = 63}, message));
  CHECK(message.elements.empty());
}

TEST_CASE("encoding has no nesting bound and does not recurse") {
  Message message = make_message(2);
  for (int depth = 0; depth < 50'000; ++depth) message.begin_nested("", DataType::list_t);
  EncodedMessage encoded;
  REQUIRE(encode(message, {}, encoded));
  Message again;
  REQUIRE(decode(encoded.to_bytes(), {.max_depth = 100'000}, again));
  CHECK(again.elements.size() == 50'000);
}

TEST_CASE("an element without key keeps having none") {
  Message message = make_message();
  message.add("", DataType::void_t, 0, {}).key_kind = KeyKind::none;
  message.add("", DataType::void_t, 0, {});
  EncodedMessage encoded;
  REQUIRE(encode(message, {}, encoded));
  const auto bytes = encoded.to_bytes();
  Message again;
  REQUIRE(decode(bytes, {}, again));
  CHECK(again.elements.at(0).key_kind == KeyKind::none);
  CHECK(again.elements.at(1).key_kind == KeyKind::name);
}

TEST_CASE("version 2 writes numbered elements as decimal names") {
  Message message = make_message(2);
  for (const std::int32_t number : {0, 17, -3, 2147483647, std::numeric_limits<std::int32_t>::min()})
    message.add_numbered(number, DataType::void_t, 0, {});
  EncodedMessage encoded;
  REQUIRE(encode(message, {}, encoded));
  const auto bytes = encoded.to_bytes();
  Message again;
  REQUIRE(decode(bytes, {}, again));
  std::string names;
  for (const auto& element : again.elements) {
    CHECK(element.key_kind == KeyKind::name);
    names += std::string(element.name) + " ";
  }
  CHECK(names == "0 17 -3 2147483647 -2147483648 ");
}

// --- large payloads ---

TEST_CASE("payloads from the threshold on are referenced, smaller ones copied") {
  const Bytes large(EncodedMessage::gather_threshold, 1);
  const Bytes small(EncodedMessage::gather_threshold - 1, 2);
  for (const std::uint16_t version : {std::uint16_t{2}, std::uint16_t{4}}) {
    Message message = make_message(version);
    message.add("a", DataType::uint8_t, static_cast<std::uint32_t>(large.size()), large);
    message.add("b", DataType::uint8_t, static_cast<std::uint32_t>(small.size()), small);
    message.add("c", DataType::uint8_t, static_cast<std::uint32_t>(large.size()), large);
    EncodedMessage encoded;
    REQUIRE(encode(message, {}, encoded));
    REQUIRE(encoded.slices().size() == 4);
    CHECK(encoded.slices()[1].data() == large.data());
    CHECK(encoded.slices()[3].data() == large.data());
    CHECK_FALSE(is_inside(encoded.slices()[2], small));
    std::size_t size = 0;
    for (const auto slice : encoded.slices()) size += slice.size();
    CHECK(size == encoded.size());

    const EncodedMessage moved = std::move(encoded);
    const auto bytes = moved.to_bytes();
    CHECK(bytes.size() == size);
    Message again;
    REQUIRE(decode(bytes, {}, again));
    CHECK(compare_messages(again, message) == "");
  }
}

TEST_CASE("a referenced payload lives as long as the encoded message") {
  EncodedMessage encoded;
  std::weak_ptr<const Bytes> watched;
  {
    Message message = make_message();
    const auto payload = std::make_shared<const Bytes>(10'000, std::uint8_t{7});
    watched = payload;
    message.keep_alive(payload);
    message.add("shared", DataType::uint8_t, 10'000, *payload);
    message.add("stored", DataType::uint8_t, 10'000, message.store(ByteSpan(Bytes(10'000, 8))));
    REQUIRE(encode(message, {}, encoded));
    message.clear();
  }
  CHECK_FALSE(watched.expired());
  const auto bytes = encoded.to_bytes();
  Message again;
  REQUIRE(decode(bytes, {}, again));
  CHECK(again.elements.at(0).data[9'999] == 7);
  CHECK(again.elements.at(1).data[9'999] == 8);
  encoded.clear();
  CHECK(watched.expired());
}

TEST_CASE("an encoded message of small fields is one slice and owns all") {
  Message message = make_message();
  message.keep_alive(std::make_shared<int>(1));
  const auto owner = message.owners().at(0);
  message.add_text("value", "small");
  EncodedMessage encoded;
  REQUIRE(encode(message, {}, encoded));
  CHECK(encoded.slices().size() == 1);
  CHECK(owner.use_count() == 2);
}

// --- what is refused ---

TEST_CASE("version 2 refuses what only version 4 can carry") {
  const Bytes extended{1};
  Message message = make_message(2);
  message.header.priority = std::uint16_t{0};
  CHECK(encode_error(message) == "ProtocolError: encode: header: version 2 has no priority");
  message = make_message(2);
  message.header.is_unreliable = true;
  CHECK(encode_error(message) == "ProtocolError: encode: header: version 2 has no unreliable flag");
  message = make_message(2);
  message.header.extended = extended;
  CHECK(encode_error(message) == "ProtocolError: encode: header: version 2 has no extended data");
  message = make_message(2);
  message.entries[0].extended = extended;
  CHECK(encode_error(message) == "ProtocolError: encode: entry 0: version 2 has no extended data");
  message = make_message(2);
  message.add("x", DataType::void_t, 0, {}).extended = extended;
  CHECK(encode_error(message) == "ProtocolError: encode: element 'x' (index 0): version 2 has no extended data");
  // Routing that a version 4 message would leave out is simply written, and a string table not used.
  message = make_message(2);
  message.header.has_routing = message.header.has_endpoints = false;
  CHECK(encode_error(message, {.string_table = {.local = true, .standard = true}}) == "encoded");
}

TEST_CASE("texts of version 2 end at 65535 bytes") {
  const std::string longest(65535, 'x');
  const std::string too_long(65536, 'x');
  const auto with = [](std::uint16_t version, const std::string& text, int where) {
    Message message = make_message(version);
    message.add("x", DataType::void_t, 0, {});
    std::string_view* const fields[] = {&message.entries[0].service_path, &message.entries[0].member_name,
                                        &message.entries[0].metadata,     &message.elements[0].name,
                                        &message.elements[0].type_name,   &message.elements[0].metadata};
    *fields[where] = text;
    return encode_error(message);
  };
  for (int where = 0; where < 6; ++where) {
    CHECK(with(2, longest, where) == "encoded");
    CHECK(with(2, too_long, where).find("longer than 65535 bytes") != std::string::npos);
    CHECK(with(4, too_long, where) == "encoded");
  }
  Message message = make_message(2);
  message.header.metadata = std::string_view(longest).substr(0, 65535 - 64);
  CHECK(encode_error(message) == "encoded");
  message.header.sender_node_name = "x";
  CHECK(encode_error(message) == "ProtocolError: encode: header: header longer than 65535 bytes");
}

TEST_CASE("counts end at 65535 where the format has no more bits") {
  for (const std::uint16_t version : {std::uint16_t{2}, std::uint16_t{4}}) {
    Message message = make_message(version);
    while (message.entries.size() < 65535) message.begin_entry(EntryType::null, "", "");
    CHECK(encode_error(message) == "encoded");
    message.begin_entry(EntryType::null, "", "");
    CHECK(encode_error(message).find("more than 65535 entries") != std::string::npos);

    message = make_message(version);
    for (int i = 0; i < 65535; ++i) message.add("", DataType::void_t, 0, {});
    CHECK(encode_error(message) == "encoded");
    message.add("", DataType::void_t, 0, {});
    CHECK(encode_error(message) ==
          (version == 2 ? "ProtocolError: encode: entry 0: more than 65535 elements" : "encoded"));
  }
}

TEST_CASE("65536 entries that are really there are refused by their count") {
  Message message = make_message();
  while (message.entries.size() < 65535) message.begin_entry(EntryType::null, "", "");
  EncodedMessage encoded;
  REQUIRE(encode(message, {}, encoded));
  auto bytes = encoded.to_bytes();
  REQUIRE(decode(bytes, {}, message));
  CHECK(message.entries.size() == 65535);

  const auto entry_size = (bytes.size() - bytes[10]) / 65535;
  const Bytes entry(bytes.end() - static_cast<std::ptrdiff_t>(entry_size), bytes.end());
  const auto count = from_hex("fdffff");  // 65535 as EntryCount, the last field of the header
  const auto at = std::search(bytes.begin(), bytes.end(), count.begin(), count.end());
  REQUIRE(at - bytes.begin() == bytes[10] - 3);
  const auto grown = from_hex("fe00000100");
  const auto offset = at - bytes.begin();
  bytes.erase(at, at + 3);
  bytes.insert(bytes.begin() + offset, grown.begin(), grown.end());
  bytes.insert(bytes.end(), entry.begin(), entry.end());
  bytes[10] += 2;
  const auto size = static_cast<std::uint32_t>(bytes.size());
  std::memcpy(bytes.data() + 4, &size, sizeof(size));
  const auto decoded = decode(bytes, {}, message);
  REQUIRE(!decoded);
  CHECK(decoded.error().message.find("65536 is above 65535") != std::string::npos);
}

TEST_CASE("the message size limit is exact") {
  for (const auto* name : {"array_double_v2", "array_double_v4"}) {
    const auto& vector = message_vector(name);
    Message message;
    REQUIRE(decode(vector.bytes, {}, message));
    CHECK(encode_error(message, {.max_message_size = vector.bytes.size()}) == "encoded");
    const auto size = std::to_string(vector.bytes.size());
    CHECK(encode_error(message, {.max_message_size = vector.bytes.size() - 1}) ==
          "BufferLimitViolation: encode: message has " + size + " bytes, limit " +
              std::to_string(vector.bytes.size() - 1));
  }
}

TEST_CASE("the local string table never exceeds 1024 bytes") {
  Message message = make_message();
  std::vector<std::string> names;
  for (int i = 0; i < 50; ++i) names.push_back("name_" + std::to_string(i) + std::string(60, 'n'));
  for (const auto& name : names) message.add(name, DataType::void_t, 0, {});
  for (const auto& name : names) message.add(name, DataType::void_t, 0, {});
  EncodedMessage encoded;
  const StringTableMode local{.local = true};
  REQUIRE(encode(message, {.string_table = local}, encoded));
  const auto bytes = encoded.to_bytes();
  const auto header_size = load<std::uint16_t>(bytes.data() + 11);
  CHECK(header_size <= 1024 + 10 + 3 + 1 + 1);
  Message again;
  REQUIRE(decode(bytes, {.string_table = local}, again));
  CHECK(compare_messages(again, message) == "");
}

TEST_CASE("a message whose parts contradict each other is not encoded") {
  Message message = make_message();
  message.header.version = 3;
  CHECK(encode_error(message) == "ProtocolError: encode: message version 3 is not known, expected 2 or 4");

  message = make_message();
  message.add("x", DataType::enum_t, 0, {});
  CHECK(encode_error(message) == "DataTypeError: encode: element 'x' (index 0): type 112 does not travel in messages");

  const Bytes data(8);
  message = make_message();
  message.add("x", DataType::double_t, 2, data);
  CHECK(encode_error(message) ==
        "DataSerializationError: encode: element 'x' (index 0): 2 items of double but 8 data bytes");
  message = make_message();
  message.add_numbered(3, DataType::void_t, 1, {});
  CHECK(encode_error(message) ==
        "DataSerializationError: encode: element #3 (index 0): 1 items of void but 0 data bytes");

  message = make_message();
  message.begin_nested("list", DataType::list_t);
  message.add("x", DataType::void_t, 0, {});
  message.elements[0].count = 2;
  CHECK(encode_error(message) ==
        "ProtocolError: encode: element 'list' (index 0): its children do not match its count");
  message.elements[0].count = 1;
  message.elements[0].end = 7;
  CHECK(encode_error(message) ==
        "ProtocolError: encode: element 'list' (index 0): its children do not match its count");
  message.elements[0].end = 2;
  message.entries[0].element_count = 2;
  CHECK(encode_error(message) == "ProtocolError: encode: entry 0: its elements do not match its element count");
  message.entries[0].element_count = 1;
  message.entries[0].end_element = 9;
  CHECK(encode_error(message) == "ProtocolError: encode: entry 0: its elements do not match its element count");
  message.entries.clear();
  CHECK(encode_error(message) == "ProtocolError: encode: elements behind the last entry");
}
