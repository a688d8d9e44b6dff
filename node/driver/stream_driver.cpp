#include "node/driver/stream_driver.hpp"

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/container/static_vector.hpp>
#include <chrono>
#include <exception>
#include <string>

namespace rr {

namespace asio = boost::asio;

namespace {

constexpr std::size_t max_slices = 32;

Error stream_error(const error_code& error) {
  if (error == asio::error::timed_out)
    return make_error(ErrorCode::connection_error, "peer too slow: it takes no data");
  return make_error(ErrorCode::connection_error, "connection lost: " + error.message());
}

/// What a stream has ended by that can't be read any more. `error`  none: in good order.
Error end_of_stream(const ByteStream& stream, const error_code& error) {
  const auto reason = stream.peer_reason();
  if (error && reason.empty()) return stream_error(error);
  return make_error(ErrorCode::connection_error,
                    "the peer closed the connection" + (reason.empty() ? std::string() : ": " + reason));
}

std::string text_of(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& exception) {
    return exception.what();
  } catch (...) {
    return "an exception that is no std::exception";
  }
}

}  // namespace

StreamDriver::StreamDriver(std::unique_ptr<ByteStream> stream)
    : stream_(std::move(stream)), timer_(stream_->executor()), buffer_(read_size) {}

void StreamDriver::start() {
  settle();
}

void StreamDriver::spawn(awaitable<void> work) {
  asio::co_spawn(executor(), std::move(work), [self = shared_from_this()](const std::exception_ptr& failure) {
    if (!failure) return;
    self->close(make_error(ErrorCode::internal_error, "the connection failed: " + text_of(failure)));
  });
}

awaitable<void> StreamDriver::read_all(std::shared_ptr<StreamDriver> self) {
  auto& driver = *self;
  while (!driver.is_closed_ && driver.unread_.empty()) {
    const auto room = driver.buffer_.renew();
    const auto read = co_await driver.stream_->read_some(room);
    if (driver.is_closed_) break;
    const Now now = read_clocks();
    if (read.error || read.is_end()) co_return driver.finish(end_of_stream(*driver.stream_, read.error), now);
    driver.buffer_.note_read(read.bytes);
    driver.unread_ = room.first(read.bytes);
    driver.settle(now);
  }
  driver.is_reading_ = false;
  if (driver.ends_in_good_order_) co_await driver.stream_->end(no_reason);
}

void StreamDriver::settle() {
  if (!is_settling_) settle(read_clocks());
}

void StreamDriver::settle(Now now) {
  if (is_settling_) return;
  is_settling_ = true;
  const auto self = shared_from_this();
  do {
    while (handle_event(now)) {  // also behind the end: what is asked of a closed session fails by an event
    }
    if (!is_closed_) write(now);  // which may bring more to read, on a stream within the process
  } while (read_on(now));
  is_settling_ = false;
  if (is_closed_) return;
  has_settled();
  if (wants_close()) {
    ends_in_good_order_ = !is_writing_ && is_reading_;
    return finish(make_error(ErrorCode::connection_error, "connection closed"), now);
  }
  arm_timer();
  if (is_reading_ || !unread_.empty()) return;
  is_reading_ = true;
  spawn(read_all(self));
}

/// Gives the session what was read and not taken yet. Returns whether it took any of it.
bool StreamDriver::read_on(Now now) {
  if (unread_.empty() || is_closed_) return false;
  const auto taken = handle_bytes(unread_, now);
  unread_ = unread_.subspan(taken);
  return taken != 0;
}

void StreamDriver::write(Now now) {
  while (!is_writing_ && !is_closed_) {
    const auto slices = poll_transmit();
    if (slices.empty()) return;
    error_code error;
    const std::size_t bytes = stream_->try_write(slices, error);
    if (error) return finish(stream_error(error), now);
    if (bytes == 0) {
      is_writing_ = true;
      // A stream that takes all at once is done when this returns, with the first slices: the others are due as well.
      spawn(write_waiting(shared_from_this()));
      continue;
    }
    handle_transmitted(bytes, now);
    has_written();
  }
}

std::size_t StreamDriver::write_at_once(std::span<const ByteSpan> slices, Now now) {
  if (is_closed_) return 0;
  error_code error;
  const std::size_t bytes = stream_->try_write(slices, error);
  if (error) finish(stream_error(error), now);
  return bytes;
}

awaitable<void> StreamDriver::write_waiting(std::shared_ptr<StreamDriver> self) {
  auto& driver = *self;
  if (driver.is_closed_) co_return;
  boost::container::static_vector<ByteSpan, max_slices> slices;
  std::size_t bytes = 0;
  for (const ByteSpan slice : driver.poll_transmit()) {
    if (slices.size() == slices.capacity() || bytes == write_size) break;
    slices.push_back(slice.first(std::min(slice.size(), write_size - bytes)));
    bytes += slices.back().size();
  }
  const auto error = co_await driver.stream_->write(slices);  // timed_out: the peer took nothing for too long
  driver.is_writing_ = false;
  if (driver.is_closed_) co_return;
  const Now now = read_clocks();
  if (error) co_return driver.finish(stream_error(error), now);
  driver.handle_transmitted(bytes, now);
  driver.has_written();
  driver.settle(now);
}

/// The session's deadline moves with every message; the timer stays where it is armed and looks again when it fires.
void StreamDriver::arm_timer() {
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

void StreamDriver::post(std::function<void()> work) {
  asio::post(executor(), std::move(work));
}

void StreamDriver::close(Error reason) {
  finish(std::move(reason), read_clocks());
}

void StreamDriver::finish(Error reason, Now now) {
  if (is_closed_) return;
  is_closed_ = true;
  const auto self = shared_from_this();
  if (ends_in_good_order_) {
    stream_->cancel();  // read_all() goes on to the end
  } else {
    stream_->finish_sending();
    stream_->close();
  }
  timer_.cancel();
  handle_closed(std::move(reason), now);
  while (handle_event(now)) {
  }
  ended();
}

}  // namespace rr
