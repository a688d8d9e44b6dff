// Moves bytes between a stream and a sans-IO session, for both roles. Layer: node/driver.
// Source: the contract in core/session/connection.hpp.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <span>
#include <utility>

#include "core/session/connection.hpp"
#include "core/session/transmit_queue.hpp"
#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "node/driver/clocks.hpp"
#include "node/platform/read_buffer.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

/// One stream and, in SessionDriver, one session. Everything runs on the thread of the stream's executor and a message
/// is handled to the end where it was read: read, decode, handler, reply, write, without a hop, a lock, or a timer
/// operation. Writes are tried at once and gather all that is queued; only a full stream waits.
///
/// Lives in a shared_ptr, which the pending read keeps; after close() the last handlers let go of it.
class StreamDriver : public std::enable_shared_from_this<StreamDriver> {
 public:
  explicit StreamDriver(std::unique_ptr<ByteStream> stream);
  virtual ~StreamDriver() = default;
  StreamDriver(const StreamDriver&) = delete;
  StreamDriver& operator=(const StreamDriver&) = delete;

  /// Begins to read; call once.
  void start();
  /// Handles the session's events, writes what it has to send, sees to timer and end. Due after everything asked of
  /// the session; inside of event handlers it does nothing, because the loop that called them goes on anyway.
  void settle();
  /// Closes the stream at once. The session hears `reason` unless it has ended already.
  void close(Error reason);
  bool is_closed() const { return is_closed_; }
  /// See ByteStream.
  NodeId verified_peer() const { return stream_->verified_peer(); }
  boost::asio::any_io_executor executor() { return timer_.get_executor(); }

 protected:
  /// settle() at a time that was read just now.
  void settle(Now now);
  /// Writes what goes without waiting, past the session's queue. Returns bytes; what fails closes the stream.
  std::size_t write_at_once(std::span<const ByteSpan> slices, Now now);
  /// Runs `work` on the thread of the stream, later.
  void post(std::function<void()> work);

 private:
  // The session's half of the contract.
  /// Returns bytes consumed; the rest comes again when events were handled or something was asked of the session.
  virtual std::size_t handle_bytes(ByteSpan input, Now now) = 0;
  virtual void handle_transmitted(std::size_t bytes, Now now) = 0;
  virtual void handle_timeout(Now now) = 0;
  virtual void handle_closed(Error reason, Now now) = 0;
  virtual std::span<const ByteSpan> poll_transmit() = 0;
  virtual bool wants_close() const = 0;
  virtual TimePoint poll_timeout() const = 0;
  /// After handle_transmitted(): fewer bytes wait. Whatever else is due has to be posted.
  virtual void has_written() {}
  /// After whatever was told or asked: what could be written is written.
  virtual void has_settled() {}
  /// Polls one event and handles it. Returns whether there was one.
  virtual bool handle_event(Now now) = 0;
  /// The stream is closed and all events are handled; called once, last.
  virtual void ended() = 0;

  /// Runs work of this driver, which never ends in silence: what it throws closes the stream.
  void spawn(awaitable<void> work);
  static awaitable<void> read_all(std::shared_ptr<StreamDriver> self);
  static awaitable<void> write_waiting(std::shared_ptr<StreamDriver> self);
  bool read_on(Now now);
  void write(Now now);
  void arm_timer();
  void finish(Error reason, Now now);

  static constexpr std::size_t read_size = 64 * 1024;
  /// At most at once: the session hears how it goes on.
  static constexpr std::size_t write_size = TransmitQueue::write_size;

  // First what each write looks at, together.
  std::unique_ptr<ByteStream> stream_;
  bool is_reading_ = false;  ///< read_all() runs
  bool is_settling_ = false;
  bool is_writing_ = false;  ///< write_waiting() runs
  bool is_closed_ = false;
  bool ends_in_good_order_ = false;  ///< the session has said goodbye: the stream may as well
  ByteSpan unread_;                  ///< of buffer_: the session does not take it yet, and nothing more is read
  TimePoint armed_for_ = TimePoint::max();
  boost::asio::steady_timer timer_;
  ReadBuffer buffer_;
};

/// The driver of one ClientSession or ServiceSession. What it leaves to the derived class are the session's events.
template <class Session>
class SessionDriver : public StreamDriver {
 protected:
  template <class... Args>
  explicit SessionDriver(std::unique_ptr<ByteStream> stream, Args&&... session_arguments)
      : StreamDriver(std::move(stream)), session_(std::forward<Args>(session_arguments)...) {}

  /// settle() after something was sent that the session may have lent. What is lent and goes at once leaves nothing to
  /// settle: no event, nothing in the queue, and no deadline that comes earlier.
  void settle(const LentMessage& lent, Now now) {
    if (lent.message) {
      const auto bytes = write_at_once(lent.slices, now);
      if (is_closed() || session_.handle_lent(lent, bytes, now)) return;
    }
    StreamDriver::settle(now);
  }
  using StreamDriver::settle;

  Session session_;

 private:
  std::size_t handle_bytes(ByteSpan input, Now now) final { return session_.handle_bytes(input, now); }
  void handle_transmitted(std::size_t bytes, Now now) final { session_.handle_transmitted(bytes, now); }
  void handle_timeout(Now now) final { session_.handle_timeout(now); }
  void handle_closed(Error reason, Now now) final { session_.handle_closed(std::move(reason), now); }
  std::span<const ByteSpan> poll_transmit() final { return session_.poll_transmit(); }
  bool wants_close() const final { return session_.wants_close(); }
  TimePoint poll_timeout() const final { return session_.poll_timeout(); }
};

}  // namespace rr
