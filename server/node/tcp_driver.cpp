#include "server/node/tcp_driver.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/container/static_vector.hpp>
#include <chrono>

namespace rr {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

Error stream_error(const error_code& error) {
  if (error == asio::error::eof) return make_error(ErrorCode::connection_error, "the peer closed the connection");
  return make_error(ErrorCode::connection_error, "connection lost: " + error.message());
}

}  // namespace

TcpDriver::TcpDriver(asio::ip::tcp::socket socket)
    : socket_(std::move(socket)), timer_(socket_.get_executor()), buffer_(new std::uint8_t[read_size]) {
  error_code ignored;  // a socket that is dead already tells so when it is read
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  socket_.non_blocking(true, ignored);
}

void TcpDriver::start() {
  settle();
  if (!is_closed_) read();
}

void TcpDriver::read() {
  socket_.async_read_some(asio::buffer(buffer_.get(), read_size),
                          [this, self = shared_from_this()](const error_code& error, std::size_t bytes) {
                            if (is_closed_) return;
                            const Now now = read_clocks();
                            if (error) return finish(stream_error(error), now);
                            handle_bytes({buffer_.get(), bytes}, now);
                            settle(now);
                            if (!is_closed_) read();
                          });
}

void TcpDriver::settle() {
  if (!is_settling_) settle(read_clocks());
}

void TcpDriver::settle(Now now) {
  if (is_settling_) return;
  is_settling_ = true;
  const auto self = shared_from_this();
  while (handle_event(now)) {  // also behind the end: what is asked of a closed session fails by an event
  }
  if (!is_closed_) write(now);
  is_settling_ = false;
  if (is_closed_) return;
  if (wants_close()) return finish(make_error(ErrorCode::connection_error, "connection closed"), now);
  arm_timer();
}

void TcpDriver::write(Now now) {
  while (!is_waiting_for_room_) {
    boost::container::static_vector<asio::const_buffer, 32> gather;
    for (const ByteSpan slice : poll_transmit()) {
      gather.emplace_back(slice.data(), slice.size());
      if (gather.size() == gather.capacity()) break;
    }
    if (gather.empty()) return;
    error_code error;
    const std::size_t bytes = socket_.write_some(gather, error);
    if (error == asio::error::would_block) return wait_for_room();
    if (error) return finish(stream_error(error), now);
    handle_transmitted(bytes, now);
  }
}

void TcpDriver::wait_for_room() {
  is_waiting_for_room_ = true;
  socket_.async_wait(asio::ip::tcp::socket::wait_write, [this, self = shared_from_this()](const error_code&) {
    is_waiting_for_room_ = false;
    settle();
  });
}

/// The session's deadline moves with every message; the timer stays where it is armed and looks again when it fires.
void TcpDriver::arm_timer() {
  const TimePoint due = poll_timeout();
  if (due >= armed_for_) return;
  armed_for_ = due;
  timer_.expires_at(due);
  timer_.async_wait([this, self = shared_from_this()](const error_code& error) {
    if (error || is_closed_) return;
    armed_for_ = TimePoint::max();
    const Now now = read_clocks();
    if (poll_timeout() <= now.steady) handle_timeout(now);
    settle(now);
  });
}

void TcpDriver::post(std::function<void()> work) {
  asio::post(socket_.get_executor(), std::move(work));
}

void TcpDriver::close(Error reason) {
  finish(std::move(reason), read_clocks());
}

void TcpDriver::finish(Error reason, Now now) {
  if (is_closed_) return;
  is_closed_ = true;
  const auto self = shared_from_this();
  error_code ignored;
  socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
  socket_.close(ignored);
  timer_.cancel();
  handle_closed(std::move(reason), now);
  while (handle_event(now)) {
  }
  ended();
}

}  // namespace rr
