// What operations on sockets and timers are awaited with. Layer: node/transport.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace rr {

/// Errors come as values: (error_code, result) = co_await operation(..., await_tuple).
inline constexpr auto await_tuple = boost::asio::as_tuple(boost::asio::use_awaitable);

}  // namespace rr
