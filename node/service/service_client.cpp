#include "node/service/service_client.hpp"

#include <exception>
#include <optional>
#include <stdexcept>
#include <variant>

namespace rr {

namespace {

Error error_of(const std::exception& exception) {
  if (const auto* known = dynamic_cast<const Exception*>(&exception)) return known->error();
  return {ErrorCode::remote_error, exception.what(), "rrgate.UnhandledException"};
}

/// As reply() wants it: the end, and whatever else is no value, is an error.
Result<Value> next_value(const Generator& generator, std::span<const Value> arguments) {
  Result<std::optional<Value>> value = std::nullopt;
  try {
    value = generator.next(arguments.empty() ? Value{} : arguments.front());
  } catch (const std::exception& exception) {
    return error_of(exception);
  }
  if (!value) return value.error();
  if (!*value) return make_error(ErrorCode::stop_iteration, {});
  return std::move(**value);
}

}  // namespace

ServiceClient::ServiceClient(ClientId id, ServiceClientOwner& owner, ServiceDirectory& directory,
                             ServiceSessionOptions options, std::unique_ptr<ByteStream> stream)
    : SessionDriver(std::move(stream), directory, std::move(options), read_clocks()), id_(id), owner_(&owner) {}

void ServiceClient::send_event(const std::string& path, const MemberDefinition& event,
                               std::span<const Value> arguments) {
  // The values were checked; what fails now is the connection, and its end is heard of by itself.
  (void)session_.send_event(path, event, arguments, read_clocks());
  settle();
}

void ServiceClient::send_wire(WirePacket& packet) {
  if (!session_.has_wire(packet.path(), packet.member().name)) return;
  const Now now = read_clocks();
  (void)session_.send_wire(packet, now);
  settle(now);
}

void ServiceClient::release_path(const std::string& path) {
  session_.release_path(path, read_clocks());
  settle();
}

void ServiceClient::close_service() {
  if (!service_) return close(make_error(ErrorCode::connection_error, "the node stops"));
  session_.close_service(read_clocks());
  settle();
}

void ServiceClient::abandon() {
  owner_ = nullptr;
  while (!pipes_.empty()) end_pipe(pipes_.begin()->first, false);
  close(make_error(ErrorCode::connection_error, "the node was destroyed"));
}

bool ServiceClient::handle_event(Now now) {
  const auto event = session_.poll_event();
  if (!event) return false;
  if (owner_) std::visit([&](const auto& happened) { handle(happened, now); }, *event);
  return true;
}

void ServiceClient::ended() {
  if (owner_) owner_->client_ended(*this);
}

void ServiceClient::handle(const Called& called, Now now) {
  owner_->set_current_client(id_);
  Result<Value> answer = Value{};
  try {
    answer = called.generator != 0 ? answer_generator(called) : static_cast<Object&>(*called.object).answer(called);
  } catch (const std::exception& exception) {
    answer = error_of(exception);
  }
  if (owner_) owner_->set_current_client(0);
  session_.reply(called.id, answer, now);
}

/// Generators end here when they say so, and in GeneratorEnded when the session does.
Result<Value> ServiceClient::answer_generator(const Called& called) {
  if (called.kind == CallKind::generator_open) {
    auto opened = static_cast<Object&>(*called.object).open_generator(called);
    if (!opened) return opened.error();
    generators_.emplace(called.generator, std::move(*opened));
    return Value{};
  }
  if (called.kind == CallKind::generator_next) {
    const auto found = generators_.find(called.generator);
    if (found == generators_.end()) return make_error(ErrorCode::invalid_operation, "Invalid generator");
    auto value = next_value(found->second, called.arguments);
    if (!value) generators_.erase(found);
    return value;
  }
  auto ended = generators_.extract(called.generator);
  if (ended.empty()) return Value{};
  const auto& handler = called.kind == CallKind::generator_close ? ended.mapped().close : ended.mapped().abort;
  if (handler) handler();
  return Value{};
}

void ServiceClient::abandon_generator(const Generator& generator) {
  if (generator.abort) run_handler("a generator's", "abort", generator.abort);
}

void ServiceClient::handle(const GeneratorEnded& ended, Now) {
  if (const auto left = generators_.extract(ended.id)) abandon_generator(left.mapped());
}

void ServiceClient::handle(const ClientConnected& connected, Now) {
  service_ = owner_->find_service(*connected.service);
  if (service_ && service_->on_connected_) service_->on_connected_(id_);
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
  const Value* value = static_cast<Object&>(*connected.object).in_value(*connected.member);
  if (value) (void)session_.send_wire(connected.path, *connected.member, *value, now);  // checked when it was set
}

template <class F>
void ServiceClient::run_handler(const char* kind, const std::string& member, F&& handler) {
  owner_->set_current_client(id_);
  try {
    handler();
  } catch (const std::exception& exception) {
    if (owner_) owner_->report(std::string(kind) + " '" + member + "': its handler failed: " + exception.what());
  }
  if (owner_) owner_->set_current_client(0);
}

void ServiceClient::handle(const WireReceived& received, Now) {
  run_handler("wire", received.member->name, [&] { static_cast<Object&>(*received.object).receive_wire(received); });
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
  std::optional<Error> refusal;
  owner_->set_current_client(id_);
  try {
    static_cast<Object&>(*connected.object).connect_pipe(*connected.member, endpoint);
  } catch (const std::exception& exception) {
    refusal = error_of(exception);
  }
  if (owner_) owner_->set_current_client(0);
  if (!refusal) return session_.accept_pipe(connected.id, now);
  session_.refuse_pipe(connected.id, *refusal, now);
  close_pipe(connected.id);  // where the handler has sent something, which lets the client in
}

void ServiceClient::handle(const PipeReceived& received, Now) {
  const auto found = pipes_.find(received.id);
  if (found == pipes_.end()) return;
  const PipeEndpoint endpoint = found->second;  // the handler may close it
  const auto& member = *endpoint.state_->member;
  run_handler("pipe", member.name, [&] {
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

Result<std::uint32_t> ServiceClient::send_pipe_packet(PipeId id, const Value& value, bool wants_ack) {
  auto sent = session_.send_pipe_packet(id, value, read_clocks(), wants_ack);
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
    run_handler("pipe", state.member->name, close);
  else
    close();
}

// --- callbacks ---

void ServiceClient::call_callback(const std::string& path, const MemberDefinition& callback,
                                  std::span<const Value> arguments, CallbackDone done) {
  auto called = session_.call_callback(path, callback, arguments, read_clocks());
  if (called) {
    callbacks_.emplace(*called, CalledCallback{&callback, std::move(done)});
  } else {
    // Not before the caller has returned: nobody expects an answer in the middle of a call.
    post([this, self = shared_from_this(), name = callback.name, done = std::move(done), error = called.error()] {
      if (owner_) run_handler("callback", name, [&] { done(error); });
    });
  }
  settle();
}

void ServiceClient::handle(const CallbackCompleted& completed, Now) {
  auto found = callbacks_.extract(completed.id);
  if (!found || !found.mapped().done) return;
  run_handler("callback", found.mapped().member->name, [&] { found.mapped().done(completed.result); });
}

void ServiceClient::handle(const ClientGone&, Now) {
  while (owner_ && !pipes_.empty()) end_pipe(pipes_.begin()->first, true);
  for (const auto& [id, generator] : std::exchange(generators_, {}))
    if (owner_) abandon_generator(generator);
  Service* const left = std::exchange(service_, nullptr);
  if (left && left->on_gone_) left->on_gone_(id_);
}

}  // namespace rr
