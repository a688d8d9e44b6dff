// What waits to be sent on a WebSocket of JSON messages. Layer: server/socket.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace rrgate {

/// Filled by whoever has something to tell, emptied by the one coroutine that writes. Nothing is lost, except that of a
/// wire's values only the newest waits. For the thread of the executor.
class JsonOutbox {
 public:
  explicit JsonOutbox(const boost::asio::any_io_executor& executor) : news_(executor) {}

  void add(std::string text);
  /// Takes the place of the message that waits under the same name; `text` is asked for when it is sent.
  void add_newest(const std::string& name, std::function<std::string()> text);
  /// Nothing more is taken.
  void close();

  bool is_empty() const { return waiting_.empty(); }
  /// More waited than may: all of it was dropped for a last message, which says so.
  bool has_overflown() const { return has_overflown_; }
  /// What goes out next, a bounded part of all.
  std::vector<std::string> take();
  /// Cancelled by news.
  boost::asio::steady_timer& news() { return news_; }

 private:
  struct Entry {
    std::string text;
    std::string name;  ///< of what is asked for when it is sent; empty: text is there
  };

  std::deque<Entry> waiting_;
  std::map<std::string, std::function<std::string()>> newest_;
  std::size_t bytes_ = 0;  ///< of the texts
  bool has_overflown_ = false;
  bool is_closed_ = false;
  boost::asio::steady_timer news_;
};

}  // namespace rrgate
