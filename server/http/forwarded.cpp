#include "server/http/forwarded.hpp"

#include <algorithm>

#include "core/session/url.hpp"
#include "core/support/whole_number.hpp"
#include "core/support/words.hpp"

namespace rrgate {

using boost::asio::ip::address;

namespace {

template <class Bytes>
bool share_first_bits(const Bytes& left, const Bytes& right, unsigned bits) {
  for (std::size_t i = 0; i < left.size() && bits > 0; ++i) {
    const unsigned here = std::min(bits, 8u);
    if ((left[i] ^ right[i]) >> (8 - here)) return false;
    bits -= here;
  }
  return true;
}

/// Splits at `separator` where it is not inside a quoted string. nullopt: a quote never ends. Who has opened it hides
/// what the proxies behind him have added.
std::optional<std::vector<std::string_view>> split_quoted(std::string_view text, char separator) {
  std::vector<std::string_view> out;
  std::size_t begin = 0;
  bool is_quoted = false;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && is_quoted && text[i] == '\\') {
      ++i;
    } else if (i < text.size() && text[i] == '"') {
      is_quoted = !is_quoted;
    } else if (i >= text.size() || (!is_quoted && text[i] == separator)) {
      out.push_back(rr::trim(text.substr(begin, i - begin)));
      begin = i + 1;
    }
  }
  if (is_quoted) return std::nullopt;
  return out;
}

/// Lists of X-Forwarded-For know no quotes.
std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> out;
  for (std::size_t begin = 0; begin <= text.size();) {
    const auto end = std::min(text.find(separator, begin), text.size());
    out.push_back(rr::trim(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return out;
}

/// The last of the list that all lines of a header are; empty where there is none.
std::string_view last_value(const HttpRequest& request, std::string_view name) {
  const auto lines = request.message.equal_range(name);
  std::string_view last;
  for (auto it = lines.first; it != lines.second; ++it) last = {it->value().data(), it->value().size()};
  return rr::trim(last.substr(last.rfind(',') + 1));
}

/// "", ":80", and what RFC 7239 calls an obfuscated port: ":_x".
bool is_port(std::string_view text) {
  return text.empty() ||
         (text.size() > 1 && text.front() == ':' && std::all_of(text.begin() + 1, text.end(), [](char c) {
            return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '-' ||
                   c == '.';
          }));
}

/// "192.0.2.1", "192.0.2.1:80", "[2001:db8::1]:80", "2001:db8::1".
std::optional<address> parse_node(std::string_view text) {
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
  if (!text.empty() && text.front() == '[') {
    const auto close = text.find(']');
    if (close == std::string_view::npos || !is_port(text.substr(close + 1))) return std::nullopt;
    text = text.substr(1, close - 1);
  } else if (const auto colon = text.find(':'); colon != std::string_view::npos && text.rfind(':') == colon) {
    if (!is_port(text.substr(colon))) return std::nullopt;
    text = text.substr(0, colon);
  }
  boost::system::error_code error;
  auto out = boost::asio::ip::make_address(std::string(text), error);
  if (error) return std::nullopt;
  return plain_address(out);
}

/// What one proxy said about the request that it got. Borrowed from the request: there may be thousands.
struct Hop {
  std::optional<address> from = {};
  std::string_view proto = {};
  std::string_view host = {};
};

Hop hop_of_forwarded(std::string_view element) {
  Hop hop;
  const auto pairs = split_quoted(element, ';');
  if (!pairs) return hop;
  for (const auto pair : *pairs) {
    const auto equals = pair.find('=');
    if (equals == std::string_view::npos) continue;
    const auto name = rr::trim(pair.substr(0, equals));
    auto value = rr::trim(pair.substr(equals + 1));
    if (equals_ignoring_case(name, "for")) hop.from = parse_node(value);
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
    if (equals_ignoring_case(name, "proto")) hop.proto = value;
    if (equals_ignoring_case(name, "host")) hop.host = value;
  }
  return hop;
}

/// Line by line: what a client has sent does not reach into what a proxy has added in a line of its own. A line that is
/// no list says nothing, and nothing before it is believed.
std::vector<Hop> hops_of_forwarded(const HttpRequest& request) {
  std::vector<Hop> out;
  const auto lines = request.message.equal_range("Forwarded");
  for (auto it = lines.first; it != lines.second; ++it) {
    const auto elements = split_quoted({it->value().data(), it->value().size()}, ',');
    if (!elements) out.emplace_back();
    if (elements)
      for (const auto element : *elements) out.push_back(hop_of_forwarded(element));
  }
  return out;
}

std::vector<Hop> hops_of_x_forwarded(const HttpRequest& request) {
  std::vector<Hop> out;
  const auto proto = last_value(request, "X-Forwarded-Proto");
  const auto host = last_value(request, "X-Forwarded-Host");
  const auto lines = request.message.equal_range("X-Forwarded-For");
  for (auto it = lines.first; it != lines.second; ++it)
    for (const auto node : split({it->value().data(), it->value().size()}, ','))
      out.push_back({parse_node(node), proto, host});
  if (out.empty()) out.push_back({std::nullopt, proto, host});
  return out;
}

bool is_authority(std::string_view text) {
  return !text.empty() && text.size() <= 255 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view(".-_:[]").find(c) != std::string_view::npos;
  });
}

}  // namespace

address plain_address(const address& address) {
  if (address.is_v6() && address.to_v6().is_v4_mapped())
    return boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, address.to_v6());
  return address;
}

bool AddressRange::contains(const boost::asio::ip::address& other) const {
  const auto plain = plain_address(other);
  if (plain.is_v4() != address.is_v4()) return false;
  if (plain.is_v4()) return share_first_bits(address.to_v4().to_bytes(), plain.to_v4().to_bytes(), bits);
  return share_first_bits(address.to_v6().to_bytes(), plain.to_v6().to_bytes(), bits);
}

std::optional<AddressRange> parse_address_range(std::string_view text) {
  const auto slash = text.find('/');
  boost::system::error_code error;
  AddressRange out;
  out.address = boost::asio::ip::make_address(std::string(text.substr(0, slash)), error);
  if (error) return std::nullopt;
  const unsigned all = out.address.is_v4() ? 32 : 128;
  out.bits = all;
  if (slash == std::string_view::npos) return out;
  const auto bits = rr::whole_number<unsigned>(text.substr(slash + 1));
  if (!bits || *bits > all) return std::nullopt;
  out.bits = *bits;
  // "10.0.0.1/8" is one host to some who write it and all of a network to others.
  const auto has_more = [&](const auto& bytes) {
    for (unsigned bit = out.bits; bit < all; ++bit)
      if (bytes[bit / 8] & (0x80 >> (bit % 8))) return true;
    return false;
  };
  if (out.address.is_v4() ? has_more(out.address.to_v4().to_bytes()) : has_more(out.address.to_v6().to_bytes()))
    return std::nullopt;
  return out;
}

bool ProxyTrust::trusts(const address& address) const {
  return std::any_of(proxies.begin(), proxies.end(), [&](const auto& range) { return range.contains(address); });
}

Arrival see_through_proxies(const HttpRequest& request, const Peer& peer, const ProxyTrust& trust) {
  Arrival out;
  out.address = plain_address(peer.endpoint.address());
  out.peer = rr::format_host_port(out.address.to_string(), peer.endpoint.port());
  out.is_encrypted = peer.is_encrypted;
  out.host = request.header(http::field::host);
  if (!trust.trusts(out.address)) return out;

  const bool is_standard = trust.headers == ForwardedBy::forwarded;
  const auto hops = is_standard ? hops_of_forwarded(request) : hops_of_x_forwarded(request);
  // From the nearest proxy outwards, as far as each that speaks is trusted.
  for (auto hop = hops.rbegin(); hop != hops.rend(); ++hop) {
    if (equals_ignoring_case(hop->proto, "https") || equals_ignoring_case(hop->proto, "wss")) out.is_encrypted = true;
    if (equals_ignoring_case(hop->proto, "http") || equals_ignoring_case(hop->proto, "ws")) out.is_encrypted = false;
    if (is_authority(hop->host)) out.host = hop->host;
    if (!hop->from) break;
    out.address = *hop->from;
    out.peer = out.address.to_string();
    if (!trust.trusts(out.address)) break;
  }
  auto prefix = last_value(request, "X-Forwarded-Prefix");
  while (prefix.ends_with('/')) prefix.remove_suffix(1);
  if (is_path_prefix(prefix)) out.prefix = prefix;
  return out;
}

bool is_path_prefix(std::string_view text) {
  if (text.empty()) return true;
  if (text.front() != '/' || text.back() == '/' || text.size() > 255 || text.find("//") != std::string_view::npos ||
      text.find("/.") != std::string_view::npos)
    return false;
  return std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("/._~-").find(c) != std::string_view::npos;
  });
}

void take_base_path(HttpRequest& request, std::string_view base_path) {
  const auto path = request.path();
  if (base_path.empty() || path.substr(0, base_path.size()) != base_path || path.size() == base_path.size() ||
      path[base_path.size()] != '/')
    return;
  const auto target = request.message.target();
  const std::string rest(target.data() + base_path.size(), target.size() - base_path.size());
  request.message.target(rest);
  request.arrival.prefix += base_path;
}

}  // namespace rrgate
