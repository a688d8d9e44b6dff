#include "server/upstream/page_link.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/support/random.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

rr::Error failure(std::string what) {
  return rr::make_error(rr::ErrorCode::connection_error, std::move(what));
}

}  // namespace

rr::awaitable<rr::Result<std::unique_ptr<rr::ByteStream>>> PageLink::dial(std::shared_ptr<PageLink> self) {
  if (self->is_closed_) co_return failure("the page is gone");
  if (self->waiting_.size() >= max_waiting) co_return failure("the page is asked for too many connections at once");
  // Nobody but the page learns it, and it is good for one connection.
  const auto key = rr::format_node_id(rr::random_node_id(), rr::NodeIdFormat::dashes);
  const auto waiting = std::make_shared<Waiting>(self->executor_);
  self->waiting_[key] = waiting;
  struct Forget {
    PageLink& link;
    const std::string& key;
    ~Forget() { link.waiting_.erase(key); }  // also when the dialing is given up
  } forget{*self, key};
  waiting->timer.expires_after(self->timeout_);
  self->page_.ask(key);
  while (!waiting->stream && !self->is_closed_) {
    const auto [cancelled] = co_await waiting->timer.async_wait(asio::as_tuple(asio::use_awaitable));
    if (!cancelled) break;
  }
  if (waiting->stream) co_return std::move(waiting->stream);
  if (self->is_closed_) co_return failure("the page is gone");
  asio::post(self->executor_, self->page_.silent);  // which may end all of this
  co_return failure("the page opened no connection within " + std::to_string(self->timeout_.count()) + " ms");
}

void PageLink::take(std::string_view key, std::unique_ptr<rr::ByteStream> stream) {
  const auto found = waiting_.find(key);
  if (found == waiting_.end() || found->second->stream) return;
  found->second->stream = std::move(stream);
  found->second->timer.cancel();
}

void PageLink::close() {
  is_closed_ = true;
  page_ = {};
  for (const auto& [key, waiting] : waiting_) waiting->timer.cancel();
}

}  // namespace rrgate
