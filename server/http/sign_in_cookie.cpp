#include "server/http/sign_in_cookie.hpp"

#include <algorithm>

#include "core/support/words.hpp"

namespace rrgate {

namespace {

/// "-8080"; empty where `host` names no port.
std::string port_ending(std::string_view host) {
  const auto colon = host.rfind(':');
  if (colon == std::string_view::npos || host.ends_with(']')) return {};
  const auto port = host.substr(colon + 1);
  const bool is_number = std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  return is_number && !port.empty() ? "-" + std::string(port) : std::string();
}

}  // namespace

std::string sign_in_cookie_name(const Arrival& arrival) {
  const auto* const prefix = !arrival.is_encrypted ? "" : arrival.prefix.empty() ? "__Host-" : "__Secure-";
  return prefix + std::string("rrgate") + port_ending(arrival.host);
}

std::string_view sign_in_cookie(const HttpRequest& request) {
  const auto begin = sign_in_cookie_name(request.arrival) + "=";
  const auto lines = request.message.equal_range(http::field::cookie);
  for (auto line = lines.first; line != lines.second; ++line) {
    std::string_view left(line->value().data(), line->value().size());
    while (!left.empty()) {
      const auto end = std::min(left.find(';'), left.size());
      const auto pair = rr::trim(left.substr(0, end));
      if (pair.starts_with(begin)) return pair.substr(begin.size());
      left.remove_prefix(std::min(end + 1, left.size()));
    }
  }
  return {};
}

std::string format_sign_in_cookie(const Arrival& arrival, std::string_view cookie) {
  auto out = sign_in_cookie_name(arrival) + "=" + std::string(cookie) + "; Path=" + arrival.prefix +
             "/; HttpOnly; SameSite=Strict";
  if (arrival.is_encrypted) out += "; Secure";
  if (cookie.empty()) out += "; Max-Age=0";
  return out;
}

}  // namespace rrgate
