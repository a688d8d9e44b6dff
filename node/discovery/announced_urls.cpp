#include "node/discovery/announced_urls.hpp"

#include "core/session/service/service_index.hpp"
#include "core/session/url.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

bool covers(const asio::ip::address& listened, const asio::ip::address& own) {
  if (listened.is_unspecified()) return listened.is_v6() || own.is_v4();
  return to_ip_address(listened) == to_ip_address(own);
}

std::string url_at(const NodeId& node_id, const ListenAddress& listen, asio::ip::address address) {
  if (address.is_v6()) {
    auto v6 = address.to_v6();
    v6.scope_id(0);
    address = v6;
  }
  return listen.scheme + "://" + format_host_port(address.to_string(), listen.port) +
         "/?nodeid=" + format_node_id(node_id, NodeIdFormat::dashes) + "&service=" + std::string(service_index_name);
}

}  // namespace

std::vector<AnnouncedUrl> announced_urls(const NodeId& node_id, const std::vector<ListenAddress>& listens,
                                         const std::vector<LocalAddress>& addresses) {
  std::vector<AnnouncedUrl> out;
  for (const auto& listen : listens) {
    boost::system::error_code error;
    const auto listened = asio::ip::make_address(listen.host, error);
    if (error) continue;  // not an IP transport
    for (const auto& own : addresses) {
      if (!covers(listened, own.address)) continue;
      const auto url = url_at(node_id, listen, own.address);
      if (own.address.is_loopback()) {
        if (listened.is_loopback())  // of all addresses, others are reached as well
          for (const auto& from : addresses)
            if (from.is_link_local()) out.push_back({from, url, true});
      } else if (own.address.is_v4() || own.is_link_local()) {
        out.push_back({own, url, false});
      }
    }
  }
  return out;
}

}  // namespace rr
