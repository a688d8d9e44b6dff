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
  /// The client wants to hear how far it is: each second that it waits it hears of what goes on.
  /// `token`  a string or a number, of its choice.
  void set_progress(rr::OrderedJson token) { progress_ = std::move(token); }
  /// What goes on from now on, in words of the gateway.
  void note(std::string what) { what_ = std::move(what); }
  /// The client has cancelled the request: whoever waits hears it as if the client had gone. Outlives the reply.
  std::function<void()> canceller() const {
    return [state = state_] {
      state->is_gone = true;
      state->news.cancel();
    };
  }
  /// Throws   rr::Exception, operation_cancelled: nobody wants the answer any more.
  void expect_client() const;

  /// Waits until `is_there`, looked at after each call of waker() and each second. False: it was not in time.
  /// Throws   rr::Exception: that of expect_client(); what `is_there` throws.
  rr::awaitable<bool> wait(std::chrono::milliseconds longest, const std::function<bool()>& is_there);
  /// Begins an event stream that answers no message, and that the client may ask for again behind what it has got.
  /// `has_first_event`  with an event that says nothing, so that it can do so from the beginning.
  rr::awaitable<void> begin_resumable(bool has_first_event);
  /// Sends one more message before the answer. `message`  borrowed for the wait.
  rr::awaitable<void> tell(const rr::OrderedJson& message);
  /// Ends a stream without an answer.
  rr::awaitable<void> end();
  /// Ends the reply. `message`  a JSON-RPC response; borrowed for the wait.
  rr::awaitable<void> send(const rr::OrderedJson& message, unsigned status);

 private:
  struct State {
    explicit State(const boost::asio::any_io_executor& executor) : news(executor) {}
    boost::asio::steady_timer news;
    bool is_gone = false;
  };

  rr::awaitable<rr::error_code> begin_stream();
  std::string sign_of_life() const;

  ResponseWriter& writer_;
  std::shared_ptr<State> state_;
  rr::OrderedJson progress_ = nullptr;  ///< the client's token; null: it does not want to know
  std::string what_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point next_sign_ = begin_;
  bool is_streamed_ = false;
  bool is_resumable_ = false;
};

}  // namespace rrgate
