#include "server/upstream/value_client.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/session/service_path.hpp"
#include "core/types/value_size.hpp"
#include "node/client/async_object.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// Of one member, for who comes back: so many events, which take so many bytes together.
constexpr std::size_t kept_events = 256;
constexpr std::size_t kept_event_bytes = 4u * 1024 * 1024;
constexpr auto wait_for_news = asio::as_tuple(asio::use_awaitable);
constexpr asio::use_awaitable_t<> await_result;

rr::Error client_has_left() {
  return rr::make_error(rr::ErrorCode::operation_cancelled, "the client has left");
}

/// Calls `begin(complete)` once it is awaited; `complete` takes a Result<Value>, whose error is thrown.
template <class Begin>
auto await_completion(asio::any_io_executor executor, Begin begin) {
  return asio::async_initiate<const asio::use_awaitable_t<>, void(std::exception_ptr, rr::Value)>(
      [executor = std::move(executor), begin = std::move(begin)](auto handler) mutable {
        begin(rr::detail::CompleteOnce<rr::Value, decltype(handler)>(std::move(handler), executor));
      },
      await_result);
}

}  // namespace

ValueClient::ValueClient(std::shared_ptr<Upstream> upstream, Subject user, Device::Seat seat,
                         MemoryBudget::Charge memory)
    : upstream_(std::move(upstream)),
      user_(std::move(user)),
      seat_(std::move(seat)),
      memory_(std::move(memory)),
      changed_(upstream_->device().executor(), asio::steady_timer::time_point::max()) {
  upstream_->add(*this);
}

ValueClient::~ValueClient() {
  leave();
}

void ValueClient::leave() {
  if (std::exchange(has_left_, true)) return;
  for (auto& [key, topic] : topics_) {
    topic.state = TopicState::idle;
    topic.error = client_has_left();
  }
  changed_.cancel();
  upstream_->remove(*this);
}

// --- requests ---

rr::awaitable<rr::Value> ValueClient::find_object(std::string path) {
  return await_completion(upstream_->device().executor(), [self = shared_from_this(), path = std::move(path)](
                                                              auto done) { self->upstream_->find_object(path, done); });
}

rr::awaitable<rr::Value> ValueClient::ask(rr::Called called) {
  return await_completion(upstream_->device().executor(),
                          [self = shared_from_this(), called = std::move(called)](auto done) {
                            self->upstream_->request(*self, called, done);
                          });
}

AccessRequest ValueClient::to_lock(const std::string& path) const {
  return {
      .device = upstream_->device().config().name, .service = upstream_->service(), .path = path, .verb = Verb::lock};
}

AuditEntryPtr ValueClient::begin_lease_end(const std::string& path) const {
  return standing_ ? standing_->begin(to_lock(path), "lease_end") : nullptr;
}

bool ValueClient::may_lock(const std::string& path) const {
  return !needs_right_ || standing_->check(to_lock(path), Recorded::never).has_value();
}

bool ValueClient::may_command(const std::string& path) const {
  return !needs_right_ || standing_->may_command(to_lock(path));
}

rr::awaitable<rr::Value> ValueClient::lock(rr::LockCommand command, std::string path,
                                           std::chrono::milliseconds timeout) {
  rr::LockWanted wanted;
  wanted.id = ++last_id_;
  wanted.command = command;
  wanted.path = std::move(path);
  wanted.timeout = timeout;
  return await_completion(upstream_->device().executor(), [self = shared_from_this(), wanted](auto done) {
    if (self->has_left_) return done(client_has_left());
    self->upstream_->lock(*self, wanted, [done](const rr::Result<>& result) {
      done(result ? rr::Result<rr::Value>(rr::Value()) : result.error());
    });
  });
}

// --- what stays connected ---

rr::awaitable<rr::Result<ValueClient::ListenerPtr>> ValueClient::listen(MemberPlace place, std::uint64_t after,
                                                                        SampleHandler handler) {
  const auto self = shared_from_this();
  const Key key(place.path, place.member->name);
  const auto id = ++last_id_;
  auto kept = std::make_shared<SampleHandler>(std::move(handler));
  auto listener = std::make_unique<Listener>(self, key, id);
  auto& topic = topics_[key];
  // The device may have come back with another definition since the member was joined last.
  if (!topic.place.member || topic.state == TopicState::idle) topic.place = std::move(place);
  const auto kind = topic.place.member->kind;
  const bool is_wire = kind == rr::MemberKind::wire;
  topic.handlers[id] = kept;
  const auto recent = topic.recent;  // handlers may leave
  for (const auto& sample : recent)
    if (is_wire || (after > 0 && sample->number > after)) hand_out(sample, kind, {{id, kept}});
  const auto joined = co_await join(key);
  if (!joined) co_return joined.error();
  co_return listener;
}

rr::Result<ValueClient::ListenerPtr> ValueClient::answer_callback(const MemberPlace& place, CallbackHandler handler) {
  const Key key(place.path, place.member->name);
  if (topics_.contains(key))
    return rr::make_error(rr::ErrorCode::member_busy, rr::quote(place.member->name) + " is answered already");
  auto& topic = topics_[key];
  topic.place = place;
  topic.callback = std::make_shared<CallbackHandler>(std::move(handler));
  return std::make_unique<Listener>(shared_from_this(), key, ++last_id_);
}

rr::awaitable<rr::Result<>> ValueClient::send(MemberPlace place, rr::Value value) {
  const auto self = shared_from_this();
  const Key key(place.path, place.member->name);
  if (topics_.contains(key))
    if (const auto joined = co_await join(key); !joined) co_return joined.error();
  const auto found = topics_.find(key);
  if (found == topics_.end() || found->second.state != TopicState::joined)
    co_return rr::make_error(rr::ErrorCode::invalid_operation, rr::quote(key.second) + " is not connected");
  const auto member = found->second.place;
  if (member.member->kind == rr::MemberKind::wire)
    co_return upstream_->send_wire(*this, member.path, *member.member, value);
  co_return upstream_->send_pipe(*this, found->second.pipe, value, std::nullopt);
}

rr::awaitable<rr::Result<>> ValueClient::join(Key key) {
  if (has_left_) co_return client_has_left();
  const auto is_joining = [&] {
    const auto found = topics_.find(key);
    return found != topics_.end() && found->second.state == TopicState::joining;
  };
  if (const auto found = topics_.find(key); found != topics_.end() && found->second.state == TopicState::idle)
    begin_joining(found->second);
  while (is_joining()) co_await changed_.async_wait(wait_for_news);
  const auto found = topics_.find(key);
  if (found == topics_.end())
    co_return rr::make_error(rr::ErrorCode::operation_cancelled, rr::quote(key.second) + " is not wanted any more");
  if (found->second.state == TopicState::joined) co_return rr::Result<>();
  co_return found->second.error;
}

void ValueClient::begin_joining(Topic& topic) {
  const auto& member = *topic.place.member;
  topic.state = TopicState::joining;
  if (member.kind == rr::MemberKind::event) {
    topic.state = TopicState::joined;  // events of objects that were found come by themselves
  } else if (member.kind == rr::MemberKind::wire) {
    upstream_->join_wire(*this, topic.place.path, member);
  } else {
    topic.pipe = ++last_pipe_;
    pipes_[topic.pipe] = {topic.place.path, member.name};
    upstream_->join_pipe(*this, topic.pipe, topic.place.path, member);
  }
}

void ValueClient::joined(const Key& key, const rr::Result<>& result) {
  const auto found = topics_.find(key);
  if (found == topics_.end()) return;
  auto& topic = found->second;
  if (!result && topic.state == TopicState::joined)
    return closed(key, result.error());  // its listeners are to hear of it
  topic.state = result ? TopicState::joined : TopicState::idle;
  if (!result) topic.error = result.error();
  changed_.cancel();
  if (result && std::exchange(topic.is_lost, false)) tell(key, nullptr);
}

void ValueClient::closed(const Key& key, const rr::Error& reason) {
  const auto found = topics_.find(key);
  if (found == topics_.end() || found->second.state == TopicState::idle) return;
  if (found->second.state == TopicState::joining) return joined(key, reason);  // it is not answered any more
  found->second.state = TopicState::idle;
  found->second.error = reason;
  forget_value(found->second);
  tell(key, &reason);
}

void ValueClient::tell(const Key& key, const rr::Error* error) {
  const auto found = topics_.find(key);
  if (found == topics_.end()) return;
  const auto handlers = found->second.handlers;  // they may leave
  for (const auto& [id, handler] : handlers) (*handler)(nullptr, error);
}

void ValueClient::publish(const Key& key, Sample sample) {
  const auto found = topics_.find(key);
  if (found == topics_.end()) return;
  auto& topic = found->second;
  const auto kind = topic.place.member->kind;
  sample.number = ++topic.last_number;
  for (const auto& value : sample.values) sample.bytes += rr::held_bytes(value);
  const auto shared = std::make_shared<const Sample>(std::move(sample));
  if (kind != rr::MemberKind::pipe) keep(topic, shared);
  const auto handlers = topic.handlers;  // they may leave
  hand_out(shared, kind, handlers);
}

/// Only a wire's value is handed out later, too: by listeners that skip values, and to who comes anew. The texts of
/// events would be held for nobody.
void ValueClient::hand_out(const SamplePtr& sample, rr::MemberKind kind, const Handlers& handlers) {
  for (const auto& [id, handler] : handlers) (*handler)(sample, nullptr);
  if (kind != rr::MemberKind::wire) sample->texts.reset();
}

/// A wire's newest value in any case; events as long as there is room for them.
void ValueClient::keep(Topic& topic, const SamplePtr& sample) {
  const bool is_wire = topic.place.member->kind == rr::MemberKind::wire;
  const auto most = is_wire ? 1 : kept_events;
  while (topic.recent.size() >= most ||
         (!topic.recent.empty() && topic.recent_bytes + sample->bytes > kept_event_bytes))
    forget_oldest(topic);
  while (!is_wire && !memory_.resize(memory_.bytes() + sample->bytes)) {
    if (topic.recent.empty()) return;
    forget_oldest(topic);
  }
  if (is_wire) memory_.hold(memory_.bytes() + sample->bytes);
  topic.recent.push_back(sample);
  topic.recent_bytes += sample->bytes;
}

/// A wire's value of before is none of now; events did happen.
void ValueClient::forget_value(Topic& topic) {
  if (topic.place.member->kind != rr::MemberKind::wire) return;
  while (!topic.recent.empty()) forget_oldest(topic);
}

void ValueClient::forget_oldest(Topic& topic) {
  const auto bytes = topic.recent.front()->bytes;
  topic.recent.pop_front();
  topic.recent_bytes -= bytes;
  memory_.hold(memory_.bytes() - bytes);
}

void ValueClient::leave(const Key& key, std::uint64_t id) {
  const auto found = topics_.find(key);
  if (found == topics_.end()) return;
  found->second.handlers.erase(id);
  found->second.callback.reset();
  drop_if_unused(key);
}

void ValueClient::drop_if_unused(const Key& key) {
  const auto found = topics_.find(key);
  const auto& topic = found->second;
  if (!topic.handlers.empty() || topic.callback) return;
  const auto place = topic.place;
  const auto pipe = topic.pipe;
  // An event costs the device nothing, and who comes back wants to know what happened meanwhile.
  if (place.member->kind == rr::MemberKind::event) return;
  while (!topic.recent.empty()) forget_oldest(found->second);
  topics_.erase(found);
  changed_.cancel();
  if (place.member->kind == rr::MemberKind::wire) upstream_->leave_wire(*this, place.path, *place.member);
  if (pipes_.erase(pipe) > 0) upstream_->leave_pipe(*this, pipe);
}

// --- what the upstream tells ---

bool ValueClient::may_answer(const std::string& path, const rr::MemberDefinition& callback) const {
  const auto found = topics_.find({path, callback.name});
  return found != topics_.end() && found->second.callback;
}

void ValueClient::call_callback(const std::string& path, const rr::MemberDefinition& callback,
                                std::span<const rr::Value> arguments, rr::ClientConnection::CallbackReply answer) {
  const auto found = topics_.find({path, callback.name});
  if (found == topics_.end() || !found->second.callback)
    return answer(rr::make_error(rr::ErrorCode::invalid_operation, "Callback function not set"));
  const auto handler = found->second.callback;
  (*handler)(arguments, std::move(answer));
}

void ValueClient::receive_event(rr::EventPacket& packet, rr::Now) {
  const auto arguments = packet.arguments();
  publish({std::string(packet.path()), packet.member().name}, Sample{0, {}, {arguments.begin(), arguments.end()}});
}

void ValueClient::receive_wire(rr::WirePacket& packet, rr::Now) {
  publish({std::string(packet.path()), packet.member().name}, Sample{0, packet.time(), {packet.value()}});
}

void ValueClient::answer_wire(const std::string& path, const rr::MemberDefinition& wire, const rr::Result<>& result) {
  joined({path, wire.name}, result);
}

void ValueClient::close_wire(const std::string& path, const rr::MemberDefinition& wire) {
  closed({path, wire.name}, rr::make_error(rr::ErrorCode::invalid_state, "the device closed the wire"));
}

void ValueClient::accept_pipe(rr::PipeId id) {
  if (const auto found = pipes_.find(id); found != pipes_.end()) joined(Key(found->second), {});
}

void ValueClient::refuse_pipe(rr::PipeId id, const rr::Error& error) {
  if (const auto refused = pipes_.extract(id)) joined(refused.mapped(), error);
}

void ValueClient::receive_packet(rr::PipeId id, rr::SharedPipePacket& packet, rr::Now) {
  if (const auto found = pipes_.find(id); found != pipes_.end())
    publish(Key(found->second), Sample{0, {}, {packet.value()}});
}

void ValueClient::close_pipe(rr::PipeId id) {
  if (const auto ended = pipes_.extract(id))
    closed(ended.mapped(), rr::make_error(rr::ErrorCode::invalid_state, "the device closed the pipe"));
}

void ValueClient::release_path(const std::string& path) {
  std::vector<Key> gone;
  for (const auto& [key, topic] : topics_)
    if (rr::is_within(key.first, path)) gone.push_back(key);
  std::erase_if(pipes_, [&](const auto& pipe) { return rr::is_within(pipe.second.first, path); });
  for (const auto& key : gone)
    closed(key, rr::make_error(rr::ErrorCode::invalid_state, "the device has replaced the object"));
}

void ValueClient::connection_lost(const rr::Error& reason) {
  std::vector<Key> lost;
  for (auto& [key, topic] : topics_) {
    forget_value(topic);
    if (!std::exchange(topic.is_lost, true)) lost.push_back(key);
  }
  for (const auto& key : lost) tell(key, &reason);
}

/// Wires and pipes are joined again by the upstream, and answered one by one.
void ValueClient::found_again(const std::string& path) {
  std::vector<Key> back;
  for (auto& [key, topic] : topics_) {
    const auto kind = topic.place.member->kind;
    const bool has_endpoint = kind == rr::MemberKind::wire || kind == rr::MemberKind::pipe;
    if (key.first == path && !has_endpoint && std::exchange(topic.is_lost, false)) back.push_back(key);
  }
  for (const auto& key : back) tell(key, nullptr);
}

}  // namespace rrgate
