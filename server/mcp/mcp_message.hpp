// One message of the Model Context Protocol, as an agent sends it: read, and refused. Layer: server/mcp.
// Source: revisions 2025-06-18 to 2026-07-28 of the protocol, sections "Base protocol" and "Transports"; JSON-RPC 2.0.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "server/http/request.hpp"
#include "server/json/json.hpp"

namespace rrgate {

/// Revisions that begin with "initialize", oldest first.
inline constexpr std::array<std::string_view, 2> handshake_revisions{"2025-06-18", "2025-11-25"};
/// The one of which each request stands by itself.
inline constexpr std::string_view newest_revision = "2026-07-28";

bool is_handshake_revision(std::string_view revision);
rr::OrderedJson known_revisions();

enum McpErrorCode : int {
  mcp_parse_error = -32700,
  mcp_invalid_request = -32600,
  mcp_method_not_found = -32601,
  mcp_invalid_params = -32602,
  mcp_internal_error = -32603,
  mcp_resource_not_found = -32002,
  mcp_header_mismatch = -32020,
  mcp_unsupported_version = -32022,
};

/// Of what an agent says, for people who look at a list of it.
inline constexpr std::size_t longest_shown = 200;

/// Why a message is not answered with a result.
struct McpRefusal {
  int code;
  std::string message;
  unsigned status = 200;
  rr::OrderedJson data = nullptr;
};

struct McpMessage {
  rr::OrderedJson id = nullptr;  ///< null: a notification, or a response; neither is answered
  std::string method = {};
  rr::Json params = rr::Json::object();
  bool is_modern = false;  ///< of the revision without "initialize"

  /// A parameter; empty where it is not there. Throws   McpRefusal.
  std::string text(const char* key) const;
};

/// Throws   McpRefusal.
McpMessage read_message(const Request& request);
/// Which revision is spoken; it stands in a header, and since the newest in each message too. Throws   McpRefusal.
void take_revision(McpMessage& message, const Request& request);
/// What an agent calls itself: at the handshake, or in each message. Empty: it does not say.
std::string program_of(const McpMessage& message);
/// What the client calls a request of which it wants to know how far it is; null where it does not. Throws McpRefusal.
rr::OrderedJson progress_token(const McpMessage& message);

}  // namespace rrgate
