// Work that takes long, beside the gateway's thread. Layer: server/limits.
#pragma once

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <optional>
#include <type_traits>
#include <utility>

#include "node/transport/byte_stream.hpp"

namespace rrgate {

/// A few threads that know nothing of the gateway: they turn what they are given into what they return. Whoever waits
/// for that keeps nobody else waiting. Goes before the io_context does, and waits then for what is at work.
class Workers {
 public:
  Workers() = default;
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  ~Workers() {
    pool_.stop();
    pool_.join();
  }

  /// Calls `work` on one of the threads; what it borrows stays where it is while it is waited for.
  template <class Work>
  rr::awaitable<std::invoke_result_t<Work>> run(Work work) {
    auto working = perform(std::move(work));
    auto result = co_await boost::asio::co_spawn(pool_.get_executor(), std::move(working), boost::asio::use_awaitable);
    co_return std::move(*result);
  }

 private:
  template <class Work>
  static rr::awaitable<std::optional<std::invoke_result_t<Work>>> perform(Work work) {
    co_return work();
  }

  boost::asio::thread_pool pool_{2};
};

}  // namespace rrgate
