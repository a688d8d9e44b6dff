#include "server/front/proxy_protocol.hpp"

#include <algorithm>
#include <string_view>

#include "core/support/whole_number.hpp"

namespace rrgate {

namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

constexpr std::string_view text_start = "PROXY ";
constexpr std::string_view binary_start("\r\n\r\n\0\r\nQUIT\n", 12);
constexpr std::size_t longest_line = 107;

rr::Error broken(std::string_view what) {
  return rr::make_error(rr::ErrorCode::protocol_error, "PROXY header: " + std::string(what));
}

std::string_view next_word(std::string_view& text) {
  const auto space = text.find(' ');
  const auto word = text.substr(0, space);
  text.remove_prefix(space == std::string_view::npos ? text.size() : space + 1);
  return word;
}

rr::Result<ProxyHeader> parse_line(std::string_view text) {
  const auto end = text.substr(0, longest_line).find("\r\n");
  if (end == std::string_view::npos) {
    if (text.size() >= longest_line) return broken("no end of line within 107 bytes");
    return ProxyHeader{};
  }
  ProxyHeader out{end + 2, std::nullopt};
  auto rest = text.substr(text_start.size(), end - text_start.size());
  const auto family = next_word(rest);
  if (family == "UNKNOWN") return out;
  if (family != "TCP4" && family != "TCP6")
    return broken("found " + rr::quote(family) + ", expected TCP4, TCP6 or UNKNOWN");
  boost::system::error_code error;
  const auto source = asio::ip::make_address(std::string(next_word(rest)), error);
  if (error || source.is_v4() != (family == "TCP4")) return broken("its source is no address of its family");
  next_word(rest);  // where to
  const auto digits = next_word(rest);
  const auto port = rr::whole_number<std::uint16_t>(digits);
  if (!port) return broken("found port " + rr::quote(digits));
  out.client = tcp::endpoint(source, *port);
  return out;
}

rr::Result<ProxyHeader> parse_block(rr::ByteSpan bytes) {
  if (bytes.size() < 16) return ProxyHeader{};
  const auto version = bytes[12] >> 4;
  const auto command = bytes[12] & 0x0f;
  const auto family = bytes[13];
  const std::size_t length = static_cast<std::size_t>(bytes[14]) << 8 | bytes[15];
  if (version != 2 || command > 1) return broken("found version and command " + std::to_string(bytes[12]));
  if (16 + length > largest_proxy_header) return broken(std::to_string(length) + " bytes long");
  if (bytes.size() < 16 + length) return ProxyHeader{};
  ProxyHeader out{16 + length, std::nullopt};
  const auto body = bytes.subspan(16, length);
  const auto port_at = [&](std::size_t at) { return static_cast<std::uint16_t>(body[at] << 8 | body[at + 1]); };
  if (command == 0) return out;  // LOCAL: of the proxy itself
  if (family == 0x11) {
    if (length < 12) return broken("too short for addresses of IPv4");
    asio::ip::address_v4::bytes_type address;
    std::copy_n(body.begin(), address.size(), address.begin());
    out.client = tcp::endpoint(asio::ip::address_v4(address), port_at(8));
  } else if (family == 0x21) {
    if (length < 36) return broken("too short for addresses of IPv6");
    asio::ip::address_v6::bytes_type address;
    std::copy_n(body.begin(), address.size(), address.begin());
    out.client = tcp::endpoint(asio::ip::address_v6(address), port_at(32));
  }
  return out;
}

}  // namespace

rr::Result<ProxyHeader> parse_proxy_header(rr::ByteSpan bytes) {
  const auto text = rr::as_text(bytes);
  const auto begins = [&](std::string_view start) {
    return text.substr(0, start.size()) == start.substr(0, text.size());
  };
  if (begins(binary_start)) return parse_block(bytes);
  if (!begins(text_start)) return broken("found " + rr::quote(text.substr(0, 16)));
  return text.size() < text_start.size() ? ProxyHeader{} : parse_line(text);
}

}  // namespace rrgate
