// A stream whose reader stops reading, as a program does that hangs or a laptop that sleeps. Test of load.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <memory>

#include "node/transport/wrapped_stream.hpp"

class StallingStream final : public rr::WrappedStream {
 public:
  explicit StallingStream(std::unique_ptr<rr::ByteStream> inner)
      : WrappedStream(std::move(inner)), resumed_(inner_->executor(), boost::asio::steady_timer::time_point::max()) {}

  void stall() { is_stalled_ = true; }
  void resume() {
    is_stalled_ = false;
    resumed_.cancel();
  }

  rr::awaitable<rr::ReadResult> read_some(std::span<std::uint8_t> into) override {
    while (is_stalled_) co_await resumed_.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
    co_return co_await inner_->read_some(into);
  }
  void close() override {
    inner_->close();
    resume();
  }
  rr::NodeId verified_peer() const override { return inner_->verified_peer(); }

 private:
  boost::asio::steady_timer resumed_;  ///< cancelled by resume()
  bool is_stalled_ = false;
};
