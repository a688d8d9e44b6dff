// A device for gateway tests: answers CreateConnection, has no services, echoes everything else.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <string>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/node_id.hpp"

namespace rrgate::test {

/// A message that decodes: one entry of this type and member name, with `payload` bytes.
rr::Bytes make_message(std::string_view member, std::size_t payload = 0, const rr::NodeId& receiver = {},
                       std::string_view receiver_name = {});
/// A CreateConnection request.
rr::Bytes make_greeting(const rr::NodeId& receiver = {}, std::string_view receiver_name = {});

/// Lives on the thread of `io`. A message whose member is "flood" makes it send messages without end; "bye" makes it
/// close; "huge" makes it send a message that says it is 200 MB long.
class FakeDevice {
 public:
  FakeDevice(boost::asio::io_context& io, std::string node_name, std::uint16_t port = 0);
  ~FakeDevice();
  FakeDevice(const FakeDevice&) = delete;
  FakeDevice& operator=(const FakeDevice&) = delete;

  std::uint16_t port() const { return port_; }
  const rr::NodeId& node_id() const { return state_->node_id; }
  std::string url() const { return "rr+tcp://127.0.0.1:" + std::to_string(port_) + "/?service=test"; }
  /// Bytes of floods that were written so far.
  std::size_t flooded() const { return state_->flooded; }

  struct State {
    rr::NodeId node_id;
    std::string node_name;
    std::atomic<std::size_t> flooded = 0;
    std::vector<std::weak_ptr<boost::asio::ip::tcp::socket>> sockets;
  };

 private:
  boost::asio::io_context& io_;
  std::shared_ptr<State> state_;
  std::shared_ptr<boost::asio::ip::tcp::acceptor> acceptor_;
  std::uint16_t port_;
};

}  // namespace rrgate::test
