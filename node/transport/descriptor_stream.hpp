// What sockets and character devices have in common as streams. Layer: node/transport.
#pragma once

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/container/static_vector.hpp>
#include <chrono>
#include <string>
#include <tuple>
#include <utility>

#include "node/transport/await_tuple.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"

namespace rr {

/// `Descriptor`  of Asio, non-blocking.
template <class Descriptor>
class DescriptorStream : public ByteStream {
 public:
  /// `send_stall`: see ByteStream::write.
  DescriptorStream(Descriptor descriptor, std::string peer, std::chrono::milliseconds send_stall)
      : descriptor_(std::move(descriptor)),
        stall_(descriptor_.get_executor(),
               [this] {
                 is_stalled_ = true;
                 close();
               }),
        send_stall_(send_stall),
        peer_(std::move(peer)) {
    error_code ignored;  // what is gone already shows it at the first read
    descriptor_.non_blocking(true, ignored);
  }

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) final {
    if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
    auto [error, bytes] =
        co_await descriptor_.async_read_some(boost::asio::buffer(into.data(), into.size()), await_tuple);
    if (error == boost::asio::error::eof) error = {};
    if (error && is_stalled_)
      error = boost::asio::error::timed_out;  // as the write says: who hears first does not matter
    co_return ReadResult{error, bytes};
  }

  std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) final {
    return write_now(slices, 0, error);
  }

  awaitable<error_code> write(std::span<const ByteSpan> slices) final {
    const auto cancel_count = cancel_count_;
    std::size_t offset = 0;  // bytes of slices.front() that are written
    while (!slices.empty()) {
      error_code error;
      auto written = write_now(slices, offset, error);
      if (written == 0 && !error && !slices.front().empty()) {
        if (!stall_.is_armed()) stall_.arm(send_stall_);
        std::tie(error) = co_await descriptor_.async_wait(Descriptor::wait_write, await_tuple);
        if (is_stalled_) co_return boost::asio::error::timed_out;
        if (!error && cancel_count != cancel_count_) error = boost::asio::error::operation_aborted;
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

  void cancel() final {
    ++cancel_count_;
    error_code ignored;
    descriptor_.cancel(ignored);
  }

  void close() final {
    error_code ignored;
    descriptor_.close(ignored);
  }
  std::string peer() const final { return peer_; }
  boost::asio::any_io_executor executor() final { return descriptor_.get_executor(); }

 protected:
  Descriptor& descriptor() { return descriptor_; }

 private:
  /// `offset`  bytes of the first slice that are written already.
  std::size_t write_now(std::span<const ByteSpan> slices, std::size_t offset, error_code& error) {
    boost::container::static_vector<boost::asio::const_buffer, 64> buffers;
    std::size_t size = 0;
    for (const auto& slice : slices) {
      if (buffers.size() == buffers.capacity()) break;
      const auto rest = buffers.empty() ? slice.subspan(offset) : slice;
      buffers.emplace_back(rest.data(), rest.size());
      size += rest.size();
    }
    // One slice alone goes by send(), which costs less than sendmsg(), and less even with a copy of few bytes.
    std::array<std::uint8_t, 1024> small;
    if (buffers.size() > 1 && size <= small.size()) {
      boost::asio::buffer_copy(boost::asio::buffer(small), buffers);
      buffers.assign(1, boost::asio::buffer(small.data(), size));
    }
    const auto written = buffers.size() == 1 ? descriptor_.write_some(boost::asio::buffer(buffers.front()), error)
                                             : descriptor_.write_some(buffers, error);
    if (error == boost::asio::error::would_block) error = {};
    return written;
  }

  Descriptor descriptor_;
  Deadline stall_;
  std::chrono::milliseconds send_stall_;
  bool is_stalled_ = false;
  unsigned cancel_count_ = 0;  ///< a write that was between two waits notices cancel() by it
  std::string peer_;
};

}  // namespace rr
