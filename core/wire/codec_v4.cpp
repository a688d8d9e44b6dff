// Message version 4: fields chosen by flags, variable widths, string codes. Layer: wire.
// Source: messages spec sections 3.2, 4, 5.2, 6.2.

#include <optional>

#include "core/wire/codec_list.hpp"
#include "core/wire/element_tree.hpp"
#include "core/wire/encode_plan.hpp"
#include "core/wire/frame_start.hpp"
#include "core/wire/string_table.hpp"

namespace rr {

namespace {

namespace header_flag {
constexpr std::uint8_t routing_info = 0x01;
constexpr std::uint8_t endpoint_info = 0x02;
constexpr std::uint8_t priority = 0x04;
constexpr std::uint8_t unreliable = 0x08;
constexpr std::uint8_t meta_info = 0x10;
constexpr std::uint8_t string_table = 0x20;
constexpr std::uint8_t multiple_entries = 0x40;
constexpr std::uint8_t extended = 0x80;
}  // namespace header_flag

namespace entry_flag {
constexpr std::uint8_t service_path_str = 0x01;
constexpr std::uint8_t service_path_code = 0x02;
constexpr std::uint8_t member_name_str = 0x04;
constexpr std::uint8_t member_name_code = 0x08;
constexpr std::uint8_t request_id = 0x10;
constexpr std::uint8_t error = 0x20;
constexpr std::uint8_t meta_info = 0x40;
constexpr std::uint8_t extended = 0x80;
}  // namespace entry_flag

namespace element_flag {
constexpr std::uint8_t name_str = 0x01;
constexpr std::uint8_t name_code = 0x02;
constexpr std::uint8_t number = 0x04;
constexpr std::uint8_t type_name_str = 0x08;
constexpr std::uint8_t type_name_code = 0x10;
constexpr std::uint8_t meta_info = 0x20;
constexpr std::uint8_t extended = 0x80;
}  // namespace element_flag

constexpr std::size_t min_header_size = 12;
constexpr std::size_t min_entry_size = 5;
constexpr std::size_t min_element_size_v4 = 5;
constexpr std::size_t min_table_entry_size = 2;

constexpr bool all_set(std::uint8_t flags, std::uint8_t wanted) {
  return (flags & wanted) == wanted;
}

// --- reading ---

class Reading {
 public:
  static constexpr std::size_t min_element_size = min_element_size_v4;

  Reading(ByteReader& in, const DecodeOptions& options) : in_(in), options_(options) {}

  /// Returns EntryCount.
  std::uint32_t read_header(MessageHeader& header);
  void read_entry(Message& message);
  void read_element(ByteReader& in, MessageElement& element);
  static std::uint32_t read_count(ByteReader& in) { return in.uint_x("DataCount"); }

 private:
  void read_string_table();
  /// One of the four codable texts: at most one of the two flags may be set; absent reads as empty.
  std::string_view read_text(std::uint8_t flags, std::uint8_t text_flag, std::uint8_t code_flag, const char* field);
  std::string_view read_code(const char* field);

  ByteReader& in_;
  const DecodeOptions& options_;
  LocalTexts local_;
  std::size_t coded_text_ = 0;  ///< bytes that codes stood for so far
};

std::uint32_t Reading::read_header(MessageHeader& header) {
  header.version = 4;
  in_.bytes(frame_start_size, "header");
  const auto size_at = in_.at();
  const auto header_size = in_.uint_x("HeaderSize");
  if (in_.ok() && (header_size < min_header_size || header_size > in_.limit()))
    in_.fail(ErrorCode::protocol_error, "HeaderSize", size_at,
             std::to_string(header_size) + " is outside " + std::to_string(min_header_size) + ".." +
                 std::to_string(in_.limit()) + " (MessageSize)");
  if (in_.ok() && header_size < in_.at())
    in_.fail(ErrorCode::protocol_error, "HeaderSize", size_at, std::to_string(header_size) + " ends inside itself");
  in_.set_limit(header_size);

  const auto flags = in_.number<std::uint8_t>("MessageFlags");
  header.has_routing = (flags & header_flag::routing_info) != 0;
  header.has_endpoints = (flags & header_flag::endpoint_info) != 0;
  header.is_unreliable = (flags & header_flag::unreliable) != 0;
  if (header.has_routing) {
    header.sender_node_id = in_.node_id("SenderNodeID");
    header.receiver_node_id = in_.node_id("ReceiverNodeID");
    header.sender_node_name = in_.text_x("SenderNodeName");
    header.receiver_node_name = in_.text_x("ReceiverNodeName");
  }
  if (header.has_endpoints) {
    header.sender_endpoint = in_.uint_x("SenderEndpoint");
    header.receiver_endpoint = in_.uint_x("ReceiverEndpoint");
  }
  if ((flags & header_flag::priority) != 0) header.priority = in_.number<std::uint16_t>("Priority");
  if ((flags & header_flag::meta_info) != 0) {
    header.metadata = in_.text_x("header MetaData");
    header.message_id = in_.number<std::uint16_t>("MessageID");
    header.message_res_id = in_.number<std::uint16_t>("MessageResID");
  }
  if ((flags & header_flag::string_table) != 0) read_string_table();
  std::uint32_t entry_count = 1;
  if ((flags & header_flag::multiple_entries) != 0) {
    const auto count_at = in_.at();
    entry_count = in_.uint_x("EntryCount");
    if (in_.ok() && entry_count > max_entry_count)
      in_.fail(ErrorCode::protocol_error, "EntryCount", count_at,
               std::to_string(entry_count) + " is above " + std::to_string(max_entry_count));
  }
  if ((flags & header_flag::extended) != 0) header.extended = in_.bytes_x("header Extended");
  if (in_.ok() && in_.left() != 0)
    in_.fail(ErrorCode::protocol_error, "HeaderSize", size_at,
             std::to_string(header_size) + ", but the header fields end at byte " + std::to_string(in_.at()));
  return entry_count;
}

void Reading::read_string_table() {
  const auto count_at = in_.at();
  const auto count = in_.uint_x("string table count");
  check_count(in_, count_at, count, min_table_entry_size, "string table count");
  for (std::uint32_t index = 0; in_.ok() && index < count; ++index) {
    const auto code = in_.uint_x("string table code");
    const auto text = in_.text_x("string table text");
    if (code % 2 != 0) local_.add(code, text);  // even codes belong to the standard table
  }
  local_.sort();
}

std::string_view Reading::read_text(std::uint8_t flags, std::uint8_t text_flag, std::uint8_t code_flag,
                                    const char* field) {
  if ((flags & text_flag) != 0) return in_.text_x(field);
  return (flags & code_flag) != 0 ? read_code(field) : std::string_view{};
}

std::string_view Reading::read_code(const char* field) {
  const auto code_at = in_.at();
  const auto code = in_.uint_x(field);
  if (!in_.ok()) return {};
  std::optional<std::string_view> text;
  if (code % 2 != 0) {
    if (options_.string_table.is_active()) text = local_.find(code);
  } else if (options_.string_table.standard) {
    text = standard_text(code);
  }
  if (!text)
    in_.fail(ErrorCode::protocol_error, field, code_at,
             "string code " + std::to_string(code) +
                 (options_.string_table.is_active() ? " is in no table" : ", but no string table was agreed on"));
  // Few bytes may name one long text again and again; whoever reads the message copies and compares it each time.
  coded_text_ += text ? text->size() : 0;
  if (coded_text_ > options_.max_coded_text())
    in_.fail(ErrorCode::protocol_error, field, code_at,
             "the texts behind string codes are more than " + std::to_string(options_.max_coded_text()) + " bytes");
  return text.value_or(std::string_view{});
}

void Reading::read_entry(Message& message) {
  const auto start = in_.at();
  enter_structure(in_, start, in_.uint_x("EntrySize"), "EntrySize");
  const auto flags_at = in_.at();
  const auto flags = in_.number<std::uint8_t>("EntryFlags");
  if (all_set(flags, entry_flag::service_path_str | entry_flag::service_path_code) ||
      all_set(flags, entry_flag::member_name_str | entry_flag::member_name_code))
    in_.fail(ErrorCode::protocol_error, "EntryFlags", flags_at, "a field comes both as text and as code");
  MessageEntry entry;
  entry.type = static_cast<EntryType>(in_.number<std::uint16_t>("EntryType"));
  entry.service_path = read_text(flags, entry_flag::service_path_str, entry_flag::service_path_code, "ServicePath");
  entry.member_name = read_text(flags, entry_flag::member_name_str, entry_flag::member_name_code, "MemberName");
  if ((flags & entry_flag::request_id) != 0) entry.request_id = in_.uint_x("RequestID");
  if ((flags & entry_flag::error) != 0) entry.error = static_cast<ErrorCode>(in_.number<std::uint16_t>("Error"));
  if ((flags & entry_flag::meta_info) != 0) entry.metadata = in_.text_x("entry MetaData");
  if ((flags & entry_flag::extended) != 0) entry.extended = in_.bytes_x("entry Extended");
  const auto count_at = in_.at();
  entry.element_count = in_.uint_x("element count");
  check_count(in_, count_at, entry.element_count, min_element_size, "element count");
  if (!in_.ok()) return;
  entry.first_element = static_cast<std::uint32_t>(message.elements.size());
  decode_elements(in_, *this, entry.element_count, options_, message);
  entry.end_element = static_cast<std::uint32_t>(message.elements.size());
  message.entries.push_back(entry);
}

void Reading::read_element(ByteReader& in, MessageElement& element) {
  const auto start = in.at();
  enter_structure(in, start, in.uint_x("ElementSize"), "ElementSize");
  const auto flags_at = in.at();
  const auto flags = in.number<std::uint8_t>("ElementFlags");
  const bool has_number = (flags & element_flag::number) != 0;
  const bool has_name = (flags & (element_flag::name_str | element_flag::name_code)) != 0;
  if (all_set(flags, element_flag::name_str | element_flag::name_code) ||
      all_set(flags, element_flag::type_name_str | element_flag::type_name_code))
    in.fail(ErrorCode::protocol_error, "ElementFlags", flags_at, "a field comes both as text and as code");
  if (has_number && has_name)
    in.fail(ErrorCode::protocol_error, "ElementFlags", flags_at, "the element has both a name and a number");

  element.key_kind = has_name ? KeyKind::name : has_number ? KeyKind::number : KeyKind::none;
  element.name = read_text(flags, element_flag::name_str, element_flag::name_code, "ElementName");
  if (has_number) element.number = in.int_x("ElementNumber");
  const auto type_at = in.at();
  element.type = static_cast<DataType>(in.number<std::uint16_t>("ElementType"));
  check_wire_type(in, type_at, element.type);
  element.type_name = read_text(flags, element_flag::type_name_str, element_flag::type_name_code, "ElementTypeName");
  if ((flags & element_flag::meta_info) != 0) element.metadata = in.text_x("element MetaData");
  if ((flags & element_flag::extended) != 0) element.extended = in.bytes_x("element Extended");
}

// --- writing ---

std::uint8_t flags_of(const Message& message, const StringCoder& coder) {
  const auto& header = message.header;
  std::uint8_t flags = 0;
  if (header.has_routing) flags |= header_flag::routing_info;
  if (header.has_endpoints) flags |= header_flag::endpoint_info;
  if (header.priority) flags |= header_flag::priority;
  if (header.is_unreliable) flags |= header_flag::unreliable;
  if (!header.metadata.empty() || header.message_id != 0 || header.message_res_id != 0) flags |= header_flag::meta_info;
  if (coder.local_count() != 0) flags |= header_flag::string_table;
  if (message.entries.size() != 1) flags |= header_flag::multiple_entries;
  if (!header.extended.empty()) flags |= header_flag::extended;
  return flags;
}

std::uint8_t flags_of(const MessageEntry& entry, const EncodePlan::Item& item) {
  std::uint8_t flags = 0;
  flags |=
      item.qualifier_code == EncodePlan::inline_text ? entry_flag::service_path_str : entry_flag::service_path_code;
  flags |= item.name_code == EncodePlan::inline_text ? entry_flag::member_name_str : entry_flag::member_name_code;
  if (entry.request_id != 0) flags |= entry_flag::request_id;
  if (entry.error != ErrorCode::none) flags |= entry_flag::error;
  if (!entry.metadata.empty()) flags |= entry_flag::meta_info;
  if (!entry.extended.empty()) flags |= entry_flag::extended;
  return flags;
}

std::uint8_t flags_of(const MessageElement& element, const EncodePlan::Item& item) {
  std::uint8_t flags = 0;
  if (element.key_kind == KeyKind::number)
    flags |= element_flag::number;
  else if (element.key_kind == KeyKind::name)
    flags |= item.name_code == EncodePlan::inline_text ? element_flag::name_str : element_flag::name_code;
  if (!element.type_name.empty())
    flags |=
        item.qualifier_code == EncodePlan::inline_text ? element_flag::type_name_str : element_flag::type_name_code;
  if (!element.metadata.empty()) flags |= element_flag::meta_info;
  if (!element.extended.empty()) flags |= element_flag::extended;
  return flags;
}

/// Section 4.2: MemberName, ServicePath, then the elements in order, ElementName before ElementTypeName.
void assign_codes(const Message& message, StringCoder& coder, EncodePlan& plan) {
  for (std::size_t index = 0; index < message.entries.size(); ++index) {
    const auto& entry = message.entries[index];
    plan.entries[index].name_code = coder.note(entry.member_name);
    plan.entries[index].qualifier_code = coder.note(entry.service_path);
    for (auto at = entry.first_element; at < entry.end_element && at < message.elements.size(); ++at) {
      const auto& element = message.elements[at];
      if (element.key_kind == KeyKind::name) plan.elements[at].name_code = coder.note(element.name);
      if (!element.type_name.empty()) plan.elements[at].qualifier_code = coder.note(element.type_name);
    }
  }
  coder.choose();
  for (auto* items : {&plan.entries, &plan.elements})
    for (auto& item : *items) {
      item.name_code = coder.code_of(item.name_code);
      item.qualifier_code = coder.code_of(item.qualifier_code);
    }
}

std::size_t block_size(std::size_t bytes) {
  return uint_x_size(static_cast<std::uint32_t>(bytes)) + bytes;
}

std::size_t text_size(std::string_view text, std::uint32_t code) {
  return code == EncodePlan::inline_text ? block_size(text.size()) : uint_x_size(code);
}

struct Sizing {
  static const char* refuse(const MessageElement& element) {
    return is_too_long(element.name) || is_too_long(element.type_name) || is_too_long(element.metadata) ||
                   element.extended.size() > max_structure_size
               ? "a text longer than 4294967295 bytes"
               : nullptr;
  }
  static const char* refuse(const MessageEntry& entry) {
    return is_too_long(entry.service_path) || is_too_long(entry.member_name) || is_too_long(entry.metadata) ||
                   entry.extended.size() > max_structure_size
               ? "a text longer than 4294967295 bytes"
               : nullptr;
  }

  static std::uint64_t size(const MessageElement& element, const EncodePlan::Item& item, std::uint64_t body) {
    std::uint64_t size = 1 + 2 + uint_x_size(element.count) + body;
    if (element.key_kind == KeyKind::number)
      size += int_x_size(element.number);
    else if (element.key_kind == KeyKind::name)
      size += text_size(element.name, item.name_code);
    if (!element.type_name.empty()) size += text_size(element.type_name, item.qualifier_code);
    if (!element.metadata.empty()) size += block_size(element.metadata.size());
    if (!element.extended.empty()) size += block_size(element.extended.size());
    return with_uint_x_size(size);
  }

  static std::uint64_t size(const MessageEntry& entry, const EncodePlan::Item& item, std::uint64_t body) {
    std::uint64_t size = 1 + 2 + text_size(entry.service_path, item.qualifier_code) +
                         text_size(entry.member_name, item.name_code) + uint_x_size(entry.element_count) + body;
    if (entry.request_id != 0) size += uint_x_size(entry.request_id);
    if (entry.error != ErrorCode::none) size += 2;
    if (!entry.metadata.empty()) size += block_size(entry.metadata.size());
    if (!entry.extended.empty()) size += block_size(entry.extended.size());
    return with_uint_x_size(size);
  }

 private:
  static bool is_too_long(std::string_view text) { return text.size() > max_structure_size; }
};

std::uint64_t header_size_of(const Message& message, const StringCoder& coder, std::uint8_t flags) {
  const auto& header = message.header;
  std::uint64_t size = frame_start_size + 1;
  if ((flags & header_flag::routing_info) != 0)
    size += 32 + block_size(header.sender_node_name.size()) + block_size(header.receiver_node_name.size());
  if ((flags & header_flag::endpoint_info) != 0)
    size += uint_x_size(header.sender_endpoint) + uint_x_size(header.receiver_endpoint);
  if ((flags & header_flag::priority) != 0) size += 2;
  if ((flags & header_flag::meta_info) != 0) size += block_size(header.metadata.size()) + 4;
  if ((flags & header_flag::string_table) != 0)
    size += uint_x_size(static_cast<std::uint32_t>(coder.local_count())) + coder.local_size();
  if ((flags & header_flag::multiple_entries) != 0)
    size += uint_x_size(static_cast<std::uint32_t>(message.entries.size()));
  if ((flags & header_flag::extended) != 0) size += block_size(header.extended.size());
  return with_uint_x_size(size);
}

void write_header(GatherWriter& out, const Message& message, const StringCoder& coder, std::uint8_t flags,
                  std::uint64_t header_size, std::uint64_t message_size) {
  const auto& header = message.header;
  out.bytes(as_bytes(frame_magic));
  out.number(static_cast<std::uint32_t>(message_size));
  out.number(std::uint16_t{4});
  out.uint_x(static_cast<std::uint32_t>(header_size));
  out.number(flags);
  if ((flags & header_flag::routing_info) != 0) {
    out.node_id(header.sender_node_id);
    out.node_id(header.receiver_node_id);
    out.text_x(header.sender_node_name);
    out.text_x(header.receiver_node_name);
  }
  if ((flags & header_flag::endpoint_info) != 0) {
    out.uint_x(header.sender_endpoint);
    out.uint_x(header.receiver_endpoint);
  }
  if ((flags & header_flag::priority) != 0) out.number(*header.priority);
  if ((flags & header_flag::meta_info) != 0) {
    out.text_x(header.metadata);
    out.message_id(header.message_id);
    out.number(header.message_res_id);
  }
  if ((flags & header_flag::string_table) != 0) {
    out.uint_x(static_cast<std::uint32_t>(coder.local_count()));
    coder.visit_local([&](std::uint32_t code, std::string_view text) {
      out.uint_x(code);
      out.text_x(text);
    });
  }
  if ((flags & header_flag::multiple_entries) != 0) out.uint_x(static_cast<std::uint32_t>(message.entries.size()));
  if ((flags & header_flag::extended) != 0) out.bytes_x(header.extended);
}

void write_text(GatherWriter& out, std::string_view text, std::uint32_t code) {
  if (code == EncodePlan::inline_text)
    out.text_x(text);
  else
    out.uint_x(code);
}

void write_entry(GatherWriter& out, const MessageEntry& entry, const EncodePlan::Item& item) {
  out.uint_x(item.size);
  out.number(flags_of(entry, item));
  out.number(static_cast<std::uint16_t>(entry.type));
  write_text(out, entry.service_path, item.qualifier_code);
  write_text(out, entry.member_name, item.name_code);
  if (entry.request_id != 0) out.uint_x(entry.request_id);
  if (entry.error != ErrorCode::none) out.number(static_cast<std::uint16_t>(entry.error));
  if (!entry.metadata.empty()) out.text_x(entry.metadata);
  if (!entry.extended.empty()) out.bytes_x(entry.extended);
  out.uint_x(entry.element_count);
}

void write_element(GatherWriter& out, const MessageElement& element, const EncodePlan::Item& item) {
  out.uint_x(item.size);
  out.number(flags_of(element, item));
  if (element.key_kind == KeyKind::number)
    out.int_x(element.number);
  else if (element.key_kind == KeyKind::name)
    write_text(out, element.name, item.name_code);
  out.number(static_cast<std::uint16_t>(element.type));
  if (!element.type_name.empty()) write_text(out, element.type_name, item.qualifier_code);
  if (!element.metadata.empty()) out.text_x(element.metadata);
  if (!element.extended.empty()) out.bytes_x(element.extended);
  out.uint_x(element.count);
  out.payload(element.data);
}

}  // namespace

Result<> decode_v4(ByteSpan bytes, const DecodeOptions& options, Message& message) {
  ByteReader in(bytes);
  Reading reading(in, options);
  const auto entry_count = reading.read_header(message.header);
  in.set_limit(bytes.size());
  check_count(in, in.at(), entry_count, min_entry_size, "EntryCount");
  for (std::uint32_t index = 0; in.ok() && index < entry_count; ++index) {
    reading.read_entry(message);
    in.set_limit(bytes.size());
  }
  return end_entries(in, entry_count);
}

Result<> encode_v4(const Message& message, const EncodeOptions& options, EncodedMessage& encoded) {
  const auto& header = message.header;
  if (message.entries.size() > max_entry_count) return protocol_error("encode: more than 65535 entries");
  if (header.sender_node_name.size() > max_structure_size || header.receiver_node_name.size() > max_structure_size ||
      header.metadata.size() > max_structure_size || header.extended.size() > max_structure_size)
    return protocol_error("encode: header: a text longer than 4294967295 bytes");

  GatherWriter out(encoded);
  auto& plan = out.plan();
  plan.entries.resize(message.entries.size());
  plan.elements.resize(message.elements.size());
  StringCoder coder(options.string_table.standard, options.string_table.local);
  if (options.string_table.is_active()) assign_codes(message, coder, plan);
  Sizing sizing;
  SizePass pass(message, plan, sizing);
  if (auto sized = pass.run(); !sized) return sized;

  const auto flags = flags_of(message, coder);
  const auto header_size = header_size_of(message, coder, flags);
  const auto message_size = check_message_size(header_size + pass.entries_size(), options);
  if (!message_size) return message_size.error();
  if (*message_size < min_message_size)
    return protocol_error("encode: a message without entries and routing is too short to be sent");

  out.begin(*message_size, pass.gathered_size());
  write_header(out, message, coder, flags, header_size, *message_size);
  for (std::size_t index = 0; index < message.entries.size(); ++index) {
    const auto& entry = message.entries[index];
    write_entry(out, entry, plan.entries[index]);
    for (auto element = entry.first_element; element < entry.end_element; ++element)
      write_element(out, message.elements[element], plan.elements[element]);
  }
  return out.finish(message);
}

}  // namespace rr
