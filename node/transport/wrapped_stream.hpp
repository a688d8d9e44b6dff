// A stream by way of another one. Layer: node/transport.
#pragma once

#include <memory>
#include <utility>

#include "node/transport/byte_stream.hpp"

namespace rr {

/// Hands everything on to the stream within: what wraps one overrides what it does itself. Whom the stream within has
/// verified is not told: whoever wraps it says that himself.
class WrappedStream : public ByteStream {
 public:
  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override { return inner_->read_some(into); }
  std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) override {
    return inner_->try_write(slices, error);
  }
  awaitable<error_code> write(std::span<const ByteSpan> slices) override { return inner_->write(slices); }
  void finish_sending() override { inner_->finish_sending(); }
  void cancel() override { inner_->cancel(); }
  awaitable<void> end(const EndReason& reason) override { return inner_->end(reason); }
  void close() override { inner_->close(); }
  std::string peer() const override { return inner_->peer(); }
  std::string peer_reason() const override { return inner_->peer_reason(); }
  boost::asio::any_io_executor executor() override { return inner_->executor(); }

 protected:
  explicit WrappedStream(std::unique_ptr<ByteStream> inner) : inner_(std::move(inner)) {}

  std::unique_ptr<ByteStream> inner_;
};

}  // namespace rr
