// Two byte streams joined in memory: bounded, in pieces as small as wanted. Test support.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <deque>
#include <memory>
#include <utility>

#include "node/transport/byte_stream.hpp"

namespace rr::test {

/// One direction.
struct MemoryPipe {
  MemoryPipe(const boost::asio::any_io_executor& executor, std::size_t room, std::size_t piece)
      : limit(room), largest_read(piece), changed(executor, boost::asio::steady_timer::time_point::max()) {}

  std::size_t limit;         ///< bytes on their way, at most
  std::size_t largest_read;  ///< bytes that one read gives, at most
  std::deque<std::uint8_t> bytes;
  std::size_t carried = 0;
  bool is_ended = false;
  boost::asio::steady_timer changed;  ///< cancelled when something changes
};

class MemoryStream final : public ByteStream {
 public:
  MemoryStream(boost::asio::any_io_executor executor, std::shared_ptr<MemoryPipe> in, std::shared_ptr<MemoryPipe> out)
      : executor_(std::move(executor)), in_(std::move(in)), out_(std::move(out)) {}
  ~MemoryStream() override { close(); }

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override {
    if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
    while (in_->bytes.empty() && !in_->is_ended && !is_closed_)
      co_await in_->changed.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
    if (is_closed_) co_return ReadResult{boost::asio::error::operation_aborted, 0};
    const auto count = std::min({into.size(), in_->bytes.size(), in_->largest_read});
    std::copy_n(in_->bytes.begin(), count, into.begin());
    in_->bytes.erase(in_->bytes.begin(), in_->bytes.begin() + static_cast<std::ptrdiff_t>(count));
    in_->changed.cancel();
    co_return ReadResult{{}, count};
  }
  awaitable<error_code> write(std::span<const ByteSpan> slices) override {
    for (auto slice : slices)
      while (!slice.empty()) {
        while (out_->bytes.size() >= out_->limit && !out_->is_ended && !is_closed_)
          co_await out_->changed.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
        if (is_closed_ || out_->is_ended) co_return boost::asio::error::broken_pipe;
        const auto count = std::min(slice.size(), out_->limit - out_->bytes.size());
        out_->bytes.insert(out_->bytes.end(), slice.begin(), slice.begin() + static_cast<std::ptrdiff_t>(count));
        out_->carried += count;
        out_->changed.cancel();
        slice = slice.subspan(count);
      }
    co_return error_code();
  }
  void finish_sending() override {
    out_->is_ended = true;
    out_->changed.cancel();
  }
  void cancel() override { close(); }
  awaitable<void> end(const EndReason&) override {
    close();
    co_return;
  }
  void close() override {
    is_closed_ = true;
    finish_sending();
    in_->is_ended = true;
    in_->changed.cancel();
  }
  std::string peer() const override { return "memory"; }
  boost::asio::any_io_executor executor() override { return executor_; }

 private:
  boost::asio::any_io_executor executor_;
  std::shared_ptr<MemoryPipe> in_;
  std::shared_ptr<MemoryPipe> out_;
  bool is_closed_ = false;
};

struct MemoryStreams {
  MemoryStreams(const boost::asio::any_io_executor& executor, std::size_t room = 64 * 1024,
                std::size_t piece = 64 * 1024)
      : to_server(std::make_shared<MemoryPipe>(executor, room, piece)),
        to_client(std::make_shared<MemoryPipe>(executor, room, piece)),
        client(std::make_unique<MemoryStream>(executor, to_client, to_server)),
        server(std::make_unique<MemoryStream>(executor, to_server, to_client)) {}

  std::shared_ptr<MemoryPipe> to_server;
  std::shared_ptr<MemoryPipe> to_client;
  std::unique_ptr<ByteStream> client;
  std::unique_ptr<ByteStream> server;
};

}  // namespace rr::test
