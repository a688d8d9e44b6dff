#include "node/http/origin.hpp"

#include <algorithm>
#include <optional>

#include "core/session/url.hpp"

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

bool matches(const Origin& pattern, const Origin& origin) {
  if (pattern.scheme != origin.scheme || pattern.port != origin.port) return false;
  if (pattern.host.rfind("*.", 0) != 0) return pattern.host == origin.host;
  const auto suffix = std::string_view(pattern.host).substr(1);  // ".domain"
  return origin.host.size() > suffix.size() &&
         std::string_view(origin.host).substr(origin.host.size() - suffix.size()) == suffix;
}

}  // namespace

bool is_origin_pattern(std::string_view text) {
  const auto pattern = parse_origin(text);
  if (!pattern) return false;
  const auto star = pattern->host.rfind('*');
  return star == std::string::npos || (star == 0 && pattern->host.size() > 2 && pattern->host[1] == '.');
}

bool is_origin_allowed(std::string_view origin, std::string_view host, const std::vector<std::string>& allowed) {
  const auto page = parse_origin(origin);
  if (!page || page->host.find('*') != std::string::npos) return false;
  if (page->scheme == "http" || page->scheme == "https") {
    const auto own = parse_authority(page->scheme, host);
    if (own && *own == *page) return true;
  }
  return std::any_of(allowed.begin(), allowed.end(), [&](const std::string& text) {
    const auto pattern = parse_origin(text);
    return pattern && matches(*pattern, *page);
  });
}

}  // namespace rrgate
