// Whatever arrives at the discovery port: parsed within its rules, and the cache stays bounded and consistent.
//
// Input: packets between bytes 0xff; the first byte of each chooses its source and how much time passes.
#include <cstdlib>
#include <map>
#include <string_view>

#include "core/discovery/detected_nodes.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

constexpr rr::DetectedNodesOptions options{std::chrono::seconds(60), 4, 3};

rr::PacketSource source_of(std::uint8_t choice) {
  constexpr std::string_view addresses[] = {"fe80::1", "192.168.1.5", "127.0.0.1", "::1"};
  return {*rr::parse_ip_address(addresses[choice & 3]), (choice & 4) ? "eth0" : "", (choice & 8) != 0};
}

void require(bool claim) {
  if (!claim) std::abort();
}

/// What events say must be what the cache holds.
void check(rr::DetectedNodes& nodes, std::map<rr::NodeId, std::size_t>& told) {
  while (const auto event = nodes.poll_event()) {
    const bool is_known = told.contains(event->node.node_id);
    require(is_known == (event->kind != rr::NodeEvent::Kind::found));
    require(!event->node.urls.empty());
    if (event->kind == rr::NodeEvent::Kind::lost)
      told.erase(event->node.node_id);
    else
      told[event->node.node_id] = event->node.urls.size();
  }
  require(nodes.nodes().size() <= options.max_nodes && nodes.nodes().size() == told.size());
  require(nodes.nodes().empty() || nodes.poll_timeout().has_value());
  for (const auto& [id, node] : nodes.nodes()) {
    require(!node.urls.empty() && node.urls.size() <= options.max_urls);
    require(told.at(id) == node.urls.size());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  rr::DetectedNodes nodes(options);
  std::map<rr::NodeId, std::size_t> told;
  rr::Now now{};
  while (!rest.empty()) {
    const auto end = rest.find('\xff');
    auto packet = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (packet.empty()) continue;
    const auto choice = static_cast<std::uint8_t>(packet.front());
    packet.remove_prefix(1);
    const auto source = source_of(choice);
    (void)rr::parse_discovery_request(packet);
    if (const auto read = rr::parse_announcement(packet, source)) {
      // What was accepted, written by us, is accepted again.
      const auto again = rr::parse_announcement(rr::format_announcement(*read), source);
      require(again.has_value() && *again == *read);
      const std::string senders[] = {"", "a", "b", "c"};
      nodes.handle_announcement(*read, now, senders[choice >> 3 & 3]);
      if (choice & 1) nodes.confirm(read->node_id);
      check(nodes, told);
      if (choice & 32) nodes.handle_withdrawn(read->node_id, read->url);
      check(nodes, told);
    }
    now.steady += std::chrono::seconds(choice >> 6 << 4);
    nodes.handle_timeout(now);
    check(nodes, told);
  }
  return 0;
}
