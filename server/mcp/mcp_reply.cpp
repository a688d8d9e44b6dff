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
/// Whether who waits still may is looked at so often.
constexpr std::chrono::seconds standing_look_period{1};

}  // namespace

rr::awaitable<void> McpReply::wait(std::chrono::milliseconds longest, const std::function<bool()>& is_there,
                                   const std::string& why) {
  if (is_there()) co_return;
  if (!is_streamed_) {
    Response head;
    head.set("Content-Type", "text/event-stream").set("Cache-Control", "no-store").set("X-Accel-Buffering", "no");
    if (co_await writer_.begin(head)) refuse(rr::ErrorCode::operation_cancelled, "the client has gone");
    is_streamed_ = true;
    writer_.watch([state = state_] {
      state->is_gone = true;
      state->news.cancel();
    });
  }
  const auto begin = std::chrono::steady_clock::now();
  const auto until = begin + longest;
  auto next_comment = begin + mcp_comment_period;
  rr::error_code failed;
  while (!is_there()) {
    const auto now = std::chrono::steady_clock::now();
    if (failed || state_->is_gone) refuse(rr::ErrorCode::operation_cancelled, "the client has gone");
    if (now >= until) refuse(rr::ErrorCode::operation_timeout, why);
    state_->news.expires_at(std::min(until, now + standing_look_period));
    (void)co_await state_->news.async_wait(asio::as_tuple(asio::use_awaitable));
    if (std::chrono::steady_clock::now() < next_comment) continue;
    next_comment += mcp_comment_period;
    failed = co_await writer_.write(": \n\n");
  }
}

rr::awaitable<void> McpReply::send(const rr::OrderedJson& message, unsigned status) {
  const auto text = rr::write_json(message);
  if (!is_streamed_) {
    auto response = json_response(status, text + "\n");
    response.set("Cache-Control", "no-store");
    co_await writer_.send(response);
    co_return;
  }
  const auto event = "event: message\ndata: " + text + "\n\n";
  if (!state_->is_gone && !co_await writer_.write(event)) co_await writer_.end();
  co_await writer_.unwatch();
}

}  // namespace rrgate
