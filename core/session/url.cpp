#include "core/session/url.hpp"

#include <algorithm>

#include "core/support/hex.hpp"

namespace rr {

namespace {

Error bad_url(std::string_view text, std::string what) {
  return make_error(ErrorCode::connection_error, "URL " + quote(text, 200) + ": " + std::move(what));
}

Error bad_value(std::string_view text, std::string what) {
  return make_error(ErrorCode::invalid_argument, "URL " + quote(text, 200) + ": " + std::move(what));
}

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

std::optional<std::uint16_t> parse_port(std::string_view digits, std::uint32_t smallest) {
  if (digits.empty() || digits.size() > 5) return std::nullopt;
  std::uint32_t value = 0;
  for (const char digit : digits) {
    if (digit < '0' || digit > '9') return std::nullopt;
    value = value * 10 + static_cast<std::uint32_t>(digit - '0');
  }
  if (value < smallest || value > 65535) return std::nullopt;
  return static_cast<std::uint16_t>(value);
}

struct Authority {
  std::string host;
  std::string_view port;  ///< as written
  bool has_port = false;
};

/// host [":" port] as far as the text goes. "%25" before an IPv6 zone is the URI spelling of the raw "%".
Result<Authority> parse_authority(std::string_view text, std::string_view whole) {
  Authority out;
  std::string_view rest;
  if (!text.empty() && text.front() == '[') {
    const auto close = text.find(']');
    if (close == std::string_view::npos) return bad_url(whole, "the IPv6 address has no closing ']'");
    const auto inside = text.substr(1, close - 1);
    const auto percent = inside.find('%');
    const auto address = inside.substr(0, percent);
    const auto is_address_char = [](char c) { return hex_value(c) >= 0 || c == ':' || c == '.'; };
    if (address.empty() || !std::all_of(address.begin(), address.end(), is_address_char))
      return bad_url(whole, "IPv6 address " + quote(inside) + ": expected hex digits and ':'");
    out.host = std::string(address);
    if (percent != std::string_view::npos) {
      auto zone = inside.substr(percent + 1);
      if (zone.size() > 2 && zone.substr(0, 2) == "25") zone.remove_prefix(2);
      const auto is_zone_char = [](char c) { return is_word(c) || c == '-' || c == '.'; };
      if (zone.empty() || !std::all_of(zone.begin(), zone.end(), is_zone_char))
        return bad_url(whole, "IPv6 zone " + quote(zone) + ": expected an interface name or number");
      out.host += '%';
      out.host += zone;
    }
    rest = text.substr(close + 1);
  } else {
    const auto colon = text.find(':');
    out.host = std::string(text.substr(0, colon));
    rest = colon == std::string_view::npos ? std::string_view() : text.substr(colon);
    if (out.host.find_first_of("[]") != std::string::npos)
      return bad_url(whole, "host " + quote(out.host) + ": an IPv6 address stands in brackets, [::1]");
  }
  if (rest.empty()) return out;
  if (rest.front() != ':') return bad_url(whole, quote(rest) + " after the host: expected ':' and a port");
  out.has_port = true;
  out.port = rest.substr(1);
  return out;
}

Result<void> read_query(std::string_view text, ServiceInUrl rule, ConnectionUrl& url) {
  bool has_service = false;
  bool has_node_id = false;
  bool has_node_name = false;
  std::string_view rest = url.query;
  while (!rest.empty() || (!url.query.empty() && url.query.back() == '&')) {
    const auto end = rest.find('&');
    const auto part = rest.substr(0, end);
    const auto equals = part.find('=');
    if (equals == std::string_view::npos || part.find('=', equals + 1) != std::string_view::npos)
      return bad_url(text, "query part " + quote(part) + ": expected name=value");
    const auto name = part.substr(0, equals);
    const auto raw = part.substr(equals + 1);
    if (name == "service" || name == "nodeid" || name == "nodename") {
      auto value = percent_decode(raw);
      if (!value) return bad_value(text, std::string(name) + ": " + value.error().message);
      if (name == "service" && !has_service) {
        has_service = true;
        url.service = *value;
      } else if (name == "nodeid" && !has_node_id) {
        has_node_id = true;
        auto id = parse_node_id(*value);
        if (!id) return bad_value(text, id.error().message);
        url.node_id = *id;
      } else if (name == "nodename" && !has_node_name) {
        has_node_name = true;
        if (!is_valid_node_name(*value))
          return bad_value(text,
                           "nodename " + quote(*value) + ": expected a letter, then letters, digits, '_', '.', '-'");
        url.node_name = *value;
      }
    }
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  if (rule == ServiceInUrl::required && !has_service) return bad_url(text, "no service; expected ?service=NAME");
  return {};
}

/// tcp://host:port/<{nodeid}|nodename>/service
Result<ConnectionUrl> parse_legacy(std::string_view text, std::string_view rest) {
  const auto slash = rest.find('/');
  if (slash == std::string_view::npos || rest.find('?') != std::string_view::npos)
    return bad_url(text, "expected tcp://host:port/node/service without a query; the current form is rr+tcp://...");
  auto authority = parse_authority(rest.substr(0, slash), text);
  if (!authority) return authority.error();
  const auto port = parse_port(authority->port, 1);
  if (authority->host.empty() || !port) return bad_url(text, "expected a host and a port from 1 to 65535");
  auto path = rest.substr(slash + 1);
  if (!path.empty() && path.back() == '/') path.remove_suffix(1);
  const auto separator = path.find('/');
  if (separator == std::string_view::npos || separator == 0 || separator + 1 == path.size() ||
      path.find('/', separator + 1) != std::string_view::npos)
    return bad_url(text, "path " + quote(path) + ": expected node/service");
  ConnectionUrl url;
  url.scheme = "rr+tcp";
  url.path = "/";
  url.host = authority->host;
  url.port = *port;
  const auto node = path.substr(0, separator);
  if (node.find_first_of("{[") != std::string_view::npos) {
    auto id = parse_node_id(node);
    if (!id) return bad_value(text, id.error().message);
    url.node_id = *id;
    url.query = "nodeid=" + format_node_id(*id, NodeIdFormat::dashes) + "&";
  } else {
    if (!is_valid_node_name(node)) return bad_value(text, "node name " + quote(node) + " is not valid");
    url.node_name = std::string(node);
    url.query = "nodename=" + url.node_name + "&";
  }
  url.service = std::string(path.substr(separator + 1));
  url.query += "service=" + percent_encode(url.service);
  return url;
}

std::string known_schemes() {
  std::string out;
  for (const auto& scheme : url_schemes()) {
    if (!out.empty()) out += ", ";
    out += scheme.name;
  }
  return out;
}

}  // namespace

const std::vector<UrlScheme>& url_schemes() {
  static const std::vector<UrlScheme> schemes = {
      {.name = "rr+tcp", .default_port = 48653, .needs_host = true},
      {.name = "rrs+tcp", .default_port = 48653, .needs_host = true, .is_secure = true},
      {.name = "rr+ws", .default_port = 80, .needs_host = true, .passes_path = true},
      {.name = "rrs+ws", .default_port = 80, .needs_host = true, .passes_path = true, .is_secure = true},
      {.name = "rr+wss", .default_port = 443, .needs_host = true, .passes_path = true},
      {.name = "rrs+wss", .default_port = 443, .needs_host = true, .passes_path = true, .is_secure = true},
      {.name = "rr+local"},
      {.name = "rr+intra"},
      {.name = "rr+usb"},
      {.name = "rr+pci"},
      {.name = "rr+industrial"},
      {.name = "rr+bluetooth"},
      {.name = "tcp", .default_port = 48653, .needs_host = true},
  };
  return schemes;
}

const UrlScheme* find_url_scheme(std::string_view name) {
  for (const auto& scheme : url_schemes())
    if (scheme.name == name) return &scheme;
  return nullptr;
}

bool has_node_tls(const ConnectionUrl& url) {
  const auto* scheme = find_url_scheme(url.scheme);
  return scheme && scheme->is_secure;
}

bool has_https(const ConnectionUrl& url) {
  return url.scheme.ends_with("+wss");
}

Result<ConnectionUrl> parse_url(std::string_view text, ServiceInUrl rule) {
  if (text.size() > 4096) return bad_url(text.substr(0, 60), "longer than 4096 characters");
  for (const char c : text)
    if (static_cast<unsigned char>(c) <= 0x20 || c == 0x7f) return bad_url(text, "white space or a control character");
  const auto separator = text.find("://");
  if (separator == std::string_view::npos) return bad_url(text, "expected scheme://host:port/?service=NAME");
  const auto* scheme = find_url_scheme(text.substr(0, separator));
  if (!scheme)
    return bad_url(text, "scheme " + quote(text.substr(0, separator)) + " unknown; known: " + known_schemes());
  auto rest = text.substr(separator + 3);
  if (scheme->name == "tcp") return parse_legacy(text, rest);

  ConnectionUrl url;
  url.scheme = std::string(scheme->name);
  const auto question = rest.find('?');
  if (question != std::string_view::npos) url.query = std::string(rest.substr(question + 1));
  const auto location = rest.substr(0, question);
  const auto slash = location.find('/');
  auto authority = parse_authority(location.substr(0, slash), text);
  if (!authority) return authority.error();
  if (slash != std::string_view::npos) url.path = std::string(location.substr(slash));
  // "rr+local:////?..." is refused by the reference; so is any path where none is passed on.
  if (!scheme->passes_path && url.path.size() > 1)
    return bad_url(text, "path " + quote(url.path) + ": " + url.scheme + " takes no path");

  if (scheme->needs_host) {
    if (authority->host.empty()) return bad_url(text, "no host; expected " + url.scheme + "://host:port/");
    url.host = authority->host;
    url.port = scheme->default_port;
    if (authority->has_port) {
      const auto port = parse_port(authority->port, 1);
      if (!port) return bad_url(text, "port " + quote(authority->port) + ": expected 1 to 65535");
      url.port = *port;
    }
  } else {
    if (authority->has_port) return bad_url(text, url.scheme + " takes no port");
    auto host = authority->host;
    const auto at = host.find('@');
    if (url.scheme == "rr+local" && at != std::string::npos) {
      url.user = host.substr(0, at);
      host = host.substr(at + 1);
      const auto is_user_char = [](char c) { return is_word(c) || c == '-'; };
      const bool begins_well = !url.user.empty() && is_word(url.user.front()) && url.user.front() != '_' &&
                               !(url.user.front() >= '0' && url.user.front() <= '9');
      if (!begins_well || !std::all_of(url.user.begin(), url.user.end(), is_user_char))
        return bad_url(text, "user " + quote(url.user) + ": expected a letter, then letters, digits, '_', '-'");
      if (host != "localhost") return bad_url(text, "host " + quote(host) + ": a user goes with localhost only");
    }
    const bool is_allowed = host.empty() || (host == "localhost" && url.scheme != "rr+intra");
    if (!is_allowed) return bad_url(text, "host " + quote(host) + ": " + url.scheme + " names a node, not a host");
    url.host = host;
  }

  if (auto read = read_query(text, rule, url); !read) return read.error();
  if (!scheme->needs_host && !url.node_id && url.node_name.empty())
    return bad_url(text, url.scheme + " needs nodeid or nodename in its query");
  return url;
}

std::string format_url(const ConnectionUrl& url) {
  const auto* scheme = find_url_scheme(url.scheme);
  std::string out = url.scheme + "://";
  if (!url.user.empty()) out += url.user + "@";
  if (!url.host.empty()) {
    const bool writes_port = scheme && scheme->default_port != 0 && url.port != scheme->default_port;
    out += url.host.find(':') != std::string::npos ? "[" + url.host + "]" : url.host;
    if (writes_port) out += ":" + std::to_string(url.port);
  }
  out += url.path.empty() ? "/" : url.path;
  if (!url.query.empty()) out += "?" + url.query;
  return out;
}

std::string_view without_zone(std::string_view host) {
  return host.substr(0, host.find('%'));
}

std::string format_host_port(std::string_view host, std::uint16_t port) {
  const bool is_v6 = host.find(':') != std::string_view::npos;
  return (is_v6 ? "[" + std::string(host) + "]" : std::string(host)) + ":" + std::to_string(port);
}

Result<HostPort> parse_host_port(std::string_view text) {
  const auto fail = [text](const std::string& why) {
    return make_error(ErrorCode::invalid_argument,
                      "address " + quote(text) + ": " + why + "; expected \"host:port\" or \"[IPv6]:port\"");
  };
  auto authority = parse_authority(text, text);
  if (!authority) return fail("not understood");
  if (authority->host.empty()) return fail("no host");
  if (!authority->has_port) return fail("no port");
  const auto port = parse_port(authority->port, 0);
  if (!port) return fail("port " + quote(authority->port) + " is not 0 to 65535");
  return HostPort{authority->host, *port};
}

std::optional<std::string> query_value(std::string_view query, std::string_view name) {
  while (!query.empty()) {
    const auto end = query.find('&');
    const auto part = query.substr(0, end);
    const auto equals = part.find('=');
    if (equals != std::string_view::npos && part.substr(0, equals) == name) {
      const auto raw = part.substr(equals + 1);
      auto value = percent_decode(raw);
      return value ? *value : std::string(raw);
    }
    if (end == std::string_view::npos) break;
    query.remove_prefix(end + 1);
  }
  return std::nullopt;
}

Result<std::string> percent_decode(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    const int byte = hex_byte(text.substr(i + 1));
    if (byte < 0)
      return make_error(ErrorCode::invalid_argument,
                        "escape in " + quote(text) + ": expected two hex digits after '%'");
    out += static_cast<char>(byte);
    i += 2;
  }
  return out;
}

std::string percent_encode(std::string_view text) {
  return escape_bytes(text, upper_hex_digits, [](char c) { return is_word(c) || c == '-' || c == '.' || c == '~'; });
}

}  // namespace rr
