// All streams of one claimed USB device. Layer: hardware. Source: hardware spec sections 3.1 to 3.4.
//
// The driver opens the device, selects its first configuration and claims the interface; then it carries out what the
// link asks for, until the link is closed; then it cancels what is pending, releases the interface and closes. Told,
// asked, polled (architecture.md): after everything told or asked, poll control, writes, reads, timeout and events.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/hardware/usb_descriptors.hpp"
#include "core/hardware/usb_transfer.hpp"
#include "core/support/time.hpp"

namespace rr {

struct UsbLinkOptions {
  std::size_t max_streams = 256;
  std::size_t max_unsent_bytes = 64u * 1024;        ///< a stream; write() takes no more
  std::size_t max_unread_bytes = 4u * 1024 * 1024;  ///< a stream; above, nothing is read from the device ...
  std::chrono::milliseconds read_stall{5000};       ///< ... and after that the stream is closed: all share one pipe
};

/// Names a stream at this side, also while it has no id of the device's yet; never 0 and never used again.
using UsbStreamKey = std::uint32_t;

enum class UsbEventKind : std::uint8_t {
  opened,    ///< the stream can be written to
  readable,  ///< read() has bytes, which it had not before
  writable,  ///< write() takes bytes again, or all that it took is sent
  closed,    ///< by the device, a failure, or as open_stream() could not be granted; unread bytes stay until
             ///< close_stream()
};

struct UsbEvent {
  UsbEventKind kind{};
  UsbStreamKey stream = 0;
  Error reason = {};  ///< closed only; ErrorCode::none when the device closed the stream in good order
};

/// A bulk OUT transfer to post. `bytes` (none for the first one) stay where they are until handle_written().
struct UsbWrite {
  std::size_t slot = 0;
  ByteSpan bytes;
};
/// A bulk IN transfer to post. `into` stays where it is until handle_read().
struct UsbRead {
  std::size_t slot = 0;
  std::span<std::uint8_t> into;
};

enum class UsbLinkState : std::uint8_t {
  starting,
  running,
  closing,  ///< tells the device to drop all streams; new streams need a new link
  closed,
};

class UsbLink {
 public:
  static constexpr std::size_t slots = 4;  ///< transfers posted at once in each direction

  UsbLink(UsbPipes pipes, std::uint8_t interface, UsbLinkOptions options = {});
  UsbLink(const UsbLink&) = delete;
  UsbLink& operator=(const UsbLink&) = delete;

  // --- told ---

  /// The request that poll_control() gave has ended.
  void handle_control(UsbStatus status, ByteSpan data);
  void handle_written(std::size_t slot, UsbStatus status, std::size_t bytes);
  void handle_read(std::size_t slot, UsbStatus status, std::size_t bytes, TimePoint now);
  void handle_timeout(TimePoint now);

  // --- asked ---

  /// Ends in the event opened or closed.
  UsbStreamKey open_stream();
  /// Takes as much of `bytes` as there is room for. Returns the number taken; 0 also when the stream is not open.
  std::size_t write(UsbStreamKey key, ByteSpan bytes);
  /// Takes what was received. Returns the number of bytes, 0 when there are none.
  std::size_t read(UsbStreamKey key, std::span<std::uint8_t> into);
  /// Has to be called once for each stream, closed ones too; what is unsent is dropped. The last one closes the link.
  void close_stream(UsbStreamKey key);
  /// Closes all streams with `reason`.
  void close(Error reason);

  // --- answers ---

  /// The next control request; carried out one at a time.
  std::optional<UsbControl> poll_control();
  std::optional<UsbWrite> poll_write();
  std::optional<UsbRead> poll_read();
  TimePoint poll_timeout() const { return read_deadline_; }
  std::optional<UsbEvent> poll_event();

  // --- looked at ---

  UsbLinkState state() const { return state_; }
  bool is_open(UsbStreamKey key) const;
  /// Everything that write() took has reached the device.
  bool is_sent(UsbStreamKey key) const;
  std::size_t unread_bytes(UsbStreamKey key) const;
  /// What write() took and no transfer carries yet.
  std::size_t unsent_bytes(UsbStreamKey key) const;
  std::size_t stream_count() const { return streams_.size(); }

 private:
  /// Bytes first in, first out.
  class Fifo {
   public:
    std::size_t size() const { return bytes_.size() - begin_; }
    void push(ByteSpan bytes);
    std::size_t pop(std::span<std::uint8_t> into);
    void clear() { bytes_.clear(), begin_ = 0; }

   private:
    Bytes bytes_;
    std::size_t begin_ = 0;
  };

  enum class StreamState : std::uint8_t { waiting, connecting, open, closed };
  struct Stream {
    StreamState state = StreamState::waiting;
    std::int32_t id = 0;  ///< the device's, when open
    bool is_paused = false;
    std::size_t writes_posted = 0;
    Fifo unsent;
    Fifo unread;
  };
  struct Slot {
    Bytes buffer;
    std::size_t size = 0;  ///< bytes of a write
    bool is_posted = false;
    UsbStreamKey stream = 0;
  };
  enum class Request : std::uint8_t { none, reset, select_protocol, connect, close_stream, final_reset };

  UsbControl make_control(Request request);
  void handle_connected(UsbStatus status, ByteSpan data);
  void handle_sub_packet(ByteSpan transfer, TimePoint now);
  void handle_notice(UsbStreamKey key, Stream& stream, std::uint16_t code);
  void end_stream(UsbStreamKey key, Stream& stream, Error reason);
  void fail(Error reason, bool is_gone);
  void update_read_deadline(TimePoint now);
  bool has_stale_writes() const;
  bool is_reading_stalled() const;
  UsbStreamKey find(std::int32_t id) const;

  UsbPipes pipes_;
  std::uint8_t interface_;
  UsbLinkOptions options_;
  UsbLinkState state_ = UsbLinkState::starting;
  Request request_ = Request::none;  ///< posted, not answered
  Request next_request_ = Request::reset;
  bool wants_resync_ = false;  ///< the empty write between reset and protocol
  std::map<UsbStreamKey, Stream> streams_;
  std::map<std::int32_t, UsbStreamKey> keys_;  ///< open streams by the device's id
  std::deque<UsbStreamKey> to_connect_;
  std::deque<std::int32_t> to_close_;
  UsbStreamKey connecting_ = 0;  ///< 0 also when nobody wants the stream any more
  UsbStreamKey last_key_ = 0;
  UsbStreamKey last_served_ = 0;  ///< writes go round from here
  std::array<Slot, slots> writes_;
  std::array<Slot, slots> reads_;
  TimePoint read_deadline_ = TimePoint::max();
  std::deque<UsbEvent> events_;
};

}  // namespace rr
