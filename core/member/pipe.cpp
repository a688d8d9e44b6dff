#include "core/member/pipe.hpp"

#include "core/member/wire.hpp"
#include "core/support/whole_number.hpp"

namespace rr {

namespace {

/// What a stored packet takes beside its payload: map node, values, names.
constexpr std::size_t packet_overhead = 128;

/// Of a packet's elements: the first one in the element that names the endpoint.
constexpr std::size_t packet_number_element = 1;

std::string pipe_subject(const MemberDefinition& member) {
  return "pipe '" + member.name + "'";
}

bool is_one_number(const MessageElement& element, DataType type) {
  return element.type == type && element.count >= 1;
}

std::size_t size_of(const Message& message, const MessageElement& element) {
  const auto first = static_cast<std::size_t>(&element - message.elements.data());
  std::size_t size = packet_overhead;
  for (std::size_t i = first; i < element.end; ++i) size += packet_overhead + message.elements[i].data.size();
  return size;
}

}  // namespace

// --- packing ---

void begin_pipe_packets(Message& message, std::string_view path, std::string_view member, bool is_unreliable) {
  auto& entry = message.begin_entry(EntryType::pipe_packet, path, member);
  if (is_unreliable) message.header.metadata = entry.metadata = unreliable_metadata;
}

Result<> write_pipe_packet(Message& message, std::int32_t index, std::uint32_t number, const Value& value,
                           bool wants_ack, const MemberDefinition& member, const TypeRegistry& types) {
  // Packets are named by decimal text, also in version 4; the message keeps the text.
  char text[12];
  const auto end = std::to_chars(text, text + sizeof(text), index).ptr;
  message.begin_nested(message.store(std::string_view(text, static_cast<std::size_t>(end - text))),
                       DataType::map_string_t);
  message.add_scalar("packetnumber", DataType::uint32_t, number);
  if (auto packed = pack(message, "packet", value, member.type, types); !packed) {
    auto error = packed.error();
    error.message = pipe_subject(member) + ": " + error.message;
    return error;
  }
  if (wants_ack) message.add_scalar("requestack", DataType::uint32_t, std::uint32_t{1});
  message.end_nested();
  return {};
}

Result<SharedMessage*> SharedPipePacket::message(std::string_view path, const MemberDefinition& member,
                                                 bool is_unreliable, std::int32_t index, std::uint32_t number,
                                                 const TypeRegistry& types) {
  if (path != path_ || is_unreliable != is_unreliable_ || index != index_) {
    message_.message.clear();
    message_.forget_encoded();
    path_ = path;
    is_unreliable_ = is_unreliable;
    index_ = index;
  }
  number_ = number;
  return message_.pack([&](Message& message) -> Result<> {
    begin_pipe_packets(message, path_, member.name, is_unreliable);
    if (auto written = write_pipe_packet(message, index, number, value_, wants_ack_, member, types); !written)
      return written;
    auto& data = message.elements[packet_number_element].data;
    data = ByteSpan(reinterpret_cast<const std::uint8_t*>(&number_), sizeof(number_));
    message_.own_number = data;
    return {};
  });
}

Result<std::int32_t> read_pipe_index(const MessageElement& element) {
  if (element.key_kind == KeyKind::number) return element.number;
  const auto index = whole_number<std::int32_t>(element.name);
  if (element.key_kind != KeyKind::name || !index)
    return protocol_error("pipe: element " + quote(element.name) + " does not name an endpoint");
  return *index;
}

Result<PipePacket> read_pipe_packet_head(const Message& message, const MessageElement& element,
                                         const MemberDefinition& member) {
  if (element.type != DataType::map_string_t)
    return make_error(ErrorCode::data_type_mismatch, pipe_subject(member) + ": a packet is a " +
                                                         std::string(data_type_name(element.type)) +
                                                         ", expected dictionary");
  const auto parts = message.children_of(element);
  const auto* number = parts.find("packetnumber");
  if (!number || !is_one_number(*number, DataType::uint32_t))
    return make_error(number ? ErrorCode::data_type_mismatch : ErrorCode::message_element_not_found,
                      pipe_subject(member) + ": packetnumber is not a uint32");
  PipePacket packet;
  packet.number = load<std::uint32_t>(number->data.data());
  packet.wants_ack = parts.find("requestack") != nullptr;
  packet.size_bytes = size_of(message, element);
  return packet;
}

Result<> read_pipe_packet_value(const Message& message, const MessageElement& element, const MemberDefinition& member,
                                const TypeRegistry& types, PipePacket& packet) {
  const auto* value = message.children_of(element).find("packet");
  if (!value)
    return make_error(ErrorCode::message_element_not_found, pipe_subject(member) + ": element packet not found");
  auto read = unpack(message, *value, member.type, types);
  if (!read) return read.error();
  packet.value = std::move(*read);
  return {};
}

void write_pipe_ack(Message& message, std::int32_t index, std::uint32_t number) {
  message.add_numbered(index, DataType::uint32_t, 1,
                       message.store(ByteSpan(reinterpret_cast<const std::uint8_t*>(&number), sizeof(number))));
}

Result<std::vector<std::uint32_t>> read_pipe_ack(const MessageElement& element) {
  if (element.type != DataType::uint32_t)
    return make_error(ErrorCode::data_type_mismatch,
                      "pipe: an acknowledgement is " + std::string(data_type_name(element.type)) + ", expected uint32");
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < element.count; ++i)
    numbers.push_back(load<std::uint32_t>(element.data.data() + i * sizeof(std::uint32_t)));
  return numbers;
}

void write_pipe_index(Message& message, std::int32_t index) {
  message.add_scalar("index", DataType::int32_t, index);
}

Result<std::int32_t> read_pipe_index_element(const Message& message, const MessageEntry& entry,
                                             const MemberDefinition& member) {
  const auto* element = message.elements_of(entry).find("index");
  if (!element)
    return make_error(ErrorCode::message_element_not_found, pipe_subject(member) + ": element index not found");
  if (!is_one_number(*element, DataType::int32_t))
    return make_error(
        ErrorCode::data_type_mismatch,
        pipe_subject(member) + ": index is " + std::string(data_type_name(element->type)) + ", expected int32");
  return load<std::int32_t>(element->data.data());
}

void write_unreliable(Message& message) {
  message.add_scalar("unreliable", DataType::int32_t, std::int32_t{1});
}

bool reads_unreliable(const Message& message, const MessageEntry& entry) {
  const auto* element = message.elements_of(entry).find("unreliable");
  return element && is_one_number(*element, DataType::int32_t) && load<std::int32_t>(element->data.data()) == 1;
}

// --- state ---

PipeEndpointState::~PipeEndpointState() {
  for (const auto& [order, packet] : waiting_) store_->bytes -= packet.size_bytes;
}

Result<> PipeEndpointState::keep(PipePacket packet) {
  const auto ahead = packet.number - static_cast<std::uint32_t>(received_ + 1);
  const auto order = received_ + 1 + ahead;
  if (ahead > UINT32_MAX / 2 || waiting_.contains(order)) return {};  // it came before
  if (ahead >= store_->max_packets_ahead)
    return make_error(ErrorCode::out_of_system_resource,
                      pipe_subject(*member_) + ": packet " + std::to_string(packet.number) + " came while " +
                          std::to_string(static_cast<std::uint32_t>(received_ + 1)) + " is missing; at most " +
                          std::to_string(store_->max_packets_ahead) + " may be kept");
  if (store_->max_bytes - store_->bytes < packet.size_bytes)
    return make_error(ErrorCode::out_of_system_resource, pipe_subject(*member_) + ": packets that wait for number " +
                                                             std::to_string(static_cast<std::uint32_t>(received_ + 1)) +
                                                             " take more than " + std::to_string(store_->max_bytes) +
                                                             " bytes");
  store_->bytes += packet.size_bytes;
  waiting_.emplace(order, std::move(packet));
  return {};
}

PipePacket PipeEndpointState::take_first() {
  auto first = waiting_.extract(waiting_.begin());
  store_->bytes -= first.mapped().size_bytes;
  return std::move(first.mapped());
}

}  // namespace rr
