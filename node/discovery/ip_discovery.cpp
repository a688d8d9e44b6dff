#include "node/discovery/ip_discovery.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/ip/multicast.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <chrono>
#include <cstring>
#include <fstream>
#include <optional>

#include "core/support/hex.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

namespace asio = boost::asio;
using asio::ip::udp;

namespace {

constexpr std::chrono::seconds rescan_period{5};

/// FF0x::BA86; `scope` is the x: 1 node, 2 link, 5 site.
asio::ip::address_v6 group(std::uint8_t scope, unsigned zone) {
  asio::ip::address_v6::bytes_type bytes{};
  bytes[0] = 0xff;
  bytes[1] = scope;
  bytes[14] = 0xba;
  bytes[15] = 0x86;
  return asio::ip::address_v6(bytes, zone);
}

/// Each group of IPv6, in hex, with an interface that is a member of it, by whichever socket.
using Memberships = std::set<std::pair<std::string, unsigned>>;

/// Nullopt: the system does not tell.
std::optional<Memberships> read_memberships() {
  std::ifstream in("/proc/self/net/igmp6");
  if (!in) return std::nullopt;
  Memberships out;
  unsigned interface = 0;
  for (std::string name, address, rest; in >> interface >> name >> address && std::getline(in, rest);)
    out.emplace(std::move(address), interface);
  return out;
}

/// Where a datagram went, as IPV6_RECVPKTINFO tells; any where it does not.
asio::ip::address_v6 target_of(msghdr& message) {
  asio::ip::address_v6::bytes_type bytes{};
  for (auto* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part))
    if (part->cmsg_level == IPPROTO_IPV6 && part->cmsg_type == IPV6_PKTINFO)
      std::memcpy(bytes.data(), CMSG_DATA(part) + offsetof(in6_pktinfo, ipi6_addr), bytes.size());
  return asio::ip::address_v6(bytes);
}

std::vector<std::uint8_t> group_scopes(const IpDiscoveryScopes& scopes) {
  std::vector<std::uint8_t> out;
  if (scopes.node_local) out.push_back(1);
  if (scopes.link_local) out.push_back(2);
  if (scopes.site_local) out.push_back(5);
  return out;
}

}  // namespace

class IpDiscovery::Implementation : public std::enable_shared_from_this<Implementation> {
 public:
  Implementation(const asio::any_io_executor& executor, IpDiscoveryScopes scopes, bool listens, Callbacks callbacks)
      : executor_(executor), scopes_(scopes), listens_(listens), callbacks_(std::move(callbacks)), rescan_(executor) {}

  void start() {
    addresses_ = local_addresses();
    listen();
    rescan_later();
  }

  void close() {
    is_closed_ = true;
    rescan_.cancel();
    for (auto* receiver : {&v6_, &v4_}) {
      error_code ignored;
      if (*receiver) (*receiver)->socket.close(ignored);  // what it waits for keeps it
      receiver->reset();
    }
  }

  const std::vector<LocalAddress>& addresses() const { return addresses_; }

  void send(const LocalAddress& from, std::string_view packet, bool stays_here) {
    if (from.address.is_v4()) {
      if (!scopes_.ipv4_broadcast || stays_here) return;
      send_to(from, {from.broadcast.value_or(asio::ip::address_v4::broadcast())}, packet);
      return;
    }
    std::vector<asio::ip::address> groups;
    for (const auto scope : group_scopes(scopes_))
      if (!stays_here || scope == 1) groups.emplace_back(group(scope, from.interface_index));
    if (!groups.empty()) send_to(from, groups, packet);
  }

  void send_everywhere(std::string_view packet) {
    std::set<std::pair<unsigned, bool>> done;  // interface, whether IPv4
    for (const auto& from : addresses_) {
      const bool is_v4 = from.address.is_v4();
      if ((is_v4 || from.is_link_local()) && !from.address.is_loopback() &&
          done.emplace(from.interface_index, is_v4).second)
        send(from, packet, false);
    }
  }

 private:
  /// One socket that listens, with the datagram that it received last.
  struct Receiver {
    explicit Receiver(const asio::any_io_executor& executor) : socket(executor) {}
    udp::socket socket;
    udp::endpoint sender;
    asio::ip::address_v6 target;  ///< of IPv6; else any
    std::array<char, max_discovery_packet_bytes> buffer{};
    std::set<unsigned> joined;  ///< interfaces whose groups it is a member of
  };

  /// A socket of its own for each packet: it is bound to the address that the packet speaks of.
  void send_to(const LocalAddress& from, const std::vector<asio::ip::address>& targets, std::string_view packet) {
    error_code error;
    udp::socket socket(executor_);
    socket.open(from.address.is_v6() ? udp::v6() : udp::v4(), error);
    if (error) return;
    socket.non_blocking(true, error);
    socket.set_option(udp::socket::reuse_address(true), error);
    if (from.address.is_v6()) {
      socket.set_option(asio::ip::multicast::outbound_interface(from.interface_index), error);
      socket.set_option(asio::ip::multicast::enable_loopback(true), error);
    } else {
      socket.set_option(asio::socket_base::broadcast(true), error);
    }
    socket.bind({from.address, discovery_port}, error);
    // Somebody may hold the port without sharing it. Nobody looks at where a packet comes from but its address.
    if (error == asio::error::address_in_use) socket.bind({from.address, 0}, error);
    if (error) return;  // the address has just gone
    // A network that is down is no problem of ours: the next announcement may find it up.
    for (const auto& target : targets)
      socket.send_to(asio::buffer(packet.data(), packet.size()), {target, discovery_port}, 0, error);
  }

  /// Whether packets may have been missed since the last call.
  bool listen() {
    if (!listens_) return false;
    if (!v6_ && !group_scopes(scopes_).empty()) open(v6_, {asio::ip::address_v6::any(), discovery_port});
    if (!v4_ && scopes_.ipv4_broadcast) open(v4_, {asio::ip::address_v4::any(), discovery_port});
    return v6_ && join_groups();
  }

  void open(std::shared_ptr<Receiver>& receiver, const udp::endpoint& endpoint) {
    auto opened = std::make_shared<Receiver>(executor_);
    error_code error;
    opened->socket.open(endpoint.protocol(), error);
    if (!error && endpoint.address().is_v6()) {
      opened->socket.set_option(asio::ip::v6_only(true), error);
      const int on = 1;
      if (!error && ::setsockopt(opened->socket.native_handle(), IPPROTO_IPV6, IPV6_RECVPKTINFO, &on, sizeof(on)) != 0)
        error.assign(errno, asio::error::get_system_category());
    }
    // Every node of the machine listens at this port; multicast and broadcast datagrams reach all of them.
    if (!error) opened->socket.set_option(udp::socket::reuse_address(true), error);
    if (!error) opened->socket.bind(endpoint, error);
    if (error)
      return report_once("listen for discovery on UDP port " + std::to_string(discovery_port) +
                         (endpoint.address().is_v6() ? " (IPv6): " : " (IPv4): ") + error.message());
    receiver = opened;
    receive(opened);
  }

  /// Whether memberships had been lost.
  bool join_groups() {
    std::set<unsigned> present;
    for (const auto& address : addresses_)
      if (address.address.is_v6()) present.insert(address.interface_index);
    const auto memberships = read_memberships();
    bool has_lost = false;
    for (const auto scope : group_scopes(scopes_)) {
      const auto address = hex_text(group(scope, 0).to_bytes());
      for (const auto interface : present) {
        const bool is_new = !v6_->joined.contains(interface);
        if (!is_new && (!memberships || memberships->contains({address, interface}))) continue;
        error_code error;  // an interface without multicast
        // One whose IPv6 was off, if only for a moment, has lost its memberships, but may not join a second time.
        v6_->socket.set_option(asio::ip::multicast::leave_group(group(scope, 0), interface), error);
        v6_->socket.set_option(asio::ip::multicast::join_group(group(scope, 0), interface), error);
        has_lost = has_lost || (!is_new && !error);
      }
    }
    v6_->joined = present;  // an interface that has gone takes its membership along
    return has_lost;
  }

  void receive(const std::shared_ptr<Receiver>& receiver) {
    receiver->socket.async_wait(udp::socket::wait_read,
                                [self = shared_from_this(), receiver](const error_code& waited) {
                                  if (self->is_closed_ || waited == asio::error::operation_aborted) return;
                                  error_code error = waited;
                                  const auto packet = error ? std::nullopt : take_datagram(*receiver, error);
                                  if (error) return self->drop(receiver, error);
                                  if (packet) self->handle_datagram(*receiver, *packet);
                                  if (!self->is_closed_) self->receive(receiver);
                                });
  }

  /// By hand, for Asio does not tell which address a datagram went to. None: there is none after all.
  static std::optional<std::string_view> take_datagram(Receiver& receiver, error_code& error) {
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(in6_pktinfo))> control{};
    iovec into{receiver.buffer.data(), receiver.buffer.size()};
    msghdr message{};
    message.msg_name = receiver.sender.data();
    message.msg_namelen = static_cast<socklen_t>(receiver.sender.capacity());
    message.msg_iov = &into;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const auto size = ::recvmsg(receiver.socket.native_handle(), &message, MSG_DONTWAIT);
    if (size < 0) {
      if (errno != EAGAIN && errno != EINTR) error.assign(errno, asio::error::get_system_category());
      return std::nullopt;
    }
    receiver.sender.resize(message.msg_namelen);
    receiver.target = target_of(message);
    return std::string_view(receiver.buffer.data(), static_cast<std::size_t>(size));
  }

  /// The next rescan opens another.
  void drop(const std::shared_ptr<Receiver>& receiver, const error_code& error) {
    report_once("receive discovery packets: " + error.message());
    for (auto* each : {&v6_, &v4_})
      if (*each == receiver) each->reset();
  }

  void handle_datagram(const Receiver& receiver, std::string_view packet) {
    const auto sender = receiver.sender.address();
    PacketSource source;
    source.address = to_ip_address(sender);
    if (sender.is_v6()) source.zone = zone_of(sender.to_v6().scope_id());
    source.is_this_machine = is_this_machine(receiver);
    callbacks_.received(packet, source);
  }

  /// Linux drops IPv4 packets from elsewhere that claim an address of ours, but lets those of IPv6 in. It drops what
  /// came over a link to a group of scope 1.
  bool is_this_machine(const Receiver& receiver) const {
    if (receiver.sender.address().is_v6()) return receiver.target.is_multicast_node_local();
    return std::any_of(addresses_.begin(), addresses_.end(),
                       [&](const auto& own) { return own.address == receiver.sender.address(); });
  }

  void rescan_later() {
    rescan_.expires_after(rescan_period);
    rescan_.async_wait([self = shared_from_this()](const error_code& error) {
      if (error || self->is_closed_) return;
      auto found = local_addresses();
      const bool is_changed = found != self->addresses_;
      self->addresses_ = std::move(found);
      const bool has_missed_packets = self->listen();
      self->rescan_later();
      if (is_changed || has_missed_packets) self->callbacks_.addresses_changed();
    });
  }

  /// What goes wrong at one rescan goes wrong at the next as well.
  void report_once(const std::string& problem) {
    if (reported_.insert(problem).second) callbacks_.report(problem);
  }

  asio::any_io_executor executor_;
  IpDiscoveryScopes scopes_;
  bool listens_;
  Callbacks callbacks_;
  asio::steady_timer rescan_;
  std::vector<LocalAddress> addresses_;
  std::shared_ptr<Receiver> v6_;
  std::shared_ptr<Receiver> v4_;
  std::set<std::string> reported_;  ///< one for each kind of failure
  bool is_closed_ = false;
};

IpDiscovery::IpDiscovery(const asio::any_io_executor& executor, IpDiscoveryScopes scopes, bool listens,
                         Callbacks callbacks)
    : implementation_(std::make_shared<Implementation>(executor, scopes, listens, std::move(callbacks))) {
  implementation_->start();
}

IpDiscovery::~IpDiscovery() {
  implementation_->close();
}

const std::vector<LocalAddress>& IpDiscovery::addresses() const {
  return implementation_->addresses();
}

void IpDiscovery::send(const LocalAddress& from, std::string_view packet, bool stays_here) {
  implementation_->send(from, packet, stays_here);
}

void IpDiscovery::send_everywhere(std::string_view packet) {
  implementation_->send_everywhere(packet);
}

}  // namespace rr
