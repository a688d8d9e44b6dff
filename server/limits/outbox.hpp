// What waits to be sent to a client of a WebSocket of JSON messages, or of an event stream. Layer: server/limits.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/limits/memory_budget.hpp"

namespace rrgate {

/// Filled by whoever has something to tell, emptied by the one coroutine that writes. Nothing is lost, except that of a
/// wire's values only the newest waits. For the thread of the executor.
class Outbox {
 public:
  /// Names what a client has opened, whatever else has had its id before, or has it later.
  using Token = std::uint64_t;

  /// `memory`  is where what waits is counted. `too_slow`  the last message of one that has overflown.
  Outbox(const boost::asio::any_io_executor& executor, MemoryBudget::Charge memory, std::string too_slow)
      : memory_(std::move(memory)), too_slow_(std::move(too_slow)), news_(executor) {}

  /// What is opened may have messages, until forget().
  Token begin();
  /// Nothing of it is taken any more, and no value of it waits.
  void forget(Token of);

  void add(std::string text);
  /// A message of what was opened. A value that waits is dropped: it would come to be after this, once it is replaced.
  void add(Token of, std::string text);
  /// A wire's value. It takes the place of one that waits, and `text` is asked for when it is sent. `bytes`  that
  /// `text` keeps until then.
  void add_newest(Token of, std::size_t bytes, std::function<std::string()> text);
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
    Token of = 0;  ///< whose newest value is asked for when it is sent; 0: text is there
    std::size_t kept_bytes = 0;
    std::function<std::string()> newest;
  };
  using Entries = std::list<Entry>;

  void drop_newest(Token of);
  void clear();
  void count();

  MemoryBudget::Charge memory_;
  std::string too_slow_;
  Entries waiting_;
  std::map<Token, Entries::iterator> opened_;  ///< and where the newest value waits; the end: none does
  Token last_token_ = 0;
  std::size_t bytes_ = 0;       ///< of the texts
  std::size_t kept_bytes_ = 0;  ///< of values whose text is not there yet
  std::size_t in_flight_ = 0;   ///< of what was taken last
  bool has_overflown_ = false;
  bool is_closed_ = false;
  boost::asio::steady_timer news_;
};

/// What a client has opened at an outbox, for as long as this lives.
class OutboxOpening {
 public:
  explicit OutboxOpening(std::shared_ptr<Outbox> outbox) : outbox_(std::move(outbox)), token_(outbox_->begin()) {}
  ~OutboxOpening() { outbox_->forget(token_); }
  OutboxOpening(const OutboxOpening&) = delete;
  OutboxOpening& operator=(const OutboxOpening&) = delete;

  Outbox::Token token() const { return token_; }

 private:
  std::shared_ptr<Outbox> outbox_;
  Outbox::Token token_;
};

}  // namespace rrgate
