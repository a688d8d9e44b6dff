// A byte stream whose peer says what it was given, in pieces, whatever it is sent.
#pragma once

#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>

#include "node/transport/byte_stream.hpp"

namespace rr::fuzz {

/// Never waits: what runs on it is done after one poll() of the io_context.
class ScriptedStream : public ByteStream {
 public:
  ScriptedStream(boost::asio::io_context& io, std::string input, std::size_t piece)
      : executor_(io.get_executor()), input_(std::move(input)), piece_(piece) {}

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override {
    if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
    if (is_closed_) co_return ReadResult{boost::asio::error::operation_aborted, 0};
    const auto count = std::min({into.size(), input_.size() - read_, piece_});
    std::copy_n(input_.begin() + static_cast<std::ptrdiff_t>(read_), count, into.begin());
    read_ += count;
    co_return ReadResult{{}, count};
  }
  awaitable<error_code> write(std::span<const ByteSpan> slices) override {
    std::string text;
    for (const auto slice : slices) text += as_text(slice);
    handle_written(text);
    co_return error_code();
  }
  void finish_sending() override {}
  void cancel() override {}
  awaitable<void> end(const EndReason&) override {
    close();
    co_return;
  }
  void close() override { is_closed_ = true; }
  std::string peer() const override { return "script"; }
  boost::asio::any_io_executor executor() override { return executor_; }

 protected:
  virtual void handle_written(const std::string& text) { static_cast<void>(text); }
  std::string& input() { return input_; }

 private:
  boost::asio::any_io_executor executor_;
  std::string input_;
  std::size_t piece_;
  std::size_t read_ = 0;
  bool is_closed_ = false;
};

}  // namespace rr::fuzz
