#include "node/subscribe/member_subscription.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "core/types/value_size.hpp"

namespace rr::detail {

namespace asio = boost::asio;

namespace {

template <class Follower>
std::weak_ptr<Follower> weak_of(Follower& follower) {
  return std::static_pointer_cast<Follower>(follower.shared_from_this());
}

}  // namespace

MemberFollower::MemberFollower(std::shared_ptr<SubscriptionCore> core, std::string member, std::string path)
    : core_(std::move(core)), member_(std::move(member)), path_(std::move(path)), waiters_(core_->io_context()) {}

/// Of a subscription that is closed nothing comes any more.
void MemberFollower::start() {
  if (core_->is_closed())
    is_closed_ = true;
  else
    core_->follow(shared_from_this());
}

void MemberFollower::close() {
  if (is_closed_) return;
  const auto keep = shared_from_this();
  core_->unfollow(this);
  end();
}

void MemberFollower::end() {
  if (std::exchange(is_closed_, true)) return;
  received = nullptr;
  failed = nullptr;
  for (const auto& [id, place] : std::exchange(places_, {}))
    if (place.is_connected) disconnect(place);
  waiters_.complete_all(make_error(ErrorCode::invalid_operation, member_ + ": the subscription is closed"));
}

std::size_t MemberFollower::connected_count() const {
  std::size_t count = 0;
  for (const auto& [id, place] : places_) count += place.is_connected ? 1 : 0;
  return count;
}

Result<std::size_t> MemberFollower::send(const Value& value) {
  std::optional<Error> failure;
  std::size_t count = 0;
  const auto self = shared_from_this();
  PlaceId last = 0;  // who is found gone by what is sent is taken out, and others may be
  for (auto next = places_.begin(); next != places_.end(); next = places_.upper_bound(last)) {
    last = next->first;
    const auto& place = next->second;
    if (!place.is_connected) continue;
    const auto connection = place.root.connection();
    if (const auto sent = send_to(place, value))
      ++count;
    else
      failure = sent.error();
  }
  if (count > 0) return count;
  if (failure) return std::move(*failure);
  return make_error(ErrorCode::invalid_operation, member_ + ": is not connected at the moment");
}

std::optional<Waiters<ReceivedValue>::Id> MemberFollower::wait_for_next(
    std::optional<std::chrono::milliseconds> timeout, Waiters<ReceivedValue>::Done done) {
  if (queue_.empty() && !is_closed_) return waiters_.add(std::move(done), timeout, shared_from_this());
  Result<ReceivedValue> result = make_error(ErrorCode::invalid_operation, member_ + ": the subscription is closed");
  if (!queue_.empty()) {
    note_taken(queue_.front());
    result = std::move(queue_.front());
    queue_.pop_front();
  }
  asio::post(core_->io_context(), [done = std::move(done), result = std::move(result)] { done(result); });
  return std::nullopt;
}

void MemberFollower::attach(const AsyncObject& root) {
  if (is_closed_) return;
  const auto id = ++last_place_;
  places_.emplace(id, Place{root, root.path() + path_.substr(1)});
  begin(id);
}

void MemberFollower::detach(const AsyncObject& root) {
  std::erase_if(places_, [&](const auto& place) { return place.second.root.connection() == root.connection(); });
}

void MemberFollower::begin(PlaceId id) {
  const auto found = places_.find(id);
  if (found == places_.end()) return;
  const auto& place = found->second;
  if (path_ == "*") return connect_member(id);
  place.root.connection()->find_object(place.path, [self = shared_from_this(), id](const Result<Value>& object) {
    if (object)
      self->connect_member(id);
    else
      self->handle_failed(id, object.error());
  });
}

void MemberFollower::connect_member(PlaceId id) {
  const auto found = places_.find(id);
  if (found == places_.end()) return;
  const auto request = std::make_shared<RequestId>(0);
  auto connected = [self = shared_from_this(), id, root = found->second.root, path = found->second.path,
                    request](const Result<Value>& result) {
    if (!result) return self->handle_failed(id, result.error());
    const std::int32_t index = result->is_null() ? 0 : result->to<std::int32_t>().value();
    const auto place = self->places_.find(id);
    if (place == self->places_.end()) {
      if (root.connection()->is_closed()) return;
      return self->disconnect(Place{root, path, index, *request, true});
    }
    place->second.index = index;
    place->second.is_connected = true;
  };
  *request = connect(id, found->second, std::move(connected));
  if (const auto place = places_.find(id); place != places_.end()) place->second.request = *request;
}

void MemberFollower::handle_closed(PlaceId id) {
  handle_failed(id, make_error(ErrorCode::invalid_operation, member_ + ": the service closed it"));
}

void MemberFollower::handle_failed(PlaceId id, const Error& error) {
  auto found = places_.find(id);
  if (found == places_.end()) return;
  found->second.is_connected = false;
  const auto keep = shared_from_this();
  if (const auto handler = failed)
    core_->call_handler("failed of " + member_, [&, root = found->second.root] { handler(root, error); });
  found = places_.find(id);
  if (found == places_.end()) return;
  auto& timer = found->second.retry;
  timer = std::make_unique<asio::steady_timer>(core_->io_context(), core_->options().member_retry);
  timer->async_wait([weak = weak_from_this(), id](const error_code& timer_error) {
    const auto self = weak.lock();
    if (!timer_error && self) self->begin(id);
  });
}

void MemberFollower::handle_received(PlaceId id, Value value, TimeSpec time) {
  const auto place = places_.find(id);
  if (place == places_.end()) return;
  const auto self = shared_from_this();
  keep(queue_, ReceivedValue(std::move(value), time, place->second.root));
}

// --- wires ---

RequestId WireFollower::connect(PlaceId id, const Place& place, ClientConnection::Completion done) {
  const auto weak = weak_of(*this);
  place.root.connection()->on_wire_closed(place.path, member(), [weak, id] {
    if (const auto self = weak.lock()) self->handle_closed(id);
  });
  auto received_value = [weak, id](const Value& value, TimeSpec time) {
    if (const auto self = weak.lock()) self->handle_received(id, value, time);
  };
  return place.root.connection()->connect_wire(place.path, member(), std::move(received_value), std::move(done));
}

void WireFollower::disconnect(const Place& place) {
  // Another subscription may have connected it since.
  place.root.connection()->end_wire(place.path, member(), place.request);
}

Result<> WireFollower::send_to(const Place& place, const Value& value) {
  return place.root.connection()->send_wire(place.path, member(), value);
}

void WireFollower::keep(std::deque<ReceivedValue>&, ReceivedValue value) {
  newest = value;
  if (const auto handler = received) handler(value);
  if (!is_closed()) waiters().complete_all(std::move(value));
}

// --- pipes ---

RequestId PipeFollower::connect(PlaceId id, const Place& place, ClientConnection::Completion done) {
  const auto weak = weak_of(*this);
  ClientConnection::PipeHandlers handlers;
  handlers.received = [weak, id](Value packet) {
    if (const auto self = weak.lock()) self->handle_received(id, std::move(packet), {});
  };
  handlers.closed = [weak, id] {
    if (const auto self = weak.lock()) self->handle_closed(id);
  };
  return place.root.connection()->connect_pipe(place.path, member(), any_pipe_index, std::move(handlers),
                                               std::move(done));
}

void PipeFollower::disconnect(const Place& place) {
  place.root.connection()->disconnect_pipe(place.path, member(), place.index, nullptr);
}

Result<> PipeFollower::send_to(const Place& place, const Value& value) {
  return place.root.connection()->send_pipe(place.path, member(), place.index, value);
}

void PipeFollower::keep(std::deque<ReceivedValue>& queue, ReceivedValue value) {
  if (const auto handler = received) return handler(value);
  if (!waiters().is_empty()) return waiters().complete_first(std::move(value));
  bytes_ += held_bytes(value.value);
  queue.push_back(std::move(value));
  while (queue.size() > packet_limit_ || (queue.size() > 1 && bytes_ > byte_limit_)) {
    note_taken(queue.front());
    queue.pop_front();
    ++dropped;
  }
}

void PipeFollower::note_taken(const ReceivedValue& value) {
  bytes_ -= held_bytes(value.value);
}

}  // namespace rr::detail
