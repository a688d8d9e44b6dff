// A device that is a page: the page opens each connection that the gateway wants to it. Layer: server/upstream.
// Source: docs/adr/0013-a-page-as-a-device.md.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "core/support/error.hpp"
#include "node/transport/byte_stream.hpp"

namespace rrgate {

/// Pairs what is asked of a page with the connections that it opens. A page that does not open one in time is silent,
/// which its owner hears. For the thread of the executor.
class PageLink {
 public:
  struct Page {
    /// Asks the page for a connection, which shows `key`.
    std::function<void(const std::string& key)> ask;
    /// It has not opened one in time.
    std::function<void()> silent;
  };
  /// `timeout`  for a connection.
  PageLink(const boost::asio::any_io_executor& executor, std::chrono::milliseconds timeout, Page page)
      : executor_(executor), timeout_(timeout), page_(std::move(page)) {}

  /// A connection to the page: what DialOptions::reach is.
  /// Errors   connection_error: none came in time, too many are being opened, the page is gone.
  static rr::awaitable<rr::Result<std::unique_ptr<rr::ByteStream>>> dial(std::shared_ptr<PageLink> self);
  bool is_awaited(std::string_view key) const { return waiting_.contains(key); }
  /// A connection that has come with `key`. Nobody may wait for it any more: then it is gone.
  void take(std::string_view key, std::unique_ptr<rr::ByteStream> stream);
  /// The page is gone: nothing is asked of it any more.
  void close();
  bool is_closed() const { return is_closed_; }

 private:
  struct Waiting {
    explicit Waiting(const boost::asio::any_io_executor& executor) : timer(executor) {}
    boost::asio::steady_timer timer;  ///< cancelled when the stream is there
    std::unique_ptr<rr::ByteStream> stream;
  };
  static constexpr std::size_t max_waiting = 64;

  boost::asio::any_io_executor executor_;
  std::chrono::milliseconds timeout_;
  Page page_;
  std::map<std::string, std::shared_ptr<Waiting>, std::less<>> waiting_;  ///< by key
  bool is_closed_ = false;
};

/// The pages that are devices now, by the devices' names.
using PageLinks = std::map<std::string, std::shared_ptr<PageLink>, std::less<>>;

}  // namespace rrgate
