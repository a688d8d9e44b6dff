// A connected socket, TCP or local, as a stream. Layer: node/transport.
// Source: transports spec section 2 (socket options).
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "core/support/error.hpp"
#include "node/transport/descriptor_stream.hpp"

namespace rr {

class SocketStream final : public DescriptorStream<boost::asio::generic::stream_protocol::socket> {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;

  /// Takes over a connected socket. `peer`: who is there, for logs. `send_stall`: see ByteStream::write.
  SocketStream(Socket socket, std::string peer, std::chrono::milliseconds send_stall);

  void finish_sending() override;
  awaitable<void> end(const EndReason& reason) override;

 private:
  Deadline linger_;
};

}  // namespace rr
