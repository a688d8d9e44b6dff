// Where agents ask, and where they find out whose tokens to show there. Layer: server/state. Source: RFC 9728.
#pragma once

#include <string>
#include <string_view>

#include "server/http/request.hpp"

namespace rrgate {

inline constexpr std::string_view mcp_path = "/mcp";
inline constexpr std::string_view mcp_metadata_path = "/.well-known/oauth-protected-resource/mcp";

/// The gateway as the client of a request has it: "https://lab.example/robots". Empty: it has not told.
inline std::string origin_of(const Request& request) {
  const auto& arrival = request.arrival;
  if (arrival.host.empty()) return {};
  return (arrival.is_encrypted ? "https://" : "http://") + arrival.host + arrival.prefix;
}

}  // namespace rrgate
