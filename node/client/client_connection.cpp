#include "node/client/client_connection.hpp"

#include <boost/container/small_vector.hpp>
#include <iostream>
#include <variant>

#include "core/session/service_path.hpp"
#include "node/client/unread_reply.hpp"
#include "node/values/exception.hpp"

namespace rr {

namespace {

/// With times that the session can add to its clock.
ClientOptions bounded_times(ClientOptions options) {
  for (auto* time : {&options.connect_timeout, &options.request_timeout, &options.connection.heartbeat_period,
                     &options.connection.receive_timeout, &options.connection.handshake_timeout})
    *time = bounded(*time);
  return options;
}

}  // namespace

ClientConnection::ClientConnection(std::unique_ptr<ByteStream> stream, ConnectOptions options, Opened opened)
    : SessionDriver(std::move(stream), bounded_times(std::move(static_cast<ClientOptions&>(options))), read_clocks()),
      report_(std::move(options.report)),
      opened_(std::move(opened)) {}

template <class Ask>
RequestId ClientConnection::expect(Ask&& ask, Completion done) {
  const Now now = read_clocks();
  const RequestId id = ask(now);
  spare_completion_.insert(completions_, id, std::move(done));
  settle(now);
  return id;
}

void ClientConnection::cancel(RequestId id) {
  // One whose answer is about to be handled completes with that.
  if (!session_.has_request(id)) return;
  const auto self = shared_from_this();
  auto found = completions_.extract(id);
  session_.cancel(id);
  settle();
  if (found && found.mapped())
    run_handler("request to", session_.service(),
                [&] { found.mapped()(make_error(ErrorCode::operation_cancelled, "was cancelled")); });
}

void ClientConnection::call(std::string_view path, std::string_view function, std::span<const Value> arguments,
                            Completion done) {
  expect([&](Now now) { return session_.call_function(path, function, arguments, now); }, std::move(done));
}

RequestId ClientConnection::open_generator(std::string_view path, std::string_view function,
                                           std::span<const Value> arguments, Completion done) {
  return expect([&](Now now) { return session_.open_generator(path, function, arguments, now); }, std::move(done));
}

void ClientConnection::next_generator(std::string_view path, std::string_view function, std::int32_t index,
                                      const std::optional<Value>& parameter, Completion done) {
  expect([&](Now now) { return session_.next_generator(path, function, index, parameter, now); }, std::move(done));
}

void ClientConnection::close_generator(std::string_view path, std::string_view function, std::int32_t index,
                                       Completion done) {
  expect([&](Now now) { return session_.close_generator(path, function, index, now); }, std::move(done));
}

void ClientConnection::abort_generator(std::string_view path, std::string_view function, std::int32_t index,
                                       Completion done) {
  expect([&](Now now) { return session_.abort_generator(path, function, index, now); }, std::move(done));
}

void ClientConnection::get_memory_dimensions(std::string_view path, std::string_view memory, Completion done) {
  expect([&](Now now) { return session_.get_memory_dimensions(path, memory, now); }, std::move(done));
}

void ClientConnection::read_memory(std::string_view path, std::string_view memory, const MemoryRange& range,
                                   Completion done) {
  expect([&](Now now) { return session_.read_memory(path, memory, range.position, range.count, now); },
         std::move(done));
}

void ClientConnection::write_memory(std::string_view path, std::string_view memory,
                                    std::span<const std::uint64_t> position, const Value& value, Completion done) {
  expect([&](Now now) { return session_.write_memory(path, memory, position, value, now); }, std::move(done));
}

void ClientConnection::get(std::string_view path, std::string_view property, Completion done) {
  expect([&](Now now) { return session_.get_property(path, property, now); }, std::move(done));
}

void ClientConnection::set(std::string_view path, std::string_view property, const Value& value, Completion done) {
  expect([&](Now now) { return session_.set_property(path, property, value, now); }, std::move(done));
}

void ClientConnection::find_object(std::string_view path, Completion done) {
  expect([&](Now now) { return session_.find_object(path, now); }, std::move(done));
}

void ClientConnection::peek_in(std::string_view path, std::string_view wire, Completion done) {
  expect([&](Now now) { return session_.peek_in_value(path, wire, now); }, std::move(done));
}

void ClientConnection::peek_out(std::string_view path, std::string_view wire, Completion done) {
  expect([&](Now now) { return session_.peek_out_value(path, wire, now); }, std::move(done));
}

void ClientConnection::poke_out(std::string_view path, std::string_view wire, const Value& value, Completion done) {
  expect([&](Now now) { return session_.poke_out_value(path, wire, value, now); }, std::move(done));
}

RequestId ClientConnection::connect_wire(std::string_view path, std::string_view wire, WireHandler handler,
                                         Completion done) {
  const MemberKey key{std::string(path), std::string(wire)};
  const auto mine = std::make_shared<WireSubscription>(WireSubscription{std::move(handler)});
  if (!end_) wire_handlers_[key] = mine;
  auto connected = [this, key, mine, done = std::move(done)](Result<Value> result) {
    if (!result) forget_wire(key, *mine);
    if (done) done(std::move(result));
  };
  mine->connect = expect([&](Now now) { return session_.connect_wire(path, wire, now); }, std::move(connected));
  return mine->connect;
}

void ClientConnection::forget_wire(const MemberKey& key, const WireSubscription& wire) {
  const auto found = wire_handlers_.find(key);
  if (found == wire_handlers_.end() || found->second.get() != &wire) return;
  wire_handlers_.erase(found);
  wire_closed_handlers_.erase(key);
}

void ClientConnection::end_wire(std::string_view path, std::string_view wire, RequestId connect) {
  const auto found = wire_handlers_.find(MemberKey(path, wire));
  if (found != wire_handlers_.end() && found->second->connect == connect) disconnect_wire(path, wire, nullptr);
}

void ClientConnection::disconnect_wire(std::string_view path, std::string_view wire, Completion done) {
  const MemberKey key{std::string(path), std::string(wire)};
  wire_handlers_.erase(key);
  wire_closed_handlers_.erase(key);
  expect([&](Now now) { return session_.disconnect_wire(path, wire, now); }, std::move(done));
}

void ClientConnection::on_wire_closed(std::string_view path, std::string_view wire, std::function<void()> handler) {
  if (!end_) wire_closed_handlers_[{std::string(path), std::string(wire)}] = std::move(handler);
}

Result<> ClientConnection::send_wire(std::string_view path, std::string_view wire, const Value& value) {
  auto sent = session_.send_wire(path, wire, value, read_clocks());
  settle();
  return sent;
}

RequestId ClientConnection::connect_pipe(std::string_view path, std::string_view pipe, std::int32_t index,
                                         PipeHandlers handlers, Completion done) {
  // Packets follow right behind the completion: only there the index is known.
  auto connected = [this, path = std::string(path), pipe = std::string(pipe),
                    handlers = std::make_shared<PipeHandlers>(std::move(handlers)),
                    done = std::move(done)](Result<Value> result) {
    if (result) pipe_handlers_[{path, pipe, result->to<std::int32_t>().value()}] = handlers;
    if (done) done(std::move(result));
  };
  return expect([&](Now now) { return session_.connect_pipe(path, pipe, index, now); }, std::move(connected));
}

void ClientConnection::disconnect_pipe(std::string_view path, std::string_view pipe, std::int32_t index,
                                       Completion done) {
  pipe_handlers_.erase({std::string(path), std::string(pipe), index});
  expect([&](Now now) { return session_.disconnect_pipe(path, pipe, index, now); }, std::move(done));
}

Result<> ClientConnection::send_pipe(std::string_view path, std::string_view pipe, std::int32_t index,
                                     const Value& packet) {
  auto sent = session_.send_pipe_packet(path, pipe, index, packet, read_clocks());
  settle();
  if (!sent) return sent.error();
  return {};
}

Result<std::uint32_t> ClientConnection::send_pipe_for_ack(std::string_view path, std::string_view pipe,
                                                          std::int32_t index, const Value& packet) {
  auto sent = session_.send_pipe_packet(path, pipe, index, packet, read_clocks(), true);
  settle();
  return sent;
}

void ClientConnection::hold_pipe_acks(std::string_view path, std::string_view pipe, std::int32_t index, bool is_held) {
  session_.hold_pipe_acks(path, pipe, index, is_held, read_clocks());
  settle();
}

void ClientConnection::on_callback(std::string_view path, std::string_view callback, CallbackHandler handler) {
  on_callback_later(path, callback,
                    [handler = std::move(handler)](std::span<const Value> arguments, const auto& reply) {
                      reply(handler(arguments));
                    });
}

void ClientConnection::on_callback_later(std::string_view path, std::string_view callback,
                                         LateCallbackHandler handler) {
  if (end_) return;
  callback_handlers_[{std::string(path), std::string(callback)}] =
      std::make_shared<LateCallbackHandler>(std::move(handler));
}

HandlerRegistration ClientConnection::add_event_handler(std::string_view path, std::string_view event,
                                                        EventHandler handler, std::shared_ptr<bool> is_removed) {
  HandlerRegistration registration;
  registration.connection_ = std::static_pointer_cast<ClientConnection>(shared_from_this());
  registration.is_removed_ = is_removed;
  if (end_) return registration;
  event_handlers_.emplace(MemberKey(path, event), std::make_shared<EventSubscription>(
                                                      EventSubscription{std::move(handler), std::move(is_removed)}));
  return registration;
}

void HandlerRegistration::remove() const {
  if (!is_removed_ || std::exchange(*is_removed_, true)) return;
  if (const auto connection = connection_.lock())
    std::erase_if(connection->event_handlers_,
                  [&](const auto& item) { return item.second->is_removed == is_removed_; });
}

void ClientConnection::on_event(std::string_view path, std::string_view event, EventHandler handler) {
  event_handlers_.erase(MemberKey(path, event));
  add_event_handler(path, event, std::move(handler));
}

void ClientConnection::authenticate(std::string_view username, const Value& credentials, Completion done) {
  expect([&](Now now) { return session_.authenticate(username, credentials, now); }, std::move(done));
}

void ClientConnection::logout(Completion done) {
  expect([&](Now now) { return session_.logout(now); }, std::move(done));
}

void ClientConnection::get_attributes(Completion done) {
  expect([&](Now now) { return session_.get_attributes(now); }, std::move(done));
}

RequestId ClientConnection::lock(std::string_view path, LockKind kind, Completion done) {
  return expect([&](Now now) { return session_.lock(path, kind, now); }, std::move(done));
}

void ClientConnection::unlock(std::string_view path, Completion done) {
  expect([&](Now now) { return session_.unlock(path, now); }, std::move(done));
}

RequestId ClientConnection::enter_monitor(std::string_view path, std::chrono::milliseconds timeout, Completion done) {
  return expect([&](Now now) { return session_.enter_monitor(path, timeout, now); }, std::move(done));
}

void ClientConnection::lease(std::string_view path, LeaseCommand command, std::chrono::milliseconds deadman,
                             Completion done) {
  expect([&](Now now) { return session_.lease(path, command, deadman, now); }, std::move(done));
}

void ClientConnection::exit_monitor(std::string_view path, Completion done) {
  expect([&](Now now) { return session_.exit_monitor(path, now); }, std::move(done));
}

void ClientConnection::on_path_released(std::function<void(const std::string& path)> handler) {
  if (!end_) path_released_ = std::move(handler);
}

void ClientConnection::on_closed(std::function<void(const Error& reason)> handler) {
  if (!end_) return on_closed_.push_back(std::move(handler));
  post([this, self = shared_from_this(), handler = std::move(handler)] {
    if (handler) run_handler("the end of", session_.service(), [&] { handler(*end_); });
  });
}

void ClientConnection::disconnect() {
  session_.disconnect(read_clocks());
  settle();
}

bool ClientConnection::handle_event(Now) {
  auto event = session_.poll_event();
  if (!event) return false;
  std::visit([this](auto& happened) { handle(std::move(happened)); }, *event);
  return true;
}

template <class F>
void ClientConnection::run_handler(std::string_view kind, std::string_view name, F&& handler) {
  try {
    handler();
  } catch (...) {
    handler_failed(kind, name);
  }
}

void ClientConnection::handler_failed(std::string_view kind, std::string_view name) const {
  report(describe_failure(kind, name, handler_error(std::current_exception())));
}

void ClientConnection::report(const std::string& problem) const {
  if (report_)
    report_(problem);
  else
    std::cerr << "client of " << session_.service() << ": " << problem << '\n';
}

void ClientConnection::handle(Connected&&) {
  const Opened opened = std::exchange(opened_, nullptr);
  run_handler("connecting to", session_.service(),
              [&] { opened(std::static_pointer_cast<ClientConnection>(shared_from_this())); });
}

void ClientConnection::handle(Completed&& completed) {
  auto found = completions_.extract(completed.id);
  if (!found) return;
  const auto done = spare_completion_.take(std::move(found));
  if (completed.is_unread) {
    auto error = completed.result.error();
    error.sub_name = unread_reply;
    completed.result = std::move(error);
  }
  if (done) run_handler("request to", session_.service(), [&] { done(std::move(completed.result)); });
}

void ClientConnection::handle(EventReceived&& received) {
  const MemberKey key{std::move(received.path), std::move(received.member)};
  const auto [first, last] = event_handlers_.equal_range(key);
  boost::container::small_vector<std::shared_ptr<EventSubscription>, 4> present;  // they may come and go meanwhile
  for (auto each = first; each != last; ++each) present.push_back(each->second);
  for (const auto& each : present)
    if (!*each->is_removed) run_handler("event", key.second, [&] { each->handler(received.arguments); });
}

void ClientConnection::handle(WireValueReceived&& received) {
  const MemberKey key{std::move(received.path), std::move(received.member)};
  const auto found = wire_handlers_.find(key);
  if (found == wire_handlers_.end()) return;
  const auto handler = found->second;
  if (!handler->handler) return;  // connected to send alone
  run_handler("wire", key.second, [&] { handler->handler(received.value, received.time); });
}

void ClientConnection::handle(WireClosedByService&& closed) {
  const MemberKey key{std::move(closed.path), std::move(closed.member)};
  if (session_.has_wire(key.first, key.second)) return;  // a handler has connected it again meanwhile
  wire_handlers_.erase(key);
  const auto found = wire_closed_handlers_.extract(key);
  if (found && found.mapped()) run_handler("wire", key.second, found.mapped());
}

void ClientConnection::handle(PipePacketReceived&& received) {
  const PipeKey key{std::move(received.path), std::move(received.member), received.index};
  const auto found = pipe_handlers_.find(key);
  if (found == pipe_handlers_.end()) return;
  const auto handlers = found->second;  // it may disconnect
  if (handlers->received) run_handler("pipe", std::get<1>(key), [&] { handlers->received(std::move(received.value)); });
}

void ClientConnection::handle(PipePacketsAcknowledged&& acknowledged) {
  const PipeKey key{std::move(acknowledged.path), std::move(acknowledged.member), acknowledged.index};
  const auto found = pipe_handlers_.find(key);
  if (found == pipe_handlers_.end()) return;
  const auto handlers = found->second;  // it may disconnect
  if (handlers->acknowledged)
    run_handler("pipe", std::get<1>(key), [&] { handlers->acknowledged(acknowledged.numbers); });
}

void ClientConnection::handle(PipeClosedByService&& closed) {
  const auto found = pipe_handlers_.extract({std::move(closed.path), std::move(closed.member), closed.index});
  if (found && found.mapped()->closed) run_handler("pipe", std::get<1>(found.key()), found.mapped()->closed);
}

void ClientConnection::handle(CallbackCalled&& called) {
  const MemberKey key{std::move(called.path), std::move(called.member)};
  const auto found = callback_handlers_.find(key);
  if (found == callback_handlers_.end())
    return session_.reply_callback(called.id, make_error(ErrorCode::invalid_operation, "Callback function not set"),
                                   read_clocks());
  const auto handler = found->second;  // it may replace itself
  const std::weak_ptr<StreamDriver> weak = weak_from_this();
  const CallbackReply reply = [weak, id = called.id](const Result<Value>& answer) {
    const auto self = std::static_pointer_cast<ClientConnection>(weak.lock());
    if (!self) return;
    self->session_.reply_callback(id, answer, read_clocks());
    self->settle();
  };
  try {
    (*handler)(called.arguments, reply);
  } catch (...) {
    const auto error = handler_error(std::current_exception());
    if (is_unhandled(error)) report(describe_failure("callback", key.second, error));
    reply(error);
  }
}

/// Whoever uses objects below the path hears of it when the next request fails; their handlers have to go now.
void ClientConnection::handle(PathReleased&& released) {
  const auto is_released = [&](const auto& item) { return is_within(item.first.first, released.path); };
  std::erase_if(event_handlers_, is_released);
  std::erase_if(wire_handlers_, is_released);
  std::erase_if(callback_handlers_, is_released);
  const auto handler = path_released_;
  if (handler) run_handler("object", released.path, [&] { handler(released.path); });
}

void ClientConnection::handle(SessionClosed&& closed) {
  end_ = closed.reason;
  event_handlers_.clear();
  wire_handlers_.clear();
  wire_closed_handlers_.clear();
  callback_handlers_.clear();
  pipe_handlers_.clear();
  path_released_ = nullptr;
  if (const Opened opened = std::exchange(opened_, nullptr))
    return run_handler("connecting to", session_.service(), [&] { opened(std::move(closed.reason)); });
  for (const auto& handler : std::exchange(on_closed_, {}))
    if (handler) run_handler("the end of", session_.service(), [&] { handler(closed.reason); });
}

}  // namespace rr
