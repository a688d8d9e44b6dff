#include "node/discovery/local_address.hpp"

#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <memory>

namespace rr {

namespace asio = boost::asio;

namespace {

/// Copies, since a sockaddr may not be aligned for what it is.
template <class T>
T read_as(const sockaddr* from) {
  T out{};
  std::memcpy(&out, from, sizeof(out));
  return out;
}

template <class Address>
bool can_bind(Address address, int family) {
  const int descriptor = ::socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return false;
  sockaddr_storage bound{};
  std::memcpy(&bound, &address, sizeof(address));
  const bool is_bound = ::bind(descriptor, reinterpret_cast<const sockaddr*>(&bound), sizeof(address)) == 0;
  ::close(descriptor);
  return is_bound;
}

asio::ip::address_v4 v4_of(const sockaddr* from) {
  return asio::ip::address_v4(ntohl(read_as<sockaddr_in>(from).sin_addr.s_addr));
}

std::optional<LocalAddress> read_address(const ifaddrs& entry) {
  if (!entry.ifa_addr || (entry.ifa_flags & IFF_UP) == 0) return std::nullopt;
  LocalAddress out;
  out.interface = entry.ifa_name;
  out.interface_index = ::if_nametoindex(entry.ifa_name);
  if (entry.ifa_addr->sa_family == AF_INET) {
    out.address = v4_of(entry.ifa_addr);
    if ((entry.ifa_flags & IFF_BROADCAST) != 0 && entry.ifa_broadaddr) out.broadcast = v4_of(entry.ifa_broadaddr);
    if (!can_bind(read_as<sockaddr_in>(entry.ifa_addr), AF_INET)) return std::nullopt;
    return out;
  }
  if (entry.ifa_addr->sa_family != AF_INET6) return std::nullopt;
  const auto v6 = read_as<sockaddr_in6>(entry.ifa_addr);
  asio::ip::address_v6::bytes_type bytes;
  std::memcpy(bytes.data(), &v6.sin6_addr, bytes.size());
  out.address = asio::ip::address_v6(bytes, v6.sin6_scope_id);
  if (!can_bind(v6, AF_INET6)) return std::nullopt;
  return out;
}

}  // namespace

std::vector<LocalAddress> local_addresses() {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, ::freeifaddrs);
  std::vector<LocalAddress> out;
  for (const auto* entry = list; entry; entry = entry->ifa_next)
    if (auto address = read_address(*entry)) out.push_back(std::move(*address));
  return out;
}

IpAddress to_ip_address(const asio::ip::address& address) {
  IpAddress out;
  out.is_v6 = address.is_v6();
  if (out.is_v6) {
    const auto bytes = address.to_v6().to_bytes();
    std::copy(bytes.begin(), bytes.end(), out.bytes.begin());
  } else {
    const auto bytes = address.to_v4().to_bytes();
    std::copy(bytes.begin(), bytes.end(), out.bytes.begin());
  }
  return out;
}

std::string zone_of(unsigned long scope_id) {
  if (scope_id == 0) return {};
  char name[IF_NAMESIZE] = {};
  const auto is_zone_char = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
           c == '.';
  };
  if (!::if_indextoname(static_cast<unsigned>(scope_id), name)) return std::to_string(scope_id);
  const std::string text = name;
  return std::all_of(text.begin(), text.end(), is_zone_char) ? text : std::to_string(scope_id);
}

}  // namespace rr
