// A WebSocket of text messages from accepting it to closing it. Layer: server/socket.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>

#include "node/transport/websocket_messages.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/limits/outbox.hpp"

namespace rrgate {

/// One socket: reads in one coroutine, writes in another, pings a client that is silent.
class MessageSocket : public std::enable_shared_from_this<MessageSocket> {
 public:
  /// `stream` has just carried the 101 response. `memory`  is where a message that comes is counted.
  MessageSocket(std::unique_ptr<rr::ByteStream> stream, std::size_t max_message_bytes, MemoryBudget::Charge memory);

  /// What is put in here is sent.
  const std::shared_ptr<Outbox>& outbox() const { return outbox_; }
  /// Hands each message to `take` until the socket ends. `stopped`  is called once, as soon as nothing more is to come.
  /// Returns  why it ended.
  rr::awaitable<std::string> run(std::function<rr::awaitable<void>(const std::string&)> take,
                                 std::function<void()> stopped);
  /// Ends it soon.
  void stop(rr::EndReason reason);

 private:
  static rr::awaitable<void> write_all(std::shared_ptr<MessageSocket> self);

  std::unique_ptr<rr::ByteStream> stream_;
  MemoryBudget::Charge memory_;
  rr::WebSocketMessages messages_;
  std::shared_ptr<Outbox> outbox_;
  std::function<void()> stopped_;
  rr::EndReason reason_;
  bool is_over_ = false;
  bool is_written_ = false;
  boost::asio::steady_timer written_;  ///< cancelled when the writing coroutine has ended
};

}  // namespace rrgate
