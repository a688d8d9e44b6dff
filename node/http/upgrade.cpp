#include "node/http/upgrade.hpp"

#include <algorithm>

#include "core/support/error.hpp"

namespace rrgate {

bool asks_for_websocket(const HttpRequest& request) {
  const auto has = [&request](http::field name, std::string_view token) {
    const auto lines = request.message.equal_range(name);
    return std::any_of(lines.first, lines.second, [&](const auto& line) {
      return has_token({line.value().data(), line.value().size()}, token);
    });
  };
  return has(http::field::upgrade, "websocket") && has(http::field::connection, "upgrade");
}

Response upgrade_required(std::string_view detail, std::string_view subprotocol) {
  auto response = problem_response(426, detail);
  response.set("Upgrade", "websocket");
  response.set("Sec-WebSocket-Protocol", std::string(subprotocol));
  response.set("Sec-WebSocket-Version", "13");
  response.closes = true;
  return response;
}

std::optional<Response> refuse_upgrade(const HttpRequest& request, std::string_view subprotocol) {
  const auto& message = request.message;
  if (message.method() != http::verb::get) {
    auto response = problem_response(405, "a WebSocket begins with GET");
    response.set("Allow", "GET");
    return response;
  }
  if (message.version() != 11) return upgrade_required("a WebSocket needs HTTP/1.1", subprotocol);
  if (request.header(http::field::sec_websocket_key).empty())
    return upgrade_required("no Sec-WebSocket-Key in the request", subprotocol);
  if (!has_token(request.header(http::field::sec_websocket_version), "13"))
    return upgrade_required(
        "Sec-WebSocket-Version " + rr::quote(request.header(http::field::sec_websocket_version)) + ": expected 13",
        subprotocol);
  // A header may be repeated; then any of its lines will do.
  bool has_protocol = false;
  bool has_ours = false;
  const auto lines = message.equal_range(http::field::sec_websocket_protocol);
  for (auto it = lines.first; it != lines.second; ++it) {
    has_protocol = true;
    has_ours = has_ours || has_token({it->value().data(), it->value().size()}, subprotocol);
  }
  if (has_protocol && !has_ours)
    return upgrade_required("subprotocol " + rr::quote(request.header(http::field::sec_websocket_protocol)) +
                                ": expected " + std::string(subprotocol),
                            subprotocol);
  return std::nullopt;
}

std::string format_upgrade_response(const HttpRequest& request, std::string_view subprotocol) {
  std::string out =
      "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: " +
      rr::websocket_accept(request.header(http::field::sec_websocket_key)) + "\r\n";
  // A browser gives a socket up whose answer has a subprotocol that it has not named.
  if (subprotocol == rr::websocket_subprotocol || request.message.count(http::field::sec_websocket_protocol) != 0)
    out += "Sec-WebSocket-Protocol: " + std::string(subprotocol) + "\r\n";
  return out + "Sec-WebSocket-Version: 13\r\n\r\n";
}

bool takes_close_frames(const HttpRequest& request) {
  return request.message.count(http::field::origin) != 0 ||
         request.message.count(http::field::sec_websocket_extensions) != 0;
}

}  // namespace rrgate
