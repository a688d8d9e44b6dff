// A byte stream to one peer, whatever carries it. Layer: node/transport.
#pragma once

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/system/error_code.hpp>
#include <cstdint>
#include <span>
#include <string>

#include "core/support/bytes.hpp"
#include "core/support/node_id.hpp"

namespace rr {

using boost::asio::awaitable;
using boost::system::error_code;

/// What a read came to. No error and no bytes: the peer has ended its side in good order.
struct ReadResult {
  error_code error;
  std::size_t bytes = 0;

  bool is_end() const { return !error && bytes == 0; }
};

/// Why a connection ends, for peers that can be told. `code` is a WebSocket close code (RFC 6455, 7.4.1).
struct EndReason {
  std::uint16_t code = 1000;
  std::string text;  ///< at most 123 bytes of it are sent
};

inline const EndReason no_reason{};

/// One reader and one writer at a time; both may wait at once. Used from one thread.
class ByteStream {
 public:
  ByteStream() = default;
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;
  virtual ~ByteStream() = default;

  /// Waits for at least one byte. `into` is not empty and outlives the wait. Errors: also timed_out, as of write().
  virtual awaitable<ReadResult> read_some(std::span<std::uint8_t> into) = 0;

  /// Writes as much of the slices as goes without waiting.
  /// Returns  bytes written; 0 without an error when write() has to be waited for, which some transports always want.
  virtual std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) {
    static_cast<void>(slices);
    error = {};
    return 0;
  }

  /// Writes all slices in order, in as few system calls as they need. They outlive the wait.
  /// Errors   timed_out: the peer took nothing for the stall time; then the stream is closed.
  virtual awaitable<error_code> write(std::span<const ByteSpan> slices) = 0;

  /// Ends our side; the peer's side can still be read where the transport has half-closed streams.
  virtual void finish_sending() = 0;

  /// Pending reads and writes fail with operation_aborted; the stream stays open.
  virtual void cancel() = 0;

  /// Ends in good order: tells the reason where peer and transport take one, then waits, for a bounded time, until the
  /// peer has taken what was sent. `reason` outlives the wait. No other operation may be pending.
  virtual awaitable<void> end(const EndReason& reason) = 0;

  /// Closes at once; pending reads and writes fail.
  virtual void close() = 0;

  /// Address of the peer for logs ("127.0.0.1:40000").
  virtual std::string peer() const = 0;
  /// The node that the peer has proved to be by its certificate; any without such a proof.
  virtual NodeId verified_peer() const { return {}; }
  /// Why the peer has ended its side, in words for people, where it has said so; else empty.
  virtual std::string peer_reason() const { return {}; }
  virtual boost::asio::any_io_executor executor() = 0;

  /// The next reads return these bytes first: what was read to find out which protocol the peer speaks.
  void put_back(ByteSpan bytes) { put_back_.insert(put_back_.begin(), bytes.begin(), bytes.end()); }

 protected:
  /// What was put back, for read_some() to begin with. Returns 0 when nothing is left.
  std::size_t take_put_back(std::span<std::uint8_t> into) {
    const auto count = std::min(into.size(), put_back_.size());
    std::copy_n(put_back_.begin(), count, into.begin());
    put_back_.erase(put_back_.begin(), put_back_.begin() + static_cast<std::ptrdiff_t>(count));
    if (put_back_.empty()) put_back_ = Bytes();  // nothing comes back later
    return count;
  }

 private:
  Bytes put_back_;
};

}  // namespace rr
