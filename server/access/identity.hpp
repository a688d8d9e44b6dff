// Who a client is, as far as it has shown. Layer: server/access.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rrgate {

/// How somebody has shown who he is.
enum class Proof : std::uint8_t {
  none,         ///< anonymous
  password,     ///< of the users file: HTTP Basic, a login of Robot Raconteur
  token,        ///< an API token
  jwt,          ///< a JSON Web Token, by a key of the gateway's files
  certificate,  ///< of a TLS client
  proxy,        ///< a trusted proxy says so
  oidc,         ///< a JSON Web Token, by a key that its issuer publishes
};

constexpr std::string_view to_string(Proof proof) {
  constexpr std::string_view names[] = {"none", "password", "token", "jwt", "certificate", "proxy", "oidc"};
  return names[static_cast<std::size_t>(proof)];
}

/// A name and whose it is. The same name of a user, of a token and of a user of a device are three subjects.
struct Subject {
  enum class Kind : std::uint8_t { nobody, user, token, device_user };
  Kind kind = Kind::nobody;
  std::string name = {};

  bool is_nobody() const { return kind == Kind::nobody; }
  /// No other subject has it.
  std::string key() const { return std::to_string(static_cast<int>(kind)) + name; }
  bool operator==(const Subject&) const = default;
};

/// By which of the gateway's faces somebody comes.
enum class Face : std::uint8_t {
  none,       ///< the gateway itself
  native,     ///< Robot Raconteur over TCP or TLS
  websocket,  ///< Robot Raconteur over a WebSocket
  rest,       ///< requests of HTTP
  stream,     ///< event and image streams of HTTP
  json,       ///< JSON over a WebSocket
  mcp,        ///< the Model Context Protocol
};
inline constexpr std::string_view face_names[] = {"", "native", "websocket", "rest", "stream", "json", "mcp"};

constexpr std::string_view to_string(Face face) {
  return face_names[static_cast<std::size_t>(face)];
}

/// Where a client comes from.
struct ClientOrigin {
  std::string client = {};   ///< as logs name it: "192.0.2.1:40000"
  std::string network = {};  ///< as what it counts, see network_name()
  Face face = Face::none;
};

struct Identity {
  using Time = std::chrono::system_clock::time_point;
  static constexpr Time never = Time::max();

  std::string name = {};                       ///< empty: anonymous
  std::vector<std::string> roles = {};         ///< those of the proof, and what grants add
  std::vector<std::string> proven_roles = {};  ///< those of the proof alone
  Proof proof = Proof::none;
  std::string client = {};  ///< where it comes from, as logs name it: "192.0.2.1:40000"
  Face face = Face::none;
  /// As whom a device knows the client, by a login that the device has judged. It gives no right here.
  std::string device_user = {};
  /// Tells a password or a token from any other that the name has had; of a JSON Web Token, the key and the claims that
  /// it was judged by; of a certificate, its marks (rr::chain_marks). No secret can be had from it.
  std::string credential = {};
  std::string sign_in = {};  ///< which one the proof is remembered by (SignIns); empty: it was shown with the request
  Time ends = never;         ///< of the proof

  bool is_proven() const { return proof != Proof::none; }
  bool has_role(std::string_view role) const { return std::find(roles.begin(), roles.end(), role) != roles.end(); }
  /// nobody: has shown nothing.
  Subject subject() const {
    if (!is_proven()) return {};
    return {proof == Proof::token ? Subject::Kind::token : Subject::Kind::user, name};
  }
  bool operator==(const Identity&) const = default;
};

}  // namespace rrgate
