// The gateway as a whole: listeners, devices, connections, and how it stops. Layer: server/gateway.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "node/transport/tcp.hpp"
#include "server/gateway/gateway_service.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

/// Uses one thread: that of the io_context. Outlives its run().
class Gateway : public GatewayState {
 public:
  Gateway(boost::asio::io_context& io, Config config);
  ~Gateway();

  /// Opens all listeners and starts to look at the devices. Returns the addresses with their true ports.
  /// `sockets`  that listen already, instead of the addresses of the configuration; they become the gateway's.
  /// Errors   connection_error: an address that can't be listened on; then nothing is started.
  [[nodiscard]] rr::Result<std::vector<rr::HostPort>> start(const std::vector<int>& sockets = {});

  /// Serves a client of this process, as one from 127.0.0.1. Errors   system_resource_error, out_of_system_resource.
  [[nodiscard]] rr::Result<std::unique_ptr<rr::ByteStream>> connect_inside();

  /// Goes on with another configuration. Sessions end only where their device is gone or another one; limits, timeouts
  /// and sizes hold for new connections.
  /// Errors   certificates or CAs that can't be used, an address that can't be listened on; then nothing has changed.
  [[nodiscard]] rr::Result<> reconfigure(Config next);

  /// Lets sessions end within timeouts.drain, then ends them; calls `on_stopped` when nothing is left. A second call
  /// ends them at once. Meanwhile nobody new gets to a device, but who asks for /readyz hears why. Sockets that were
  /// handed over are left at once, so that new clients wait in them.
  void stop(std::function<void()> on_stopped);
  /// Reads certificates, keys, CAs, users and rights anew, and opens the audit log anew. What can't be used stays as it
  /// was, and the log says why. Connections that are open keep what they have.
  void reload_files();
  /// Called when stopping begins.
  void on_stop(std::function<void()> call) { on_stop_ = std::move(call); }

 private:
  using Acceptor = boost::asio::ip::tcp::acceptor;
  /// What one text of `listen` stands for.
  struct Place {
    rr::HostPort address;
    bool takes_both;  ///< "::" is for IPv4 as well
    bool operator==(const Place&) const = default;
  };
  struct Listener {
    Place place;
    std::unique_ptr<rr::TcpListener> socket;
  };

  static std::vector<Place> places_of(const std::vector<rr::HostPort>& listen);
  rr::Result<Listener> open(const Place& place, std::vector<rr::HostPort>& bound);
  void serve(Listener listener);
  rr::Result<> adopt(int socket, std::vector<rr::HostPort>& bound);
  void accept(boost::asio::ip::tcp::socket socket);
  void note_unaccepted(const std::string& problem);
  void serve(std::unique_ptr<rr::ByteStream> stream, const boost::asio::ip::tcp::endpoint& peer,
             const boost::asio::ip::tcp::endpoint& local, Admission::Ticket ticket);
  rr::awaitable<void> drain();
  rr::awaitable<void> watch_files();
  void watch_clock();
  /// Devices have joined or gone.
  void note_devices();
  /// Ends what goes on for clients whose proof was revoked or has expired.
  void end_those_not_good();
  void give_adopted_back();
  void tell_of_nodes();
  bool has_session() const;
  void end_all(const rr::EndReason& reason);

  boost::asio::io_context& io_;
  std::unique_ptr<GatewayService> own_service_;
  std::vector<Listener> listeners_;
  std::vector<std::shared_ptr<Acceptor>> adopted_;  ///< sockets that listened already
  std::size_t open_connections_ = 0;
  bool ends_at_once_ = false;
  std::function<void()> on_stop_;
  std::function<void()> on_stopped_;
  std::chrono::nanoseconds clock_ahead_;  ///< the wall clock, of the steady one
  boost::asio::steady_timer files_watch_;
  boost::asio::steady_timer drained_;  ///< cancelled when a connection ends while stopping
};

}  // namespace rrgate
