// The yardstick of a call: an Asio coroutine that answers a request of known size with a reply of known size.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <cstdint>
#include <thread>
#include <vector>

#include "test/bench/raw_session.hpp"

namespace rr::bench {

/// Serves one connection on a thread of its own, until that connection closes.
class RawEcho {
 public:
  RawEcho(std::size_t request_size, std::size_t reply_size)
      : acceptor_(io_, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0)) {
    boost::asio::co_spawn(io_, serve(request_size, reply_size), boost::asio::detached);
    thread_ = std::thread([this] { io_.run(); });
  }
  ~RawEcho() {
    io_.stop();
    thread_.join();
  }
  RawEcho(const RawEcho&) = delete;
  RawEcho& operator=(const RawEcho&) = delete;

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

 private:
  boost::asio::awaitable<void> serve(std::size_t request_size, std::size_t reply_size) {
    auto socket = co_await acceptor_.async_accept(boost::asio::use_awaitable);
    socket.set_option(tcp::no_delay(true));
    std::vector<std::uint8_t> request(request_size);
    const std::vector<std::uint8_t> reply(reply_size);
    for (;;) {
      co_await boost::asio::async_read(socket, boost::asio::buffer(request), boost::asio::use_awaitable);
      co_await boost::asio::async_write(socket, boost::asio::buffer(reply), boost::asio::use_awaitable);
    }
  }

  boost::asio::io_context io_{1};
  tcp::acceptor acceptor_;
  std::thread thread_;
};

}  // namespace rr::bench
