// Sends one response, whole or while it comes into being. Layer: server/http.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string_view>

#include "node/http/request_reader.hpp"
#include "node/transport/byte_stream.hpp"
#include "server/http/request.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/log/metrics.hpp"

namespace rrgate {

struct ResponseOptions {
  bool closes = false;                                            ///< the connection, in any case
  std::vector<std::pair<std::string, std::string>> headers = {};  ///< of every response of this connection
  /// Set-Cookie of a response that sets none itself, asked for when its head is written. Empty, or returns "": none.
  std::function<std::string()> cookie = {};
  /// For each part of a response, beside what least_rate gives for its bytes. Who reads slower is cut.
  std::chrono::milliseconds patience{15'000};
  bool is_vital = false;       ///< answered also when there is no memory left
  bool is_urgent = false;      ///< it may stop something: no memory left is no reason against largest_urgent bytes
  Metrics* metrics = nullptr;  ///< where responses are counted; null: nowhere
};

/// 503: what clients may make the gateway hold is used up. Counted in `metrics`; null: nowhere.
Response refuse_for_memory(Metrics* metrics);

/// For one request; call either send(), or begin(), write() as often as wanted, and end().
class ResponseWriter {
 public:
  /// `reader`  has read the header of `request` alone. `memory`  is where bodies of requests and responses are counted.
  ResponseWriter(rr::ByteStream& stream, RequestReader& reader, Request& request, MemoryBudget::Charge memory,
                 ResponseOptions options)
      : stream_(stream),
        reader_(reader),
        request_(request),
        memory_(std::move(memory)),
        closes_(options.closes),
        is_vital_(options.is_vital),
        is_urgent_(options.is_urgent),
        metrics_(options.metrics),
        headers_(std::move(options.headers)),
        cookie_(std::move(options.cookie)),
        patience_(options.patience),
        slow_(stream.executor(), [this] { stream_.close(); }) {}

  /// Reads the body into request(), where there is one: when it is clear that the client may do what it asks for.
  /// Returns what to answer instead; nullopt: it is there. Without this the connection ends behind the response.
  rr::awaitable<std::optional<Response>> read_body(std::size_t limit = std::size_t(-1));
  /// Whether so many bytes of its body are taken in any case; see ResponseOptions.
  bool is_urgent(std::size_t bytes) const { return is_urgent_ && bytes <= largest_urgent; }
  /// Why the body could not be read, if so.
  const std::optional<ReadFailure>& body_failure() const { return body_failure_; }

  /// Goes into what is sent from now on.
  void add_header(std::string name, std::string value) { headers_.emplace_back(std::move(name), std::move(value)); }

  /// Called once, with the status, when the response begins.
  void on_begin(std::function<void(unsigned status)> begun) { on_begin_ = std::move(begun); }

  rr::awaitable<rr::error_code> send(const Response& response);

  /// Status and headers; the length stays open. HTTP/1.0 clients see the end by the connection's.
  rr::awaitable<rr::error_code> begin(const Response& head);
  rr::awaitable<rr::error_code> write(std::string_view text);
  /// The same for text in parts, borrowed for the wait; none of it, or all, is empty.
  rr::awaitable<rr::error_code> write(std::span<const std::string_view> parts);
  rr::awaitable<rr::error_code> end();
  /// Instead of end(), where the rest can't be had: the connection breaks off, so that nobody takes it for the whole.
  void break_off() {
    closes_ = true;
    stream_.close();
  }

  /// See ResponseOptions.
  void set_patience(std::chrono::milliseconds patience) { patience_ = patience; }

  /// Calls `on_gone` once when the client ends the connection before unwatch() is done. For streams that may have
  /// nothing to write for long. Between begin() and end().
  void watch(std::function<void()> on_gone);
  rr::awaitable<void> unwatch();

  const Request& request() const { return request_; }
  /// What this request makes the gateway hold.
  MemoryBudget::Charge& memory() { return memory_; }
  /// Asked now and then while the response is a stream: whether the client may still have it.
  void go_on_while(std::function<bool()> is_allowed) { is_allowed_ = std::move(is_allowed); }
  bool may_go_on() const { return !is_allowed_ || is_allowed_(); }
  boost::asio::any_io_executor executor() { return stream_.executor(); }
  /// Whether the connection may carry another request.
  bool goes_on() const { return request_.message.keep_alive() && !closes_ && !reader_.has_unread_body(); }
  /// Whether the whole request is here, and its one response is being made.
  bool is_at_work() const { return !is_streamed_ && !reader_.has_unread_body(); }
  /// A response to HEAD has none.
  bool has_body() const { return request_.message.method() != http::verb::head; }

 private:
  struct Watch;
  static rr::awaitable<void> read_while(std::shared_ptr<Watch> watch, rr::ByteStream& stream);
  std::string head_of(const Response& response) const;
  void note_begin(const Response& response);
  bool make_room(const std::shared_ptr<const std::string>& body);
  rr::awaitable<rr::error_code> write_slices(std::span<const rr::ByteSpan> slices);
  unsigned minor_version() const { return request_.message.version() == 10 ? 0 : 1; }

  rr::ByteStream& stream_;
  RequestReader& reader_;
  Request& request_;
  MemoryBudget::Charge memory_;
  std::optional<ReadFailure> body_failure_;
  bool closes_;
  bool is_vital_;
  bool is_urgent_;
  Metrics* metrics_;
  std::chrono::steady_clock::time_point is_whole_ = std::chrono::steady_clock::now();  ///< the request
  std::vector<std::pair<std::string, std::string>> headers_;
  std::function<std::string()> cookie_;
  std::chrono::milliseconds patience_;
  rr::Deadline slow_;
  std::function<void(unsigned status)> on_begin_;
  std::function<bool()> is_allowed_;
  bool is_streamed_ = false;
  std::shared_ptr<Watch> watch_;
};

}  // namespace rrgate
