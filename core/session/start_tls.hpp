// What is said in clear before a stream becomes TLS, and what the name in a node's certificate says. Layer: session.
// Source: transports spec sections 5.1, 5.3.
//
// The client sends STARTTLS, the service answers, and right behind the last byte of the answer TLS begins. Nothing else
// may be in flight, so whoever carries these messages reads them exact to the byte.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/session/connection.hpp"

namespace rr {

/// The STARTTLS message of a client. `target`: the node that is meant; by its id where that is given, else by its name.
Bytes make_start_tls(const NodeIdentity& target, bool has_certificate);

struct StartTlsReply {
  NodeId peer;  ///< the node that the certificate must be of
};
/// Errors   connection_error: the peer is another node than `target`, or has no certificate ("Server certificate not
///          loaded"), and whatever else it says; protocol_error: not the answer to STARTTLS.
[[nodiscard]] Result<StartTlsReply> read_start_tls_reply(ByteSpan message, const NodeIdentity& target);

/// What a service is asked first, as far as it concerns TLS.
struct FirstRequest {
  enum class Kind : std::uint8_t {
    start_tls,
    get_remote_node_id,  ///< an answer, and another first request follows
    other,               ///< for the session
  };
  Kind kind = Kind::other;
  NodeIdentity client;           ///< as it says; any and "" from the reference
  bool has_certificate = false;  ///< start_tls: it will show one when asked
  Bytes reply;                   ///< for the first two kinds
  std::optional<Error> refusal;  ///< start_tls: what `reply` refuses it with
};
/// `can_start_tls`: this node has a certificate.
/// Errors   those of decode().
[[nodiscard]] Result<FirstRequest> answer_first_request(ByteSpan message, const NodeIdentity& self, bool can_start_tls);

/// An error reply to `message`, for a client that may not go on without TLS. Empty where nothing can be answered.
Bytes refuse_first_request(ByteSpan message, const NodeIdentity& self, const Error& error);

/// "Robot Raconteur Node {id}": the whole subject of a node's certificate.
std::string format_certificate_name(const NodeId& id);
/// Exactly as format_certificate_name() writes it, lower case included; not any.
/// Errors   authentication_error.
[[nodiscard]] Result<NodeId> parse_certificate_name(std::string_view common_name);

}  // namespace rr
