#include "core/session/connection.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/member/error_entry.hpp"

namespace rr {

namespace {

constexpr std::string_view create_connection = "CreateConnection";
constexpr std::string_view get_remote_node_id = "GetRemoteNodeID";
constexpr std::string_view start_tls = "STARTTLS";
constexpr std::size_t send_headroom = 100;  // the reference sends at most its receive limit less 100 bytes

bool is_special(EntryType type) {
  return static_cast<std::uint16_t>(type) < 500;
}

/// StreamOp, StreamCheckCapability, ConnectionTest and their replies never reach the session.
bool is_stream_entry(EntryType type) {
  const auto code = static_cast<std::uint16_t>(type);
  return (code >= 1 && code <= 4) || type == EntryType::connection_test || type == EntryType::connection_test_ret;
}

/// The capabilities that this version of the stream layer answers with something other than 0.
std::uint32_t capability_value(std::string_view name) {
  constexpr std::pair<std::string_view, std::uint32_t> values[] = {
      {"com.robotraconteur.message.v_max", 4},  {"com.robotraconteur.v2", 1},
      {"com.robotraconteur.v2.0", 1},           {"com.robotraconteur.message.v4", 1},
      {"com.robotraconteur.message.v4.0", 1},   {"com.robotraconteur.stringtable", 4},
      {"com.robotraconteur.stringtable.v4", 1}, {"com.robotraconteur.stringtable.v4.0", 1},
  };
  for (const auto& [known, value] : values)
    if (known == name) return value;
  return 0;
}

Result<std::vector<std::uint32_t>> read_capabilities(const MessageElement& element) {
  if (element.type != DataType::uint32_t)
    return protocol_error("CreateConnection: 'capabilities' is " + std::string(data_type_name(element.type)) +
                          ", expected uint32[]");
  std::vector<std::uint32_t> words(element.count);
  if (!words.empty()) std::memcpy(words.data(), element.data.data(), element.data.size());
  return words;
}

}  // namespace

Connection::Connection(ConnectionRole role, ConnectionOptions options, Now now)
    : role_(role),
      options_(std::move(options)),
      scanner_(message_limit()),
      opened_(now.steady),
      last_sent_(now.steady),
      last_received_(now.steady) {
  peer_.id = options_.known_peer;
  if (role_ == ConnectionRole::client) {
    // Nothing can fail here but a node name of thousands of bytes, and that would fail the handshake's deadline.
    if (auto sent = send_create_connection(now); !sent) close(sent.error());
  }
}

Error Connection::closed_by(Error reason) {
  close(reason);
  return close_reason_;
}

void Connection::close(Error reason) {
  if (state_ == ConnectionState::closed) return;
  state_ = ConnectionState::closed;
  close_reason_ = std::move(reason);
}

void Connection::authorise() {
  is_authorised_ = true;
  scanner_.set_max_message_size(message_limit());
}

void Connection::set_endpoints(std::uint32_t local, std::uint32_t remote) {
  local_endpoint_ = local;
  remote_endpoint_ = remote;
}

// --- receiving ---

void Connection::release_message() {
  has_message_ = false;
  incoming_.clear();
  scanner_.release();
}

Result<std::size_t> Connection::receive(ByteSpan input, Now now) {
  has_message_ = false;
  // Bytes are a sign of life, whole messages or not: a large one may take minutes. What ends a peer that trickles are
  // the deadlines of set-up, which count from its beginning.
  if (!input.empty()) excuse_silence(now);
  std::size_t consumed = 0;
  while (consumed < input.size() && !has_message_) {
    if (state_ == ConnectionState::closed) return close_reason_;
    const auto fed = scanner_.feed(input.subspan(consumed));
    if (!fed) return closed_by(fed.error());
    consumed += *fed;
    stats_.bytes_received += *fed;
    const auto bytes = scanner_.message();
    if (!bytes) continue;
    if (auto handled = handle_message(*bytes, now); !handled) return closed_by(handled.error());
    if (!has_message_) release_message();
  }
  return consumed;
}

Result<> Connection::handle_message(ByteSpan bytes, Now now) {
  const DecodeOptions options{.string_table = agreed_.string_table, .message_limit = message_limit()};
  if (auto done = decode(bytes, options, incoming_); !done) return done;
  ++stats_.messages_received;
  fill_header();
  if (incoming_.entries.empty()) return {};  // legal, and there is nothing to do
  if (role_ == ConnectionRole::service) state_ = ConnectionState::open;
  if (auto checked = check_sender(); !checked) return checked;
  const auto is_handled = handle_stream_entry(now);
  if (!is_handled) return is_handled.error();
  has_message_ = !*is_handled;
  return {};
}

/// Elided addresses are those of the connection.
void Connection::fill_header() {
  auto& header = incoming_.header;
  if (!header.has_routing) {
    header.sender_node_id = peer_.id;
    header.receiver_node_id = options_.self.id;
  }
  if (!header.has_endpoints) {
    header.sender_endpoint = remote_endpoint_;
    header.receiver_endpoint = local_endpoint_;
  }
}

/// Who has proved to be one node speaks for no other. In CreateConnection that is answered, not punished.
Result<> Connection::check_sender() const {
  const auto type = incoming_.entries.front().type;
  if (options_.known_peer.is_any() || incoming_.header.sender_node_id == options_.known_peer ||
      type == EntryType::stream_op || type == EntryType::stream_op_ret)
    return {};
  return make_error(ErrorCode::node_not_found, "a message of node " + format_node_id(incoming_.header.sender_node_id) +
                                                   " came from node " + format_node_id(options_.known_peer));
}

/// Returns whether the first entry is one that the stream layer answers or ignores itself.
Result<bool> Connection::handle_stream_entry(Now now) {
  const auto& entry = incoming_.entries.front();
  if (!is_stream_entry(entry.type)) return false;
  Result<> done;
  switch (entry.type) {
    case EntryType::stream_op:
      done = answer_stream_op(entry, now);
      break;
    case EntryType::stream_op_ret:
      done = handle_stream_op_reply(entry);
      break;
    case EntryType::stream_check_capability:
      done = answer_capability(entry, now);
      break;
    case EntryType::connection_test:
      done = answer_heartbeat(entry, now);
      break;
    default:
      break;
  }
  if (!done) return done.error();
  return true;
}

bool Connection::is_for_us() const {
  const auto& header = incoming_.header;
  return (header.receiver_node_id.is_any() || header.receiver_node_id == options_.self.id) &&
         (header.receiver_node_name.empty() || header.receiver_node_name == options_.self.name) &&
         (peer_.id.is_any() || header.sender_node_id == peer_.id);
}

Message Connection::begin_stream_reply(const MessageEntry& request) const {
  Message reply;
  reply.header.receiver_node_id = incoming_.header.sender_node_id;
  reply.header.receiver_node_name = incoming_.header.sender_node_name;
  reply.header.sender_endpoint = incoming_.header.receiver_endpoint;
  reply.header.receiver_endpoint = incoming_.header.sender_endpoint;
  reply.begin_entry(reply_type(request.type), request.service_path, request.member_name);
  return reply;
}

Result<> Connection::answer_stream_op(const MessageEntry& entry, Now now) {
  if (entry.member_name == create_connection) return answer_create_connection(entry, now);
  auto reply = begin_stream_reply(entry);
  if (entry.member_name == start_tls && !options_.is_encrypted)  // who can do it answers before there is a session
    write_error(reply, make_error(ErrorCode::connection_error, "Server certificate not loaded"));
  else if (entry.member_name != get_remote_node_id)
    write_error(reply, protocol_error("Invalid Stream Operation"));
  return send(reply, now);
}

Result<> Connection::answer_create_connection(const MessageEntry& entry, Now now) {
  auto reply = begin_stream_reply(entry);
  const bool is_accepted = is_for_us();
  const auto* offered = incoming_.elements_of(entry).find("capabilities");
  Features agreed = legacy_features;
  std::vector<std::uint32_t> words;
  if (!is_accepted) {
    write_error(reply, {ErrorCode::node_not_found, "Node not found"});
  } else if (offered) {
    auto read = read_capabilities(*offered);
    Result<Features> result = read ? negotiate(*read, options_.features) : Result<Features>(read.error());
    if (result) {
      agreed = *result;
      words = format_capabilities(agreed);
      reply.add("capabilities", DataType::uint32_t, static_cast<std::uint32_t>(words.size()),
                {reinterpret_cast<const std::uint8_t*>(words.data()), words.size() * sizeof(words[0])});
    } else {
      write_error(reply, protocol_error("Invalid Stream Operation"));
    }
  }
  const bool has_failed = reply.entries.front().error != ErrorCode::none;
  if (!has_failed) peer_ = {incoming_.header.sender_node_id, std::string(incoming_.header.sender_node_name)};
  // CreateConnection is always version 2, in both directions; what was agreed on holds right behind it.
  agreed_ = legacy_features;
  auto sent = send(reply, now);
  if (!has_failed) agreed_ = agreed;
  return sent;
}

Result<> Connection::send_create_connection(Now now) {
  Message request;
  request.header.receiver_node_id = options_.target.id;
  request.header.receiver_node_name = options_.target.name;
  request.begin_entry(EntryType::stream_op, {}, create_connection);
  const auto words = format_capabilities(options_.features);
  request.add("capabilities", DataType::uint32_t, static_cast<std::uint32_t>(words.size()),
              {reinterpret_cast<const std::uint8_t*>(words.data()), words.size() * sizeof(words[0])});
  return send(request, now);
}

Result<> Connection::handle_stream_op_reply(const MessageEntry& entry) {
  if (role_ != ConnectionRole::client || state_ != ConnectionState::handshaking ||
      entry.member_name != create_connection)
    return {};  // late or not asked for
  const auto& header = incoming_.header;
  // A service from before capabilities answers with ProtocolError: go on with version 2.
  if (entry.error != ErrorCode::none && entry.error != ErrorCode::protocol_error) {
    auto error = read_error(incoming_, entry, TypeRegistry{});
    error.message = "the node refused the connection: " + error.message;
    return error;
  }
  auto target = options_.target;
  if (!options_.known_peer.is_any()) target = {options_.known_peer, {}};
  if ((!target.id.is_any() && header.sender_node_id != target.id) ||
      (!target.name.empty() && header.sender_node_name != target.name))
    return make_error(ErrorCode::connection_error,
                      "wrong node: found " + format_node_id(header.sender_node_id) + " " +
                          quote(header.sender_node_name) + ", expected " +
                          (target.id.is_any() ? std::string("any id") : format_node_id(target.id)) + " " +
                          quote(target.name));
  if (const auto* element = incoming_.elements_of(entry).find("capabilities");
      element && entry.error == ErrorCode::none) {
    const auto words = read_capabilities(*element);
    if (!words) return words.error();
    const auto agreed = accept_reply(*words, options_.features);
    if (!agreed) return agreed.error();
    agreed_ = *agreed;
  }
  peer_ = {header.sender_node_id, std::string(header.sender_node_name)};
  state_ = ConnectionState::open;
  return {};
}

Result<> Connection::answer_capability(const MessageEntry& entry, Now now) {
  auto reply = begin_stream_reply(entry);
  reply.add_scalar("return", DataType::uint32_t, capability_value(entry.member_name));
  return send(reply, now);
}

Result<> Connection::answer_heartbeat(const MessageEntry& entry, Now now) {
  auto reply = begin_stream_reply(entry);
  reply.entries.front().request_id = entry.request_id;
  // The reply is the one special entry that carries no addresses in version 4.
  reply.header.has_routing = false;
  reply.header.has_endpoints = false;
  return send(reply, now, true);
}

// --- sending ---

void Connection::begin_message(Message& message) {
  message.clear();
  address(message.header);
}

void Connection::address(MessageHeader& header) {
  header.sender_endpoint = local_endpoint_;
  header.receiver_endpoint = remote_endpoint_;
  header.receiver_node_id = peer_.id;
  header.receiver_node_name = peer_.name;
  header.message_id = next_message_id_++;
}

Result<> Connection::send(Message& message, Now now, bool is_urgent) {
  if (state_ == ConnectionState::closed) return close_reason_;
  complete_header(message);
  if (auto queued = queue_.push(message, encode_options(), is_urgent); !queued) return queued;
  message.clear();  // what is large in it lives as long as it waits for the stream, and no longer
  return note_sent(now);
}

Result<> Connection::send(SharedMessage& message, Now now, bool is_urgent, LentMessage* lent) {
  if (state_ == ConnectionState::closed) return close_reason_;
  address(message.message.header);
  complete_header(message.message);
  if (lent && queue_.size() == 0) {
    const auto encoded = message.lend(encode_options());
    if (!encoded) return encoded.error();
    if (*encoded) {
      *lent = {&message, (*encoded)->slices(), (*encoded)->size()};
      return note_sent(now);
    }
  }
  if (auto queued = queue_.push(message, encode_options(), is_urgent); !queued) return queued;
  return note_sent(now);
}

/// What send() fills in.
void Connection::complete_header(Message& message) const {
  auto& header = message.header;
  header.sender_node_id = options_.self.id;
  header.version = agreed_.v4 ? 4 : 2;
  const bool is_single_special = message.entries.size() == 1 && is_special(message.entries.front().type);
  if (is_single_special) {
    header.sender_node_name = options_.self.name;
  } else {
    header.receiver_node_name = {};
    // Between the two known ends of a session the addresses go without saying.
    const bool is_elided = !peer_.id.is_any() && remote_endpoint_ != 0 && header.receiver_node_id == peer_.id &&
                           header.sender_endpoint == local_endpoint_ && header.receiver_endpoint == remote_endpoint_;
    header.has_routing = header.has_endpoints = !is_elided;
  }
  if (header.version == 2) header.has_routing = header.has_endpoints = true;
}

EncodeOptions Connection::encode_options() const {
  return {.string_table = agreed_.string_table,
          .max_message_size = is_authorised_ ? message_limit() - send_headroom : message_limit()};
}

Result<> Connection::note_sent(Now now) {
  if (queue_.held() > options_.max_queued_bytes)
    return closed_by(make_error(ErrorCode::connection_error, "the peer reads too slowly: more than " +
                                                                 std::to_string(options_.max_queued_bytes) +
                                                                 " bytes wait for the stream"));
  ++stats_.messages_sent;
  last_sent_ = now.steady;
  return {};
}

void Connection::handle_transmitted(std::size_t bytes, Now now) {
  stats_.bytes_sent += bytes;
  queue_.consume(bytes);
  if (!heartbeat_sent_ || bytes == 0 || ahead_of_heartbeat_ == 0) return;
  // The heartbeat is on its way as long as the stream takes what lies before it; the peer's time begins behind that.
  ahead_of_heartbeat_ -= std::min(bytes, ahead_of_heartbeat_);
  heartbeat_sent_ = now.steady;
}

bool Connection::handle_lent(const LentMessage& lent, std::size_t bytes, Now now) {
  if (bytes == lent.size) {
    stats_.bytes_sent += bytes;
    return true;
  }
  (void)queue_.push(*lent.message, encode_options());  // encoded already: nothing can fail
  handle_transmitted(bytes, now);
  return false;
}

// --- time ---

Result<> Connection::send_heartbeat(Now now) {
  Message test;
  test.header.receiver_node_id = {};
  test.begin_entry(EntryType::connection_test, {}, {});
  heartbeat_sent_ = now.steady;
  auto sent = send(test, now, true);
  ahead_of_heartbeat_ = queue_.size();
  return sent;
}

void Connection::excuse_silence(Now now) {
  last_received_ = now.steady;
  heartbeat_sent_.reset();
}

Result<> Connection::handle_timeout(Now now) {
  if (state_ == ConnectionState::closed) return close_reason_;
  if (state_ == ConnectionState::handshaking) {
    if (now.steady - opened_ >= options_.handshake_timeout)
      return closed_by(make_error(ErrorCode::connection_error, role_ == ConnectionRole::client
                                                                   ? "the node did not answer CreateConnection in time"
                                                                   : "the client sent no message in time"));
    return {};
  }
  if (heartbeat_sent_) {
    if (now.steady - *heartbeat_sent_ >= options_.receive_timeout)
      return closed_by(make_error(ErrorCode::connection_error, "the peer is silent: a heartbeat was not answered"));
    return {};
  }
  // Silence in either direction asks: a peer that only reads must show that it lives, too.
  if (now.steady - std::min(last_sent_, last_received_) >= options_.heartbeat_period) return send_heartbeat(now);
  return {};
}

TimePoint Connection::poll_timeout() const {
  if (state_ == ConnectionState::closed) return TimePoint::max();
  if (state_ == ConnectionState::handshaking) return opened_ + options_.handshake_timeout;
  if (heartbeat_sent_) return *heartbeat_sent_ + options_.receive_timeout;
  return std::min(last_sent_, last_received_) + options_.heartbeat_period;
}

}  // namespace rr
