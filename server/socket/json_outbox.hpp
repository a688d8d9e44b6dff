// What waits to be sent on a WebSocket of JSON messages. Layer: server/socket.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "server/limits/memory_budget.hpp"

namespace rrgate {

/// Filled by whoever has something to tell, emptied by the one coroutine that writes. Nothing is lost, except that of a
/// wire's values only the newest waits. For the thread of the executor.
class JsonOutbox {
 public:
  /// `memory`  is where what waits is counted.
  JsonOutbox(const boost::asio::any_io_executor& executor, MemoryBudget::Charge memory)
      : memory_(std::move(memory)), news_(executor) {}

  void add(std::string text);
  /// Takes the place of the message that waits under the same name; `text` is asked for when it is sent.
  void add_newest(const std::string& name, std::function<std::string()> text);
  /// Nothing more is taken.
  void close();

  bool is_empty() const { return waiting_.empty(); }
  /// More waited than may: all of it was dropped for a last message, which says so.
  bool has_overflown() const { return has_overflown_; }
  /// What goes out next, a bounded part of all; to be told of with note_sent().
  std::vector<std::string> take();
  void note_sent();
  /// Cancelled by news.
  boost::asio::steady_timer& news() { return news_; }

 private:
  struct Entry {
    std::string text;
    std::string name;  ///< of what is asked for when it is sent; empty: text is there
  };

  MemoryBudget::Charge memory_;
  std::deque<Entry> waiting_;
  std::map<std::string, std::function<std::string()>> newest_;
  std::size_t bytes_ = 0;      ///< of the texts
  std::size_t in_flight_ = 0;  ///< of what was taken last
  bool has_overflown_ = false;
  bool is_closed_ = false;
  boost::asio::steady_timer news_;
};

}  // namespace rrgate
