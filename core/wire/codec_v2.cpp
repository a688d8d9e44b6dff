// Message version 2: fixed widths, every field always there. Layer: wire. Source: messages spec sections 3.1, 5.1, 6.1.

#include <charconv>
#include <iterator>

#include "core/wire/codec_list.hpp"
#include "core/wire/element_tree.hpp"
#include "core/wire/encode_plan.hpp"
#include "core/wire/frame_start.hpp"

namespace rr {

namespace {

constexpr std::size_t header_fixed_size = 64;
constexpr std::size_t entry_fixed_size = 22;
constexpr std::size_t element_fixed_size = 16;
constexpr std::size_t max_text_size = 65535;
constexpr std::uint64_t max_data_size = 0x7fffffff;  // 1.2.8 fails above

// --- reading ---

struct Reading {
  static constexpr std::size_t min_element_size = element_fixed_size;

  static void read_element(ByteReader& in, MessageElement& element) {
    const auto start = in.at();
    enter_structure(in, start, in.number<std::uint32_t>("ElementSize"), "ElementSize");
    element.name = in.text16("ElementName");
    const auto type_at = in.at();
    element.type = static_cast<DataType>(in.number<std::uint16_t>("ElementType"));
    check_wire_type(in, type_at, element.type);
    element.type_name = in.text16("ElementTypeName");
    element.metadata = in.text16("element MetaData");
  }

  static std::uint32_t read_count(ByteReader& in) { return in.number<std::uint32_t>("DataCount"); }
};

std::uint16_t read_header(ByteReader& in, MessageHeader& header) {
  header.version = 2;
  in.bytes(frame_start_size, "header");
  const auto size_at = in.at();
  const std::size_t header_size = in.number<std::uint16_t>("HeaderSize");
  if (in.ok() && (header_size < header_fixed_size || header_size > in.limit()))
    in.fail(ErrorCode::protocol_error, "HeaderSize", size_at,
            std::to_string(header_size) + " is outside " + std::to_string(header_fixed_size) + ".." +
                std::to_string(in.limit()) + " (MessageSize)");
  in.set_limit(header_size);
  header.sender_node_id = in.node_id("SenderNodeID");
  header.receiver_node_id = in.node_id("ReceiverNodeID");
  header.sender_endpoint = in.number<std::uint32_t>("SenderEndpoint");
  header.receiver_endpoint = in.number<std::uint32_t>("ReceiverEndpoint");
  header.sender_node_name = in.text16("SenderNodeName");
  header.receiver_node_name = in.text16("ReceiverNodeName");
  header.metadata = in.text16("header MetaData");
  const auto entry_count = in.number<std::uint16_t>("EntryCount");
  header.message_id = in.number<std::uint16_t>("MessageID");
  header.message_res_id = in.number<std::uint16_t>("MessageResID");
  if (in.ok() && in.left() != 0)
    in.fail(ErrorCode::protocol_error, "HeaderSize", size_at,
            std::to_string(header_size) + ", but the header fields end at byte " + std::to_string(in.at()));
  return entry_count;
}

void read_entry(ByteReader& in, const DecodeOptions& options, Message& message) {
  const auto start = in.at();
  enter_structure(in, start, in.number<std::uint32_t>("EntrySize"), "EntrySize");
  MessageEntry entry;
  entry.type = static_cast<EntryType>(in.number<std::uint16_t>("EntryType"));
  in.number<std::uint16_t>("reserved word of the entry");
  entry.service_path = in.text16("ServicePath");
  entry.member_name = in.text16("MemberName");
  entry.request_id = in.number<std::uint32_t>("RequestID");
  entry.error = static_cast<ErrorCode>(in.number<std::uint16_t>("Error"));
  entry.metadata = in.text16("entry MetaData");
  const auto count_at = in.at();
  entry.element_count = in.number<std::uint16_t>("element count");
  check_count(in, count_at, entry.element_count, element_fixed_size, "element count");
  if (!in.ok()) return;
  entry.first_element = static_cast<std::uint32_t>(message.elements.size());
  Reading reading;
  decode_elements(in, reading, entry.element_count, options, message);
  entry.end_element = static_cast<std::uint32_t>(message.elements.size());
  message.entries.push_back(entry);
}

// --- writing ---

/// A numbered element's name: `-3`, `0`, `17`.
struct NumberText {
  explicit NumberText(std::int32_t number)
      : end(std::to_chars(std::begin(characters), std::end(characters), number).ptr) {}
  std::string_view text() const { return {characters, static_cast<std::size_t>(end - characters)}; }
  char characters[11];
  char* end;
};

struct Sizing {
  static const char* refuse(const MessageElement& element) {
    if (!element.extended.empty()) return "version 2 has no extended data";
    if (element.name.size() > max_text_size) return "name longer than 65535 bytes";
    if (element.type_name.size() > max_text_size) return "type name longer than 65535 bytes";
    if (element.metadata.size() > max_text_size) return "metadata longer than 65535 bytes";
    if (element.data.size() > max_data_size) return "data longer than 2147483647 bytes";
    return nullptr;
  }
  static const char* refuse(const MessageEntry& entry) {
    if (!entry.extended.empty()) return "version 2 has no extended data";
    if (entry.service_path.size() > max_text_size) return "service path longer than 65535 bytes";
    if (entry.member_name.size() > max_text_size) return "member name longer than 65535 bytes";
    if (entry.metadata.size() > max_text_size) return "metadata longer than 65535 bytes";
    if (entry.element_count > 65535) return "more than 65535 elements";
    return nullptr;
  }
  static std::uint64_t size(const MessageElement& element, const EncodePlan::Item&, std::uint64_t body) {
    const auto name =
        element.key_kind == KeyKind::number ? NumberText(element.number).text().size() : element.name.size();
    return element_fixed_size + name + element.type_name.size() + element.metadata.size() + body;
  }
  static std::uint64_t size(const MessageEntry& entry, const EncodePlan::Item&, std::uint64_t body) {
    return entry_fixed_size + entry.service_path.size() + entry.member_name.size() + entry.metadata.size() + body;
  }
};

const char* refuse_header(const Message& message) {
  const auto& header = message.header;
  if (!header.extended.empty()) return "version 2 has no extended data";
  if (header.priority) return "version 2 has no priority";
  if (header.is_unreliable) return "version 2 has no unreliable flag";
  if (message.entries.size() > max_entry_count) return "more than 65535 entries";
  if (header_fixed_size + header.sender_node_name.size() + header.receiver_node_name.size() + header.metadata.size() >
      max_text_size)
    return "header longer than 65535 bytes";
  return nullptr;
}

void write_element(GatherWriter& out, const MessageElement& element, std::uint32_t size) {
  out.number(size);
  if (element.key_kind == KeyKind::number)
    out.text16(NumberText(element.number).text());
  else
    out.text16(element.name);
  out.number(static_cast<std::uint16_t>(element.type));
  out.text16(element.type_name);
  out.text16(element.metadata);
  out.number(element.count);
  out.payload(element.data);
}

void write_entry(GatherWriter& out, const MessageEntry& entry, std::uint32_t size) {
  out.number(size);
  out.number(static_cast<std::uint16_t>(entry.type));
  out.number(std::uint16_t{0});
  out.text16(entry.service_path);
  out.text16(entry.member_name);
  out.number(entry.request_id);
  out.number(static_cast<std::uint16_t>(entry.error));
  out.text16(entry.metadata);
  out.number(static_cast<std::uint16_t>(entry.element_count));
}

void write_header(GatherWriter& out, const Message& message, std::size_t header_size, std::size_t message_size) {
  const auto& header = message.header;
  out.bytes(as_bytes(frame_magic));
  out.number(static_cast<std::uint32_t>(message_size));
  out.number(std::uint16_t{2});
  out.number(static_cast<std::uint16_t>(header_size));
  out.node_id(header.sender_node_id);
  out.node_id(header.receiver_node_id);
  out.number(header.sender_endpoint);
  out.number(header.receiver_endpoint);
  out.text16(header.sender_node_name);
  out.text16(header.receiver_node_name);
  out.text16(header.metadata);
  out.number(static_cast<std::uint16_t>(message.entries.size()));
  out.number(header.message_id);
  out.number(header.message_res_id);
}

}  // namespace

Result<> decode_v2(ByteSpan bytes, const DecodeOptions& options, Message& message) {
  ByteReader in(bytes);
  const auto entry_count = read_header(in, message.header);
  in.set_limit(bytes.size());
  check_count(in, in.at(), entry_count, entry_fixed_size, "EntryCount");
  for (std::uint32_t index = 0; in.ok() && index < entry_count; ++index) {
    read_entry(in, options, message);
    in.set_limit(bytes.size());
  }
  return end_entries(in, entry_count);
}

Result<> encode_v2(const Message& message, const EncodeOptions& options, EncodedMessage& encoded) {
  if (const char* reason = refuse_header(message)) return protocol_error(std::string("encode: header: ") + reason);
  GatherWriter out(encoded);
  auto& plan = out.plan();
  plan.entries.resize(message.entries.size());
  plan.elements.resize(message.elements.size());
  Sizing sizing;
  SizePass pass(message, plan, sizing);
  if (auto sized = pass.run(); !sized) return sized;

  const auto& header = message.header;
  const std::size_t header_size =
      header_fixed_size + header.sender_node_name.size() + header.receiver_node_name.size() + header.metadata.size();
  const auto message_size = check_message_size(header_size + pass.entries_size(), options);
  if (!message_size) return message_size.error();

  out.begin(*message_size, pass.gathered_size());
  write_header(out, message, header_size, *message_size);
  for (std::size_t index = 0; index < message.entries.size(); ++index) {
    const auto& entry = message.entries[index];
    write_entry(out, entry, plan.entries[index].size);
    for (auto element = entry.first_element; element < entry.end_element; ++element)
      write_element(out, message.elements[element], plan.elements[element].size);
  }
  return out.finish(message);
}

}  // namespace rr
