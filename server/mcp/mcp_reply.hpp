// The answer to one request of the Model Context Protocol: a document, or an event stream once it has to wait.
// Layer: server/mcp.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>

#include "server/http/response_writer.hpp"
#include "server/json/json.hpp"

namespace rrgate {

class McpReply {
 public:
  explicit McpReply(ResponseWriter& writer) : writer_(writer), state_(std::make_shared<State>(writer.executor())) {}

  ResponseWriter& writer() const { return writer_; }
  const Request& request() const { return writer_.request(); }

  /// Something that is waited for may have come. Outlives the reply.
  std::function<void()> waker() const {
    return [state = state_] { state->news.cancel(); };
  }
  /// Waits until `is_there`, looked at after each call of waker() and each second.
  /// Throws   rr::Exception: operation_timeout, with `why`; operation_cancelled: the client has gone; what `is_there`
  /// throws.
  rr::awaitable<void> wait(std::chrono::milliseconds longest, const std::function<bool()>& is_there,
                           const std::string& why);
  /// Ends the reply. `message`  a JSON-RPC response; borrowed for the wait.
  rr::awaitable<void> send(const rr::OrderedJson& message, unsigned status);

 private:
  struct State {
    explicit State(const boost::asio::any_io_executor& executor) : news(executor) {}
    boost::asio::steady_timer news;
    bool is_gone = false;
  };

  ResponseWriter& writer_;
  std::shared_ptr<State> state_;
  bool is_streamed_ = false;
};

}  // namespace rrgate
