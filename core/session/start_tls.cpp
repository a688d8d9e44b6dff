#include "core/session/start_tls.hpp"

#include "core/member/error_entry.hpp"
#include "core/wire/codec.hpp"

namespace rr {

namespace {

constexpr std::string_view start_tls = "STARTTLS";
constexpr std::string_view get_remote_node_id = "GetRemoteNodeID";
constexpr std::string_view mutual_auth = "mutualauth";
constexpr std::string_view name_prefix = "Robot Raconteur Node ";

Bytes encode_small(const Message& message) {
  EncodedMessage encoded;
  if (!encode(message, {}, encoded)) return {};  // a node name of thousands of bytes; the peer hears nothing then
  return encoded.to_bytes();
}

/// Addresses `reply` to the sender of `request` and begins its entry.
void begin_reply(Message& reply, const Message& request, const NodeIdentity& self) {
  const auto& asked = request.entries.front();
  reply.header.version = request.header.version;
  reply.header.sender_node_id = self.id;
  reply.header.sender_node_name = self.name;
  reply.header.receiver_node_id = request.header.sender_node_id;
  reply.header.receiver_node_name = request.header.sender_node_name;
  reply.header.sender_endpoint = request.header.receiver_endpoint;
  reply.header.receiver_endpoint = request.header.sender_endpoint;
  reply.begin_entry(reply_type(asked.type), asked.service_path, asked.member_name, asked.request_id);
}

bool is_for(const MessageHeader& header, const NodeIdentity& self) {
  return (header.receiver_node_id.is_any() || header.receiver_node_id == self.id) &&
         (header.receiver_node_name.empty() || header.receiver_node_name == self.name);
}

bool says_true(const Message& message, const MessageEntry& entry) {
  const auto* element = message.elements_of(entry).find(mutual_auth);
  return element && element->type == DataType::string_t && element->text() == "true";
}

std::string describe(const NodeIdentity& node) {
  return (node.id.is_any() ? std::string("any id") : format_node_id(node.id)) + " " + rr::quote(node.name);
}

}  // namespace

Bytes make_start_tls(const NodeIdentity& target, bool has_certificate) {
  Message message;
  message.header.version = 2;
  message.header.receiver_node_id = target.id;
  if (target.id.is_any()) message.header.receiver_node_name = target.name;
  message.begin_entry(EntryType::stream_op, {}, start_tls);
  if (has_certificate) message.add_text(mutual_auth, "true");
  return encode_small(message);
}

Result<StartTlsReply> read_start_tls_reply(ByteSpan bytes, const NodeIdentity& target) {
  Message message;
  if (auto done = decode(bytes, {}, message); !done) return done.error();
  if (message.entries.size() != 1 || message.entries[0].type != EntryType::stream_op_ret ||
      message.entries[0].member_name != start_tls)
    return protocol_error("STARTTLS: the node answered something else");
  const auto& entry = message.entries[0];
  if (entry.error != ErrorCode::none) {
    auto error = read_error(message, entry, TypeRegistry{});
    error.message = "STARTTLS: the node refused: " + error.message;
    return error;
  }
  const auto& header = message.header;
  const bool is_target = target.id.is_any() ? target.name.empty() || header.sender_node_name == target.name
                                            : header.sender_node_id == target.id;
  if (!is_target)
    return make_error(ErrorCode::connection_error,
                      "STARTTLS: wrong node: found " +
                          describe({header.sender_node_id, std::string(header.sender_node_name)}) + ", expected " +
                          describe(target));
  if (header.sender_node_id.is_any())
    return protocol_error("STARTTLS: the node did not tell its id, so no certificate can prove it");
  return StartTlsReply{header.sender_node_id};
}

Result<FirstRequest> answer_first_request(ByteSpan bytes, const NodeIdentity& self, bool can_start_tls) {
  Message message;
  if (auto done = decode(bytes, {}, message); !done) return done.error();
  FirstRequest out;
  if (message.entries.size() != 1 || message.entries[0].type != EntryType::stream_op) return out;
  const auto& entry = message.entries[0];
  if (entry.member_name == get_remote_node_id)
    out.kind = FirstRequest::Kind::get_remote_node_id;
  else if (entry.member_name == start_tls)
    out.kind = FirstRequest::Kind::start_tls;
  else
    return out;

  Message reply;
  begin_reply(reply, message, self);
  reply.entries.front().request_id = 0;
  if (out.kind == FirstRequest::Kind::start_tls) {
    out.client = {message.header.sender_node_id, std::string(message.header.sender_node_name)};
    out.has_certificate = says_true(message, entry);
    if (!can_start_tls)
      out.refusal = make_error(ErrorCode::connection_error, "Server certificate not loaded");
    else if (!is_for(message.header, self))
      out.refusal = make_error(ErrorCode::node_not_found, "Node not found");
    if (out.refusal)
      write_error(reply, *out.refusal);
    else if (out.has_certificate)
      reply.add_text(mutual_auth, "true");
  }
  out.reply = encode_small(reply);
  return out;
}

Bytes refuse_first_request(ByteSpan bytes, const NodeIdentity& self, const Error& error) {
  Message message;
  if (!decode(bytes, {}, message) || message.entries.empty()) return {};
  Message reply;
  begin_reply(reply, message, self);
  write_error(reply, error);
  return encode_small(reply);
}

std::string format_certificate_name(const NodeId& id) {
  return std::string(name_prefix) + format_node_id(id);
}

Result<NodeId> parse_certificate_name(std::string_view common_name) {
  const auto fail = [&](const char* expected) {
    return make_error(ErrorCode::authentication_error,
                      "the certificate is of " + quote(common_name, 100) + ", expected " + expected);
  };
  if (common_name.substr(0, name_prefix.size()) != name_prefix) return fail("\"Robot Raconteur Node {id}\"");
  const auto id = parse_node_id(common_name.substr(name_prefix.size()));
  if (!id || id->is_any() || format_certificate_name(*id) != common_name)
    return fail("\"Robot Raconteur Node {id}\" with a node id in lower case");
  return *id;
}

}  // namespace rr
