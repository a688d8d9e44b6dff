// An open connection, as far as the gateway knows it. Layer: server/state.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/intrusive/list.hpp>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "core/session/url.hpp"
#include "node/transport/byte_stream.hpp"
#include "server/access/identity.hpp"
#include "server/http/forwarded.hpp"
#include "server/state/admission.hpp"

namespace rrgate {

class Device;

/// One open connection as the gateway knows it, so that it can be asked to end.
struct Connection : boost::intrusive::list_base_hook<boost::intrusive::link_mode<boost::intrusive::auto_unlink>> {
  Connection(Peer from, boost::asio::ip::tcp::endpoint at, Admission::Ticket held)
      : peer(std::move(from)), local(std::move(at)), ticket(std::move(held)), client(describe(peer)) {}
  static std::string describe(const Peer& peer) {
    return rr::format_host_port(peer.endpoint.address().to_string(), peer.endpoint.port());
  }

  /// Ends it soon.
  std::function<void(rr::EndReason)> stop;
  /// Whether what its client has shown is still good (Standing); none: nothing goes on that would have to end.
  std::function<bool()> is_good;
  /// Set while it is used for one device.
  std::shared_ptr<const Device> device;
  /// It carries a Robot Raconteur session, which may go on for a while when the gateway stops.
  bool has_session = false;
  Peer peer;
  boost::asio::ip::tcp::endpoint local;  ///< where it came in
  Admission::Ticket ticket;
  /// The client as logs name it: as `peer`, or as a trusted proxy says.
  std::string client;
  /// As what its requests are counted, see network_name().
  std::string network;
  /// Who it is, as far as it has shown: by its certificate, by the request that became a WebSocket.
  Identity identity;
};

}  // namespace rrgate
