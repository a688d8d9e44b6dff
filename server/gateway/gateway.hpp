// The gateway as a whole: listeners, devices, connections, and how it stops. Layer: server/gateway.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/intrusive/list.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "server/access/access.hpp"
#include "server/config/config.hpp"
#include "server/gateway/admission.hpp"
#include "server/gateway/device.hpp"
#include "server/gateway/device_session.hpp"
#include "server/gateway/found_devices.hpp"
#include "server/gateway/gateway_service.hpp"
#include "server/gateway/shared/shared_devices.hpp"
#include "server/gateway/tls_files.hpp"
#include "server/http/router.hpp"
#include "server/transport/tcp.hpp"

namespace rrgate {

class HttpAccess;

/// One open connection as the gateway knows it, so that it can be asked to end.
struct Connection : boost::intrusive::list_base_hook<boost::intrusive::link_mode<boost::intrusive::auto_unlink>> {
  Connection(Peer from, boost::asio::ip::tcp::endpoint at, Admission::Ticket held)
      : peer(std::move(from)), local(std::move(at)), ticket(std::move(held)), client(describe(peer)) {}
  static std::string describe(const Peer& peer) {
    return rr::format_host_port(peer.endpoint.address().to_string(), peer.endpoint.port());
  }

  /// Ends it soon.
  std::function<void(rr::EndReason)> stop;
  /// Set while it carries a client's session, which may go on for a while when the gateway stops.
  const Device* device = nullptr;
  /// It uses a device session of the gateway, and ends as soon as that stops.
  bool ends_with_gateway = false;
  Peer peer;
  boost::asio::ip::tcp::endpoint local;  ///< where it came in
  Admission::Ticket ticket;
  /// The client as logs name it: as `peer`, or as a trusted proxy says.
  std::string client;
  /// Its address alone, by which its requests are counted.
  std::string address;
  /// Who it is, as far as it has shown: by its certificate, by the request that became a WebSocket.
  Identity identity;
};

/// Uses one thread: that of the io_context. Outlives its run().
class Gateway {
 public:
  Gateway(boost::asio::io_context& io, Config config);
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;
  ~Gateway();

  /// Opens all listeners and starts to look at the devices. Returns the addresses with their true ports.
  /// `sockets`  that listen already, instead of the addresses of the configuration; they become the gateway's.
  /// Errors   connection_error: an address that can't be listened on; then nothing is started.
  [[nodiscard]] rr::Result<std::vector<rr::HostPort>> start(const std::vector<int>& sockets = {});

  /// Goes on with another configuration. Sessions end only where their device is gone or another one; limits, timeouts
  /// and sizes hold for new connections.
  /// Errors   certificates or CAs that can't be used, an address that can't be listened on; then nothing has changed.
  [[nodiscard]] rr::Result<> reconfigure(Config next);

  /// Lets relays end within timeouts.drain, then ends them; calls `on_stopped` when nothing is left. A second call ends
  /// them at once. Meanwhile nobody new gets to a device, but who asks for /readyz hears why.
  void stop(std::function<void()> on_stopped);
  bool is_stopping() const { return is_stopping_; }
  /// Reads certificates, keys, CAs, users and rights anew, and opens the audit log anew. What can't be used stays as it
  /// was, and the log says why. Connections that are open keep what they have.
  void reload_files();
  /// Called when stopping begins.
  void on_stop(std::function<void()> call) { on_stop_ = std::move(call); }

  // What connections need.
  const Config& config() const { return config_; }
  DeviceRegistry& devices() { return devices_; }
  DeviceSessions& sessions() { return sessions_; }
  SharedDevices& shared() { return shared_; }
  /// Null where the configuration has no "discover", and before start().
  FoundDevices* found() { return config_.discover.is_enabled ? found_.get() : nullptr; }
  Metrics& metrics() { return metrics_; }
  void reject(Rejection why) { metrics_.reject(why); }
  Admission& admission() { return admission_; }
  /// Who may do what.
  Access& access() { return access_; }
  /// How clients of HTTP show who they are, and how much they may ask for.
  HttpAccess& http_access() { return *http_access_; }
  const Router& router() const { return router_; }
  /// What new connections are encrypted with; null: TLS is not served.
  rr::TlsContextPtr tls() const { return web_tls_ ? web_tls_->context() : nullptr; }
  /// Our own node id, for answers to native clients that no device takes.
  const rr::NodeId& node_id() { return shared_.node().identity().id; }
  void add(Connection& connection) { connections_.push_back(connection); }

 private:
  using Acceptor = boost::asio::ip::tcp::acceptor;
  struct Listener {
    rr::HostPort address;
    std::unique_ptr<rr::TcpListener> socket;
  };

  rr::Result<Listener> open(const rr::HostPort& address, std::vector<rr::HostPort>& bound);
  void serve(Listener listener);
  rr::Result<> adopt(int socket, std::vector<rr::HostPort>& bound);
  void accept(boost::asio::ip::tcp::socket socket);
  rr::awaitable<void> drain();
  rr::awaitable<void> watch_files();
  void close_listeners();
  void tell_of_nodes();
  bool has_relay() const;
  void end_all(const rr::EndReason& reason);

  boost::asio::io_context& io_;
  Config config_;
  Access access_;
  std::unique_ptr<HttpAccess> http_access_;
  std::unique_ptr<TlsFiles> web_tls_;
  DeviceRegistry devices_;
  DeviceSessions sessions_;
  std::unique_ptr<FoundDevices> found_;
  Admission admission_;
  Router router_;
  SharedDevices shared_;
  std::unique_ptr<GatewayService> own_service_;
  Metrics metrics_;
  std::vector<Listener> listeners_;
  std::vector<std::shared_ptr<Acceptor>> adopted_;  ///< sockets that listened already
  boost::intrusive::list<Connection, boost::intrusive::constant_time_size<false>> connections_;
  std::size_t open_connections_ = 0;
  bool is_stopping_ = false;
  bool ends_at_once_ = false;
  std::function<void()> on_stop_;
  std::function<void()> on_stopped_;
  boost::asio::steady_timer files_watch_;
  boost::asio::steady_timer drained_;  ///< cancelled when a connection ends while stopping
};

}  // namespace rrgate
