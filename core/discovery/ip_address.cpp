#include "core/discovery/ip_address.hpp"

#include <algorithm>
#include <vector>

#include "core/session/url.hpp"
#include "core/support/hex.hpp"

namespace rr {

namespace {

/// Four decimal numbers without leading zeros.
std::optional<std::array<std::uint8_t, 4>> parse_v4(std::string_view text) {
  std::array<std::uint8_t, 4> out{};
  for (std::size_t part = 0; part < 4; ++part) {
    const auto end = part < 3 ? text.find('.') : text.size();
    if (end == std::string_view::npos || end == 0 || end > 3) return std::nullopt;
    if (end > 1 && text.front() == '0') return std::nullopt;
    unsigned number = 0;
    for (const char digit : text.substr(0, end)) {
      if (digit < '0' || digit > '9') return std::nullopt;
      number = number * 10 + static_cast<unsigned>(digit - '0');
    }
    if (number > 255) return std::nullopt;
    out[part] = static_cast<std::uint8_t>(number);
    text.remove_prefix(part < 3 ? end + 1 : end);
  }
  return out;
}

/// Groups of up to four hex digits between colons, appended to `bytes`; the last may be an IPv4 address. Empty is none.
bool parse_groups(std::string_view text, bool may_end_in_v4, std::vector<std::uint8_t>& bytes) {
  while (!text.empty()) {
    const auto end = text.find(':');
    const auto group = text.substr(0, end);
    const bool is_last = end == std::string_view::npos;
    if (is_last && may_end_in_v4 && group.find('.') != std::string_view::npos) {
      const auto v4 = parse_v4(group);
      if (!v4) return false;
      bytes.insert(bytes.end(), v4->begin(), v4->end());
      return bytes.size() <= 16;
    }
    if (group.empty() || group.size() > 4) return false;
    unsigned number = 0;
    for (const char digit : group) {
      const int value = hex_value(digit);
      if (value < 0) return false;
      number = number * 16 + static_cast<unsigned>(value);
    }
    bytes.push_back(static_cast<std::uint8_t>(number >> 8));
    bytes.push_back(static_cast<std::uint8_t>(number));
    if (bytes.size() > 16) return false;
    if (is_last) return true;
    text.remove_prefix(end + 1);
    if (text.empty()) return false;  // a colon at the end
  }
  return true;
}

std::optional<IpAddress> parse_v6(std::string_view text) {
  const auto gap = text.find("::");
  std::vector<std::uint8_t> before;
  std::vector<std::uint8_t> after;
  if (!parse_groups(text.substr(0, gap), gap == std::string_view::npos, before)) return std::nullopt;
  if (gap != std::string_view::npos && !parse_groups(text.substr(gap + 2), true, after)) return std::nullopt;
  const auto size = before.size() + after.size();
  if (gap == std::string_view::npos ? size != 16 : size > 14) return std::nullopt;
  IpAddress out;
  out.is_v6 = true;
  std::copy(before.begin(), before.end(), out.bytes.begin());
  std::copy(after.begin(), after.end(), out.bytes.end() - static_cast<std::ptrdiff_t>(after.size()));
  return out;
}

}  // namespace

bool IpAddress::is_loopback() const {
  if (!is_v6) return bytes[0] == 127;
  return bytes[15] == 1 && std::all_of(bytes.begin(), bytes.end() - 1, [](auto byte) { return byte == 0; });
}

bool IpAddress::is_link_local() const {
  if (!is_v6) return bytes[0] == 169 && bytes[1] == 254;
  return bytes[0] == 0xfe && (bytes[1] & 0xc0) == 0x80;
}

bool IpAddress::is_site_local() const {
  return is_v6 && bytes[0] == 0xfe && (bytes[1] & 0xc0) == 0xc0;
}

std::optional<IpAddress> parse_ip_address(std::string_view text) {
  if (text.find(':') != std::string_view::npos) return parse_v6(text);
  const auto v4 = parse_v4(text);
  if (!v4) return std::nullopt;
  IpAddress out;
  std::copy(v4->begin(), v4->end(), out.bytes.begin());
  return out;
}

std::optional<IpAddress> parse_url_address(std::string_view host) {
  return parse_ip_address(without_zone(host));
}

}  // namespace rr
