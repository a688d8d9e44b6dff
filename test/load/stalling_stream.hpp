// A stream whose reader stops reading, as a program does that hangs or a laptop that sleeps. Test of load.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <memory>

#include "node/transport/byte_stream.hpp"

class StallingStream final : public rr::ByteStream {
 public:
  explicit StallingStream(std::unique_ptr<rr::ByteStream> inner)
      : inner_(std::move(inner)), resumed_(inner_->executor(), boost::asio::steady_timer::time_point::max()) {}

  void stall() { is_stalled_ = true; }
  void resume() {
    is_stalled_ = false;
    resumed_.cancel();
  }

  rr::awaitable<rr::ReadResult> read_some(std::span<std::uint8_t> into) override {
    while (is_stalled_) co_await resumed_.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
    co_return co_await inner_->read_some(into);
  }
  std::size_t try_write(std::span<const rr::ByteSpan> slices, rr::error_code& error) override {
    return inner_->try_write(slices, error);
  }
  rr::awaitable<rr::error_code> write(std::span<const rr::ByteSpan> slices) override { return inner_->write(slices); }
  void finish_sending() override { inner_->finish_sending(); }
  void cancel() override { inner_->cancel(); }
  rr::awaitable<void> end(const rr::EndReason& reason) override { return inner_->end(reason); }
  void close() override {
    inner_->close();
    resume();
  }
  std::string peer() const override { return inner_->peer(); }
  rr::NodeId verified_peer() const override { return inner_->verified_peer(); }
  boost::asio::any_io_executor executor() override { return inner_->executor(); }

 private:
  std::unique_ptr<rr::ByteStream> inner_;
  boost::asio::steady_timer resumed_;  ///< cancelled by resume()
  bool is_stalled_ = false;
};
