#include "node/transport/socket_stream.hpp"
#include "node/transport/await_tuple.hpp"

#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/container/static_vector.hpp>

namespace rr {

namespace asio = boost::asio;

namespace {

/// How long end() waits for the peer to take the last bytes, and how much it reads meanwhile.
constexpr std::chrono::milliseconds linger_time{1000};
constexpr std::size_t linger_bytes = 1024 * 1024;

}  // namespace

SocketStream::SocketStream(Socket socket, std::string peer, std::chrono::milliseconds send_stall)
    : socket_(std::move(socket)),
      stall_(socket_.get_executor(),
             [this] {
               is_stalled_ = true;
               close();
             }),
      linger_(socket_.get_executor(), [this] { cancel(); }),
      send_stall_(send_stall),
      peer_(std::move(peer)) {
  error_code ignored;  // a socket that is gone already shows it at the first read
  socket_.non_blocking(true, ignored);
}

awaitable<ReadResult> SocketStream::read_some(std::span<std::uint8_t> into) {
  if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
  auto [error, bytes] = co_await socket_.async_read_some(asio::buffer(into.data(), into.size()), await_tuple);
  if (error == asio::error::eof) error = {};
  if (error && is_stalled_) error = asio::error::timed_out;  // as the write says: who hears of it first does not matter
  co_return ReadResult{error, bytes};
}

std::size_t SocketStream::try_write(std::span<const ByteSpan> slices, error_code& error) {
  return write_now(slices, 0, error);
}

/// `offset`  bytes of the first slice that are written already.
std::size_t SocketStream::write_now(std::span<const ByteSpan> slices, std::size_t offset, error_code& error) {
  boost::container::static_vector<asio::const_buffer, 64> buffers;
  for (const auto& slice : slices) {
    if (buffers.size() == buffers.capacity()) break;
    const auto rest = buffers.empty() ? slice.subspan(offset) : slice;
    buffers.emplace_back(rest.data(), rest.size());
  }
  const auto written = socket_.write_some(buffers, error);
  if (error == asio::error::would_block) error = {};
  return written;
}

awaitable<error_code> SocketStream::write(std::span<const ByteSpan> slices) {
  const auto cancel_count = cancel_count_;
  std::size_t offset = 0;  // bytes of slices.front() that are written
  while (!slices.empty()) {
    error_code error;
    auto written = write_now(slices, offset, error);
    if (written == 0 && !error) {
      if (!stall_.is_armed()) stall_.arm(send_stall_);
      std::tie(error) = co_await socket_.async_wait(Socket::wait_write, await_tuple);
      if (is_stalled_) co_return asio::error::timed_out;
      if (!error && cancel_count != cancel_count_) error = asio::error::operation_aborted;
    }
    if (error) {
      stall_.disarm();
      co_return error;
    }
    if (written > 0) stall_.disarm();
    while (!slices.empty() && written >= slices.front().size() - offset) {
      written -= slices.front().size() - offset;
      slices = slices.subspan(1);
      offset = 0;
    }
    offset += written;
  }
  co_return error_code();
}

void SocketStream::finish_sending() {
  error_code ignored;
  socket_.shutdown(Socket::shutdown_send, ignored);
}

void SocketStream::cancel() {
  ++cancel_count_;
  error_code ignored;
  socket_.cancel(ignored);
}

awaitable<void> SocketStream::end(const EndReason&) {
  // Closing with unread input resets the connection, and a reset may overtake the last bytes sent: read on for a while.
  finish_sending();
  linger_.arm(linger_time);
  std::uint8_t scrap[4096];
  for (std::size_t total = 0; total < linger_bytes && linger_.is_armed();) {
    const auto read = co_await read_some(scrap);
    if (read.error || read.is_end()) break;
    total += read.bytes;
  }
  linger_.disarm();
  close();
}

void SocketStream::close() {
  error_code ignored;
  socket_.close(ignored);
}

Result<std::pair<std::unique_ptr<ByteStream>, std::unique_ptr<ByteStream>>> make_stream_pair(
    const boost::asio::any_io_executor& executor, std::chrono::milliseconds send_stall) {
  boost::asio::local::stream_protocol::socket near(executor);
  boost::asio::local::stream_protocol::socket far(executor);
  error_code error;
  boost::asio::local::connect_pair(near, far, error);
  if (error) return make_error(ErrorCode::system_resource_error, "a pair of sockets: " + error.message());
  near.non_blocking(true, error);
  far.non_blocking(true, error);
  auto first = std::make_unique<SocketStream>(std::move(near), "this process", send_stall);
  auto second = std::make_unique<SocketStream>(std::move(far), "this process", send_stall);
  return std::pair<std::unique_ptr<ByteStream>, std::unique_ptr<ByteStream>>(std::move(first), std::move(second));
}

}  // namespace rr
