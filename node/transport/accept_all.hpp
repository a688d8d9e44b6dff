// The loop below every listener. Layer: node/transport.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <functional>
#include <memory>
#include <string>

#include "node/transport/await_tuple.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

/// Hands every connection to `on_accept` until the acceptor is closed, and what goes wrong meanwhile to `on_problem`.
template <class Acceptor, class OnAccept>
awaitable<void> accept_all(std::shared_ptr<Acceptor> acceptor, OnAccept on_accept,
                           std::function<void(const std::string&)> on_problem) {
  boost::asio::steady_timer pause(acceptor->get_executor());
  while (acceptor->is_open()) {
    auto [error, socket] = co_await acceptor->async_accept(await_tuple);
    if (!acceptor->is_open()) break;  // whom to hand it to is gone as well
    if (!error) {
      on_accept(std::move(socket));
      continue;
    }
    // Out of descriptors or memory: accepting again at once would spin.
    on_problem("accept: " + error.message());
    pause.expires_after(std::chrono::milliseconds(200));
    co_await pause.async_wait(await_tuple);
  }
}

}  // namespace rr
