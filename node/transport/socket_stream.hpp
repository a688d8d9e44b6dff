// A connected socket, TCP or local, as a stream. Layer: node/transport.
// Source: transports spec section 2 (socket options).
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "core/support/error.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"

namespace rr {

class SocketStream final : public ByteStream {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;

  /// Takes over a connected socket. `peer`: who is there, for logs. `send_stall`: see ByteStream::write.
  SocketStream(Socket socket, std::string peer, std::chrono::milliseconds send_stall);

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override;
  std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) override;
  awaitable<error_code> write(std::span<const ByteSpan> slices) override;
  void finish_sending() override;
  void cancel() override;
  awaitable<void> end(const EndReason& reason) override;
  void close() override;
  std::string peer() const override { return peer_; }
  boost::asio::any_io_executor executor() override { return socket_.get_executor(); }

 private:
  std::size_t write_now(std::span<const ByteSpan> slices, std::size_t offset, error_code& error);

  Socket socket_;
  Deadline stall_;
  Deadline linger_;
  std::chrono::milliseconds send_stall_;
  bool is_stalled_ = false;
  unsigned cancel_count_ = 0;  ///< a write that was between two waits notices cancel() by it
  std::string peer_;
};

/// Two ends of one connection inside this process. Errors   system_resource_error.
Result<std::pair<std::unique_ptr<ByteStream>, std::unique_ptr<ByteStream>>> make_stream_pair(
    const boost::asio::any_io_executor& executor, std::chrono::milliseconds send_stall);

}  // namespace rr
