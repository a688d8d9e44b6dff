// A native node: listens, and serves services to clients on one thread. Layer: node/service.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/bytes.hpp"
#include "node/service/service.hpp"
#include "node/tls/tls_context.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/schemes.hpp"

namespace rr {

struct NodeOptions {
  NodeId id = {};  ///< any: random
  Features features = {};
  std::size_t max_message_size = 12u * 1024 * 1024;
  std::size_t max_clients = 4096;  ///< more connections are closed at once
  std::size_t max_blocking = 64;   ///< threads for handlers marked rr::blocking, started when needed; more calls wait
  /// Pages of other hosts that may open WebSockets: "https://lab.example", "https://*.example.org:8443".
  std::vector<std::string> allowed_origins = {};
  /// With the certificate of `id`, by load_node_tls() or make_node_tls(): clients may use TLS, on the same port. Null:
  /// they can't.
  TlsContextPtr tls = {};
  /// Takes the NodeID that this machine keeps for the node's name, in the place where the reference has it as well, and
  /// makes one the first time. The name is then this node's alone; `id` is not used.
  bool keeps_id = false;
  bool require_tls = false;  ///< clients without TLS are refused
  /// rr+local: for the users of this machine whom the administrator has let in, not for this user alone.
  bool local_is_public = false;
  /// None: as the reference on each transport (heartbeat_of()).
  std::optional<Heartbeat> heartbeat = {};
  /// A sentence about something that went wrong by mistake, as a handler that threw what is no rr::Exception; the
  /// default writes it to stderr.
  std::function<void(const std::string& problem)> report = {};
};

/// A node on one thread: everything runs in run(), handlers included but those marked rr::blocking. Other threads use
/// post() alone, and the Reply of a request.
class Node {
 public:
  /// `name` may be empty.
  /// Throws   std::invalid_argument: not a node name.
  explicit Node(std::string name, NodeOptions options = {});
  /// Runs on somebody else's io_context, which must outlive the node; run() is not for it then.
  Node(boost::asio::io_context& io, std::string name, NodeOptions options = {});
  /// Waits for blocking handlers that run.
  ~Node();

  /// Throws   std::invalid_argument that names the missing handlers or the name that is taken.
  void add(const std::shared_ptr<Service>& service);
  /// "rr+tcp://0.0.0.0:52222", "rr+tcp://[::]:0" (IPv4 as well), "rr+tcp://localhost:0"; port 0 takes a free one.
  /// WebSockets (rr+ws) are taken on the same port, and TLS (rrs+tcp, rrs+ws) where the node has a certificate;
  /// "rrs+tcp://HOST:PORT" takes nothing but TLS.
  /// "rr+local:///": programs on this machine, who find the node by its ID or name.
  /// "rr+intra:///": clients in this process, likewise.
  /// Returns  the port, 0 for rr+local and rr+intra. Throws std::invalid_argument; std::runtime_error ("listen on ...:
  /// Address already in use").
  std::uint16_t listen(std::string_view url);

  /// Serves a connection that the program has accepted itself, be it from a listener or out of a web server of its own,
  /// as those of listen(): by the first bytes it is Robot Raconteur, a WebSocket to be upgraded, or refused. A
  /// WebSocket that the program has upgraded comes as a stream of what it carries: make_beast_stream().
  /// `stream`  runs on io_context(), or on what the node was given.
  /// `url`     by which its clients come, for the service index: "rr+ws://robot.lab:8080/arm".
  /// Throws   std::invalid_argument: not such a URL.
  void accept(std::unique_ptr<ByteStream> stream, std::string_view url);
  /// The same for a socket, whose address says the URL. `seen`: what was read of it already, a whole HTTP request, say.
  void accept(boost::asio::ip::tcp::socket socket, ByteSpan seen = {});

  /// Runs until stop(), SIGINT or SIGTERM; what else was given to io_context() does not hold it up then.
  void run();
  /// Closes the listeners and tells the clients that their services end; run() returns when they are gone, after half a
  /// second at the latest.
  void stop();
  /// Runs `work` on the node's thread. What it throws is reported (NodeOptions::report); so is what every() runs.
  void post(std::function<void()> work);
  /// Runs `work` again and again, `period` apart, until the node stops. Does not drift; what could not run in time
  /// because something else took too long is left out.
  void every(std::chrono::nanoseconds period, std::function<void()> work);

  const NodeIdentity& identity() const;
  /// Where it listens now: "rr+tcp://0.0.0.0:52222?nodeid=...", "rr+local:///?nodeid=..."; empty once it has stopped.
  std::vector<std::string> listen_urls() const;
  /// Other random text after each add(): how those who found the node see that its services have changed.
  const std::string& service_state_nonce() const;
  /// `handler` hears of services and listen URLs that are added. One handler; a second replaces the first.
  void on_services_changed(std::function<void()> handler);
  boost::asio::io_context& io_context();
  /// Clients that are connected to a service now.
  std::size_t client_count() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace rr
