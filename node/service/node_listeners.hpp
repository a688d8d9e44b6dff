// Where a node listens: TCP, this machine, this process. Layer: node/service. Source: transports spec section 4.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/url.hpp"
#include "core/support/node_id.hpp"
#include "node/service/node.hpp"
#include "node/transport/intra.hpp"
#include "node/transport/local.hpp"
#include "node/transport/tcp.hpp"

namespace rr {

class NodeListeners {
 public:
  /// Who hears of those who come in.
  class Owner {
   public:
    virtual void accept_tcp(boost::asio::ip::tcp::socket socket, bool requires_tls) = 0;
    /// From this machine: `scheme` is rr+local or rr+intra.
    virtual void accept_near(std::unique_ptr<ByteStream> stream, std::string scheme) = 0;
    virtual void report(const std::string& problem) = 0;

   protected:
    ~Owner() = default;
  };

  /// How long a client may take nothing of what it is sent.
  static constexpr std::chrono::milliseconds send_stall{15000};

  /// `options`, `owner`  outlive it.
  NodeListeners(boost::asio::any_io_executor executor, const NodeOptions& options, Owner& owner)
      : executor_(std::move(executor)), options_(options), owner_(owner) {}

  /// See Node::listen(). `nonce`  of the node's services.
  std::uint16_t listen(std::string_view url, const NodeIdentity& node, const std::string& nonce);
  /// The node's services have changed.
  void publish(const std::string& nonce);
  /// See Node::listen_urls().
  std::vector<std::string> urls(const NodeId& node) const;
  void close();

 private:
  struct Place {
    HostPort address;
    bool requires_tls = false;
  };
  static Place parse(std::string_view url);
  std::uint16_t listen_by_tcp(std::string_view url);
  void listen_locally(const NodeIdentity& node, const std::string& nonce);
  void listen_in_process(const NodeIdentity& node, const std::string& nonce);

  boost::asio::any_io_executor executor_;
  const NodeOptions& options_;
  Owner& owner_;
  std::vector<std::unique_ptr<TcpListener>> tcp_;
  std::vector<Place> places_;  ///< of tcp_: addresses with their true ports
  std::unique_ptr<LocalListener> local_;
  std::unique_ptr<IntraListener> intra_;
};

}  // namespace rr
