#include "node/service/service_client.hpp"

#include <stdexcept>
#include <variant>

namespace rr {

namespace {

Error generator_has_ended() {
  return make_error(ErrorCode::operation_aborted, "the generator has ended");
}

}  // namespace

ServiceClient::ServiceClient(ClientId id, ServiceClientOwner& owner, ServiceDirectory& directory,
                             ServiceSessionOptions options, std::unique_ptr<ByteStream> stream)
    : SessionDriver(std::move(stream), directory, std::move(options), read_clocks()), id_(id), owner_(&owner) {}

void ServiceClient::send_event(EventPacket& packet) {
  const Now now = read_clocks();
  note_sent(packet.member(), session_.send_event(packet, now));
  settle(now);
}

void ServiceClient::send_wire(WirePacket& packet) {
  const Now now = read_clocks();
  note_sent(packet.member(), session_.send_wire(packet, now));
  settle(now);
}

/// The end of the connection is heard of by itself.
void ServiceClient::note_sent(const MemberDefinition& member, const Result<>& sent) {
  if (sent || sent.error().code == ErrorCode::connection_error || !owner_) return;
  owner_->report(std::string(member_kind_name(member.kind)) + " '" + member.name + "': " + sent.error().message);
}

void ServiceClient::release_path(const std::string& path) {
  leave_wires([&](const PathMember& wire) { return is_within(wire.path, path); });
  session_.release_path(path, read_clocks());
  settle();
}

void ServiceClient::close_service() {
  if (!service_) return close(make_error(ErrorCode::connection_error, "the node stops"));
  session_.close_service(read_clocks());
  settle();
}

void ServiceClient::abandon() {
  cancel_late_calls();
  owner_ = nullptr;
  while (!pipes_.empty()) end_pipe(pipes_.begin()->first, false);
  close(make_error(ErrorCode::connection_error, "the node was destroyed"));
}

bool ServiceClient::handle_event(Now now) {
  auto event = session_.poll_event();
  if (!event) return false;
  if (owner_) std::visit([&](auto& happened) { handle(happened, now); }, *event);
  return true;
}

void ServiceClient::ended() {
  if (owner_) owner_->client_ended(*this);
}

void ServiceClient::handle(Called& called, Now now) {
  const CallId id = called.id;
  const GeneratorId generator = called.generator;
  const auto object = called.object;
  std::optional<Result<Value>> answer;
  auto failure = run_handler(member_kind_name(called.member->kind), called.member->name, [&] {
    if (called.generator != 0)
      answer = answer_generator(called);
    else
      answer = static_cast<Object&>(*object).answer(called, [&] { return begin_late_call(called); });
  });
  if (failure) {
    late_calls_.erase(id);
    generators_.erase(generator);
    answer = std::move(*failure);
  }
  if (!answer) return;
  if (called.kind == CallKind::peek_in)  // the answer has the time that reply() is told
    now.utc = static_cast<Object&>(*object).in_time(*called.member, id_).value_or(now.utc);
  session_.reply(id, *answer, now);
}

// --- answers that come later ---

std::shared_ptr<LateCall> ServiceClient::begin_late_call(const Called& called) {
  auto done = [weak = weak_from_this(), id = called.id](const Result<Value>& answer) {
    if (const auto self = weak.lock()) static_cast<ServiceClient&>(*self).finish_late_call(id, answer);
  };
  using Needed = std::pair<std::shared_ptr<Service>, std::shared_ptr<ServiceObject>>;
  auto call =
      std::make_shared<LateCall>(owner_->thread(), executor(), owner_->blocking_pool(), owner_->find_client(id_),
                                 std::make_shared<const Needed>(service_, called.object), std::move(done));
  late_calls_[called.id] = {call, called.member, called.generator};
  return call;
}

void ServiceClient::finish_late_call(CallId id, const Result<Value>& answer) {
  const auto found = late_calls_.extract(id);
  if (!found) return;
  const auto& member = *found.mapped().member;
  if (owner_ && !answer && is_unhandled(answer.error()))
    owner_->report(describe_failure(member_kind_name(member.kind), member.name, answer.error()));
  const auto generator = found.mapped().generator;
  const bool is_aborted = generator != 0 && !generators_.contains(generator);
  session_.reply(id, is_aborted ? Result<Value>(generator_has_ended()) : answer, read_clocks());
  if (generator != 0) finish_step(generator, answer.has_error());
  settle();
}

void ServiceClient::cancel_late_calls() {
  const auto left = std::exchange(late_calls_, {});
  if (left.empty()) return;
  if (owner_) owner_->blocking_pool().drop(id_);
  for (const auto& [id, late] : left)
    if (const auto call = late.call.lock()) call->cancel();
}

// --- handlers that answer at once ---

template <class F>
std::optional<Error> ServiceClient::run_handler(std::string_view kind, std::string_view name, F&& handler) {
  std::optional<Error> failure;
  const auto outer = owner_->set_current_client(id_);  // its handler may have lost this client
  try {
    handler();
  } catch (...) {
    failure = handler_error(std::current_exception());
  }
  if (!owner_) return failure;
  owner_->set_current_client(outer);
  if (failure && is_unhandled(*failure)) owner_->report(describe_failure(kind, name, *failure));
  return failure;
}

template <class F>
void ServiceClient::notify(std::string_view kind, std::string_view name, F&& handler) {
  const auto failure = run_handler(kind, name, handler);
  if (failure && owner_ && !is_unhandled(*failure)) owner_->report(describe_failure(kind, name, *failure));
}

/// Generators end here when they say so, and in GeneratorEnded when the session does. They take one step at a time.
std::optional<Result<Value>> ServiceClient::answer_generator(Called& called) {
  if (called.kind == CallKind::generator_open) {
    auto opened = static_cast<Object&>(*called.object).open_generator(called);
    if (!opened) return opened.error();
    generators_.emplace(called.generator, RunningGenerator{std::make_shared<const Generator>(std::move(*opened))});
    return Value{};
  }
  const bool is_next = called.kind == CallKind::generator_next;
  const auto found = generators_.find(called.generator);
  if (found == generators_.end())
    return is_next ? Result<Value>(make_error(ErrorCode::invalid_operation, "Invalid generator")) : Value{};
  auto& running = found->second;
  if (running.is_stepping && called.kind != CallKind::generator_abort) {
    running.waiting.push_back(std::move(called));
    return std::nullopt;
  }
  if (is_next && running.generator->start) {
    running.is_stepping = true;
    const auto generator = running.generator;  // it may end meanwhile
    generator->start(called.arguments.empty() ? Value{} : std::move(called.arguments.front()), begin_late_call(called));
    return std::nullopt;
  }
  if (is_next) return take_step(called);
  const auto ended = generators_.extract(found);
  abort_steps(called.generator, ended.mapped());
  const auto& generator = *ended.mapped().generator;
  if (const auto& handler = called.kind == CallKind::generator_close ? generator.close : generator.abort) handler();
  return Value{};
}

Result<Value> ServiceClient::take_step(const Called& called) {
  // Out of the map while it runs: an exception ends it, and the client may go meanwhile.
  auto running = generators_.extract(called.generator);
  auto answer = detail::step_answer(
      running.mapped().generator->next(called.arguments.empty() ? Value{} : called.arguments.front()));
  if (!answer) return answer;
  if (!is_closed())
    generators_.insert(std::move(running));
  else if (owner_)
    abandon_generator(*running.mapped().generator);
  return answer;
}

void ServiceClient::finish_step(GeneratorId id, bool has_failed) {
  const auto found = generators_.find(id);
  if (found == generators_.end()) return;
  found->second.is_stepping = false;
  auto waiting = std::exchange(found->second.waiting, {});
  if (has_failed) generators_.erase(found);
  for (auto& called : waiting)
    if (owner_) handle(called, read_clocks());
}

void ServiceClient::abandon_generator(const Generator& generator) {
  if (generator.abort) notify("a generator's", "abort", generator.abort);
}

/// The step that is under way is answered when its handler has ended, which that of a coroutine does now: so many are
/// in work as the session allows, whatever the client opens and aborts.
void ServiceClient::abort_steps(GeneratorId id, const RunningGenerator& ended) {
  for (const auto& [call_id, late] : late_calls_)
    if (late.generator == id)
      if (const auto call = late.call.lock()) call->cancel();
  for (const auto& waiting : ended.waiting) session_.reply(waiting.id, generator_has_ended(), read_clocks());
}

void ServiceClient::handle(const GeneratorEnded& ended, Now) {
  const auto left = generators_.extract(ended.id);
  if (!left) return;
  abort_steps(ended.id, left.mapped());
  abandon_generator(*left.mapped().generator);
}

void ServiceClient::handle(const ClientConnected& connected, Now) {
  service_ = owner_->find_service(*connected.service);
  if (!service_ || !service_->on_connected_) return;
  const auto handler = service_->on_connected_;  // it may replace itself
  notify("a client of service", service_->name(), [&] { handler(id_); });
}

void ServiceClient::handle(const LoginRequested& login, Now) {
  owner_->judge_login(login, std::static_pointer_cast<ServiceClient>(shared_from_this()));
}

void ServiceClient::handle(const LocksChanged&, Now) {
  if (service_) owner_->locks_changed(*service_);
}

void ServiceClient::handle_locks_changed() {
  session_.handle_locks_changed(read_clocks());
  settle();
}

void ServiceClient::answer_login(LoginId id, Result<AuthenticatedUser> result) {
  session_.answer_login(id, std::move(result), read_clocks());
  settle();
}

void ServiceClient::handle(const WireConnected& connected, Now now) {
  if (const auto [wire, is_new] = wires_.insert({connected.path, connected.member->name}); is_new)
    owner_->follow_wire(id_, *wire);
  const auto& object = static_cast<Object&>(*connected.object);
  const Value* value = object.in_value(*connected.member, id_);
  if (!value) return;
  const auto time = object.in_time(*connected.member, id_).value_or(now.utc);
  WirePacket packet(connected.path, *connected.member, *value, time, now.steady);
  note_sent(packet.member(), session_.send_wire(packet, now));
}

void ServiceClient::handle(const WireReceived& received, Now) {
  notify("wire", received.member->name, [&] { static_cast<Object&>(*received.object).receive_wire(received); });
}

void ServiceClient::handle(const WireDisconnected& disconnected, Now) {
  leave_wires([&](const PathMember& wire) {
    return wire.path == disconnected.path && wire.member == disconnected.member->name;
  });
}

template <class Ended>
void ServiceClient::leave_wires(Ended&& ended) {
  std::erase_if(wires_, [&](const PathMember& wire) {
    const bool has_ended = ended(wire);
    if (has_ended && owner_) owner_->leave_wire(id_, wire);
    return has_ended;
  });
}

// --- pipes ---

void ServiceClient::handle(const PipeConnected& connected, Now now) {
  const PipeEndpoint endpoint({.sender = this,
                               .id = connected.id,
                               .client = id_,
                               .object = connected.object,
                               .member = connected.member,
                               .index = connected.index});
  pipes_.emplace(connected.id, endpoint);
  const auto refusal = run_handler("pipe", connected.member->name, [&] {
    static_cast<Object&>(*connected.object).connect_pipe(*connected.member, endpoint);
  });
  if (!refusal) return session_.accept_pipe(connected.id, now);
  session_.refuse_pipe(connected.id, *refusal, now);
  close_pipe(connected.id);  // where the handler has sent something, which lets the client in
}

void ServiceClient::handle(const PipeReceived& received, Now) {
  const auto found = pipes_.find(received.id);
  if (found == pipes_.end()) return;
  const PipeEndpoint endpoint = found->second;  // the handler may close it
  const auto& member = *endpoint.state_->member;
  notify("pipe", member.name, [&] {
    auto& object = static_cast<Object&>(*endpoint.state_->object);
    if (auto fits = object.receive_packet(member, endpoint, received.value); !fits)
      throw std::invalid_argument(fits.error().message);
  });
}

void ServiceClient::handle(const PipeAcknowledged& acknowledged, Now) {
  if (const auto found = pipes_.find(acknowledged.id); found != pipes_.end())
    found->second.acknowledge(acknowledged.numbers);
}

void ServiceClient::handle(const PipeClosed& closed, Now) {
  end_pipe(closed.id, true);
}

Result<std::uint32_t> ServiceClient::send_pipe_packet(PipeId id, const Value& value) {
  auto sent = session_.send_pipe_packet(id, value, read_clocks());
  settle();
  return sent;
}

Result<std::uint32_t> ServiceClient::send_pipe_packet(PipeId id, SharedPipePacket& packet) {
  auto sent = session_.send_pipe_packet(id, packet, read_clocks());
  settle();
  return sent;
}

void ServiceClient::close_pipe(PipeId id) {
  session_.close_pipe(id, read_clocks());
  end_pipe(id, false);
  settle();
}

void ServiceClient::end_pipe(PipeId id, bool tells_handler) {
  auto found = pipes_.extract(id);
  if (!found) return;
  const auto& state = *found.mapped().state_;
  found.mapped().state_->sender = nullptr;
  // The endpoint, which handlers may keep, keeps its object no longer.
  const auto object = std::exchange(found.mapped().state_->object, nullptr);
  const auto close = [&] { static_cast<Object&>(*object).close_pipe(*state.member, found.mapped(), tells_handler); };
  if (tells_handler)
    notify("pipe", state.member->name, close);
  else
    close();
}

// --- callbacks ---

void ServiceClient::call_callback(const std::vector<std::string>& paths, const MemberDefinition& callback,
                                  std::span<const Value> arguments, CallbackDone done) {
  const auto used = std::find_if(paths.begin(), paths.end(), [&](const auto& path) { return session_.uses(path); });
  const auto called = used != paths.end()
                          ? session_.call_callback(*used, callback, arguments, read_clocks())
                          : make_error(ErrorCode::object_not_found,
                                       "callback '" + callback.name + "': the client does not use the object");
  if (called) {
    callbacks_.emplace(*called, CalledCallback{&callback, std::move(done)});
  } else if (done) {
    // Not before the caller has returned: nobody expects an answer in the middle of a call.
    post([this, self = shared_from_this(), name = callback.name, done = std::move(done), error = called.error()] {
      if (owner_) notify("callback", name, [&] { done(error); });
    });
  }
  settle();
}

void ServiceClient::handle(const CallbackCompleted& completed, Now) {
  auto found = callbacks_.extract(completed.id);
  if (!found || !found.mapped().done) return;
  notify("callback", found.mapped().member->name, [&] { found.mapped().done(completed.result); });
}

void ServiceClient::handle(const ClientGone&, Now) {
  cancel_late_calls();
  leave_wires([](const PathMember&) { return true; });
  while (owner_ && !pipes_.empty()) end_pipe(pipes_.begin()->first, true);
  for (const auto& [id, running] : std::exchange(generators_, {}))
    if (owner_) abandon_generator(*running.generator);
  const auto left = std::exchange(service_, nullptr);
  if (left) left->forget_client(id_);
  if (!left || !owner_ || !left->on_gone_) return;
  const auto handler = left->on_gone_;
  notify("a lost client of service", left->name(), [&] { handler(id_); });
}

}  // namespace rr
