#include "server/mcp/mcp_reply.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/http/endpoints/refusal.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// A reply that waits gets a comment so often: clients and proxies see that it lives.
constexpr std::chrono::seconds mcp_comment_period{10};
/// And a client that wants to know how far it is hears it so often.
constexpr std::chrono::seconds progress_period{1};
/// Whether who waits still may is looked at so often.
constexpr std::chrono::seconds standing_look_period{1};

/// Nothing is kept by it: that there is one says that the client has been there before.
std::string event_id() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return "id: " + std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(now).count()) + "\n";
}

std::string event_of(const rr::OrderedJson& message) {
  return "event: message\ndata: " + rr::write_json(message) + "\n\n";
}

}  // namespace

void McpReply::expect_client() const {
  if (state_->is_gone) refuse(rr::ErrorCode::operation_cancelled, "the client has gone, or has cancelled it");
}

rr::awaitable<rr::error_code> McpReply::begin_stream() {
  Response head;
  head.set("Content-Type", "text/event-stream").set("Cache-Control", "no-store").set("X-Accel-Buffering", "no");
  const auto failed = co_await writer_.begin(head);
  if (failed) co_return failed;
  is_streamed_ = true;
  writer_.watch(canceller());
  co_return failed;
}

std::string McpReply::sign_of_life() const {
  if (progress_.is_null()) return ": \n\n";
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin_;
  auto params = rr::OrderedJson::object();
  rr::add_key(params, "progressToken") = progress_;
  rr::add_key(params, "progress") = passed.count();
  if (!what_.empty()) rr::add_key(params, "message") = what_;
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "jsonrpc") = "2.0";
  rr::add_key(out, "method") = "notifications/progress";
  rr::add_key(out, "params") = std::move(params);
  return event_of(out);
}

rr::awaitable<bool> McpReply::wait(std::chrono::milliseconds longest, const std::function<bool()>& is_there) {
  if (is_there()) co_return true;
  expect_client();
  if (!is_streamed_ && co_await begin_stream()) state_->is_gone = true;
  const auto period = progress_.is_null() ? mcp_comment_period : progress_period;
  const auto until = std::chrono::steady_clock::now() + longest;
  next_sign_ = std::max(next_sign_, begin_ + period);
  while (!is_there()) {
    expect_client();
    const auto now = std::chrono::steady_clock::now();
    if (now >= until) co_return false;
    state_->news.expires_at(std::min(until, now + standing_look_period));
    (void)co_await state_->news.async_wait(asio::as_tuple(asio::use_awaitable));
    if (std::chrono::steady_clock::now() < next_sign_) continue;
    next_sign_ = std::chrono::steady_clock::now() + period;
    const auto sign = sign_of_life();
    if (co_await writer_.write(sign)) state_->is_gone = true;
  }
  co_return true;
}

rr::awaitable<void> McpReply::tell(const rr::OrderedJson& message) {
  if (!is_streamed_ && co_await begin_stream()) state_->is_gone = true;
  if (state_->is_gone) co_return;
  const auto event = (is_resumable_ ? event_id() : std::string()) + event_of(message);
  if (co_await writer_.write(event)) state_->is_gone = true;
}

rr::awaitable<void> McpReply::begin_resumable(bool has_first_event) {
  is_resumable_ = true;
  if (co_await begin_stream()) state_->is_gone = true;
  if (!has_first_event || state_->is_gone) co_return;
  const auto event = event_id() + "data: \n\n";
  if (co_await writer_.write(event)) state_->is_gone = true;
}

rr::awaitable<void> McpReply::end() {
  if (!is_streamed_) co_return;
  co_await writer_.end();
  co_await writer_.unwatch();
}

rr::awaitable<void> McpReply::send(const rr::OrderedJson& message, unsigned status) {
  if (!is_streamed_) {
    auto response = json_response(status, rr::write_json(message) + "\n");
    response.set("Cache-Control", "no-store");
    co_await writer_.send(response);
    co_return;
  }
  // One who has cancelled waits for no answer, and for the end of the stream.
  const auto event = state_->is_gone ? std::string() : event_of(message);
  if (event.empty() || !co_await writer_.write(event)) co_await writer_.end();
  co_await writer_.unwatch();
}

}  // namespace rrgate
