#include "core/discovery/announcement.hpp"

#include <algorithm>

#include "core/session/url.hpp"
#include "core/support/random.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

constexpr std::string_view announcement_title = "Robot Raconteur Node Discovery Packet";
constexpr std::string_view request_title = "Robot Raconteur Discovery Request Packet";
constexpr std::string_view nonce_name = "ServiceStateNonce";
constexpr std::size_t max_sent_bytes = 2048;
constexpr std::size_t max_url_bytes = 256;
constexpr std::size_t max_name_bytes = 128;
constexpr std::size_t nonce_bytes_end = 32;  // a nonce is shorter

Error refused(std::string what) {
  return protocol_error("discovery packet: " + std::move(what));
}

/// Also without CR and NUL, which some senders put behind a line or the packet.
std::string_view trimmed(std::string_view text) {
  return trim(text, std::string_view(" \t\r\n\v\f\0", 7));
}

/// Takes the text up to the next LF off `rest`.
std::string_view take_line(std::string_view& rest) {
  const auto end = rest.find('\n');
  const auto line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return trimmed(line);
}

Result<void> check_title(std::string_view packet, std::string_view& rest, std::string_view title) {
  if (packet.size() > max_discovery_packet_bytes)
    return refused("found " + std::to_string(packet.size()) + " bytes, expected at most " +
                   std::to_string(max_discovery_packet_bytes));
  rest = packet;
  const auto line = take_line(rest);
  if (line != title) return refused("begins with " + quote(line) + ", expected " + quote(title));
  return {};
}

/// Whether somebody at `source` may say that a node is at `address`.
bool is_credible(const IpAddress& address, const PacketSource& source) {
  if (address.is_loopback()) return source.is_this_machine || source.address.is_loopback();
  if (address.is_v6 != source.address.is_v6) return false;
  if (address.is_v6) return address.is_link_local() || address.is_site_local();
  return std::equal(address.bytes.begin(), address.bytes.begin() + 2, source.address.bytes.begin());
}

Result<std::string> check_url(std::string_view text, const NodeId& node_id, const PacketSource& source) {
  if (text.size() > max_url_bytes) return refused("URL longer than 256 characters: " + quote(text));
  auto url = parse_url(text);
  if (!url) return refused(url.error().message);
  const auto address = parse_url_address(url->host);
  if (!address) return refused("URL " + quote(text, 200) + ": expected an IP address as its host");
  if (url->node_id != node_id)
    return refused("URL " + quote(text, 200) + ": expected nodeid=" + format_node_id(node_id, NodeIdFormat::dashes));
  if (!is_credible(*address, source))
    return refused("URL " + quote(text, 200) + ": its address does not belong to the sender's network");
  // A zone that came with the packet is the sender's name for the link, not ours.
  url->host.resize(without_zone(url->host).size());
  if (address->is_v6 && address->is_link_local() && !source.zone.empty()) url->host += "%" + source.zone;
  return format_url(*url);
}

std::string find_nonce(std::string_view rest) {
  while (!rest.empty()) {
    const auto line = take_line(rest);
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || trimmed(line.substr(0, colon)) != nonce_name) continue;
    const auto value = trimmed(line.substr(colon + 1));
    return value.size() < nonce_bytes_end ? std::string(value) : std::string();
  }
  return {};
}

}  // namespace

std::string format_announcement(const Announcement& announcement) {
  std::string out(announcement_title);
  out += "\n" + format_node_id(announcement.node_id);
  if (!announcement.node_name.empty()) out += "," + announcement.node_name;
  out += "\n" + announcement.url + "\n";
  if (!announcement.service_state_nonce.empty()) {
    const auto line = std::string(nonce_name) + ": " + announcement.service_state_nonce + "\n";
    if (out.size() + line.size() <= max_sent_bytes) out += line;
  }
  return out;
}

Result<Announcement> parse_announcement(std::string_view packet, const PacketSource& source,
                                        std::span<const NodeId> own) {
  std::string_view rest;
  if (auto titled = check_title(packet, rest, announcement_title); !titled) return titled.error();
  const auto node = take_line(rest);
  const auto url_text = take_line(rest);
  const auto comma = node.find(',');
  const auto id = parse_node_id(trimmed(node.substr(0, comma)));
  if (!id) return refused(id.error().message);
  if (id->is_any()) return refused("the node id is all zeros");
  if (std::find(own.begin(), own.end(), *id) != own.end()) return refused("from a node of our own");
  Announcement out;
  out.node_id = *id;
  const auto name = comma == std::string_view::npos ? std::string_view() : trimmed(node.substr(comma + 1));
  if (name.size() <= max_name_bytes && is_valid_node_name(name)) out.node_name = std::string(name);
  auto url = check_url(url_text, *id, source);
  if (!url) return url.error();
  out.url = std::move(*url);
  out.service_state_nonce = find_nonce(rest);
  return out;
}

std::string format_discovery_request(const NodeId& listener) {
  return std::string(request_title) + "\n" + format_node_id(listener) + "\n";
}

Result<NodeId> parse_discovery_request(std::string_view packet) {
  std::string_view rest;
  if (auto titled = check_title(packet, rest, request_title); !titled) return titled.error();
  auto id = parse_node_id(take_line(rest));
  if (!id) return refused(id.error().message);
  return *id;
}

std::string make_service_state_nonce() {
  constexpr std::string_view letters = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
  std::string out;
  for (int i = 0; i < 16; ++i) out += letters[random_u32() % letters.size()];
  return out;
}

}  // namespace rr
