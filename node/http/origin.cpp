#include "node/http/origin.hpp"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <optional>

namespace rrgate {

namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

struct Origin {
  std::string scheme;
  std::string host;  ///< lower case, IPv6 with brackets
  std::string port;  ///< empty: the default of the scheme

  bool operator==(const Origin&) const = default;
};

/// host[:port], the port without the scheme's default. nullopt for anything else.
std::optional<Origin> parse_authority(std::string_view scheme, std::string_view text) {
  Origin out{lower(scheme), {}, {}};
  if (text.find_first_of("/?#@\\, \t") != std::string_view::npos) return std::nullopt;
  auto colon = text.rfind(':');
  if (!text.empty() && text.front() == '[') {
    const auto close = text.find(']');
    if (close == std::string_view::npos) return std::nullopt;
    if (close + 1 < text.size() && text[close + 1] != ':') return std::nullopt;
    colon = close + 1 < text.size() ? close + 1 : std::string_view::npos;
  } else if (text.find(':') != colon) {
    return std::nullopt;
  }
  out.host = lower(text.substr(0, colon));
  if (out.host.empty()) return std::nullopt;
  if (colon == std::string_view::npos) return out;
  out.port = std::string(text.substr(colon + 1));
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (out.port.empty() || out.port.size() > 5 || !std::all_of(out.port.begin(), out.port.end(), is_digit))
    return std::nullopt;
  if ((out.scheme == "http" && out.port == "80") || (out.scheme == "https" && out.port == "443")) out.port.clear();
  return out;
}

std::optional<Origin> parse_origin(std::string_view text) {
  const auto separator = text.find("://");
  if (separator == std::string_view::npos || separator == 0) return std::nullopt;
  const auto scheme = text.substr(0, separator);
  const auto is_scheme_char = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' || c == '-' ||
           c == '.';
  };
  if (!std::all_of(scheme.begin(), scheme.end(), is_scheme_char)) return std::nullopt;
  return parse_authority(scheme, text.substr(separator + 3));
}

/// Both in lower case.
bool fits_host(std::string_view pattern, std::string_view host) {
  if (!pattern.starts_with("*.")) return pattern == host;
  const auto suffix = pattern.substr(1);  // ".domain"
  return host.size() > suffix.size() && host.ends_with(suffix);
}

/// A star stands for whole names below a domain, or is not there.
bool is_star_in_place(std::string_view host) {
  const auto star = host.rfind('*');
  return star == std::string_view::npos || (star == 0 && host.size() > 2 && host[1] == '.');
}

bool is_ip_address(std::string_view host) {
  boost::system::error_code error;
  if (!host.starts_with('[')) {
    boost::asio::ip::make_address_v4(std::string(host), error);
  } else {
    boost::asio::ip::make_address_v6(std::string(host.substr(1, host.size() - 2)), error);
  }
  return !error;
}

}  // namespace

bool is_origin_pattern(std::string_view text) {
  const auto pattern = parse_origin(text);
  return pattern && is_star_in_place(pattern->host);
}

bool is_origin_listed(std::string_view origin, std::span<const std::string> patterns) {
  const auto page = parse_origin(origin);
  if (!page || page->host.find('*') != std::string::npos) return false;
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& text) {
    const auto pattern = parse_origin(text);
    return pattern && pattern->scheme == page->scheme && pattern->port == page->port &&
           fits_host(pattern->host, page->host);
  });
}

bool is_same_origin(std::string_view origin, std::string_view authority, bool is_encrypted) {
  const auto page = parse_origin(origin);
  if (!page || (page->scheme != "https" && (page->scheme != "http" || is_encrypted))) return false;
  return parse_authority(page->scheme, authority) == page;
}

bool is_host_pattern(std::string_view text) {
  const auto pattern = parse_authority({}, text);
  return pattern && pattern->port.empty() && !text.ends_with(':') && is_star_in_place(pattern->host);
}

bool is_host_listed(std::string_view authority, std::span<const std::string> patterns) {
  const auto own = parse_authority({}, authority);
  if (!own || own->host.find('*') != std::string::npos) return false;
  if (own->host == "localhost" || is_ip_address(own->host)) return true;
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& pattern) { return fits_host(lower(pattern), own->host); });
}

std::string host_name_of(std::string_view authority) {
  const auto own = parse_authority({}, authority);
  return own ? own->host : std::string();
}

}  // namespace rrgate
