#include "node/client/client.hpp"

#include "core/session/service_path.hpp"
#include "core/types/value_size.hpp"
#include "node/driver/clocks.hpp"

namespace rr {

namespace {

/// A sender of pipe packets that met a full stream goes on when no more than this waits.
constexpr std::size_t room_for_packets = 1024 * 1024;
constexpr std::chrono::seconds wait_for_room{15};

constexpr std::size_t max_waiting_handlers = 65'536;
constexpr std::size_t max_waiting_bytes = 64 * 1024 * 1024;

std::size_t bytes_of_values(std::span<const Value> values) {
  std::size_t bytes = 0;
  for (const auto& value : values) bytes += held_bytes(value);
  return bytes;
}

/// Marks that the io_context runs; refuses to run it from within itself.
class Serving {
 public:
  explicit Serving(bool& flag) : flag_(flag) {
    if (flag_) throw std::logic_error("an asynchronous handler cannot wait: it holds up what it would wait for");
    flag_ = true;
  }
  Serving(const Serving&) = delete;
  Serving& operator=(const Serving&) = delete;
  ~Serving() { flag_ = false; }

 private:
  bool& flag_;
};

Value password_credentials(std::string_view password) {
  MapString credentials;
  credentials.items.emplace_back("password", Value(password));
  return Value(std::move(credentials));
}

}  // namespace

BlockingConnection::BlockingConnection(std::string_view url, ConnectOptions options) {
  std::optional<Error> failure;
  ClientConnection::open(io_, url, std::move(options), [&](Result<std::shared_ptr<ClientConnection>> opened) {
    if (opened) {
      connection_ = std::move(*opened);
      connection_->on_closed([this](const Error& reason) { close_reason_ = reason; });
    } else {
      failure = opened.error();
    }
  });
  while (!connection_ && !failure && io_.run_one() != 0) {
  }
  if (failure) throw ClientException(*failure);
}

BlockingConnection::~BlockingConnection() {
  is_handling_ = true;  // no handler is called any more: what it refers to may be gone already
  try {
    close();
  } catch (...) {
    // Out of memory: there is no goodbye then, and nobody here who could do better.
  }
}

void BlockingConnection::run_for(std::chrono::milliseconds duration) {
  (void)run_until([] { return false; }, duration);
  // Without any time, too, what has come is taken: a heartbeat, above all.
  io_.restart();
  for (int left = 64; left > 0 && !has_handlers(); --left) {
    const Serving serving(is_serving_);
    if (io_.poll_one() == 0) break;
  }
  run_handlers(std::chrono::steady_clock::now());
}

bool BlockingConnection::serve(std::optional<std::chrono::steady_clock::time_point> until) {
  const Serving serving(is_serving_);
  io_.restart();
  return (until ? io_.run_one_until(*until) : io_.run_one()) != 0;
}

void BlockingConnection::queue(HandlerCall handler) {
  // One alone may be larger.
  if (handlers_.size() < max_waiting_handlers &&
      (handlers_.empty() || waiting_bytes_ + handler.bytes <= max_waiting_bytes)) {
    waiting_bytes_ += handler.bytes;
    return handlers_.push_back(std::move(handler));
  }
  connection_->close(make_error(ErrorCode::out_of_system_resource,
                                std::to_string(handlers_.size()) + " calls of handlers wait, with " +
                                    std::to_string(waiting_bytes_) + " bytes: they take too long; expected at most " +
                                    std::to_string(max_waiting_handlers) + " calls, with " +
                                    std::to_string(max_waiting_bytes) + " bytes"));
}

void BlockingConnection::run_handlers(std::chrono::steady_clock::time_point until) {
  if (is_handling_) return;
  is_handling_ = true;
  for (auto left = handlers_.size(); left > 0; --left) {
    const auto next = std::move(handlers_.front());
    handlers_.pop_front();
    waiting_bytes_ -= next.bytes;
    try {
      next.call();
    } catch (...) {
      connection_->handler_failed(next.kind, next.name);
    }
    if (std::chrono::steady_clock::now() >= until) break;
  }
  is_handling_ = false;
}

bool BlockingConnection::run_until(const std::function<bool()>& is_done, std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + bounded(timeout);
  run_handlers(deadline);
  while (!is_done()) {
    // What the peer sends is not read while handlers wait: it is the peer that waits for them.
    const bool goes_on = has_handlers() || serve(deadline);
    run_handlers(deadline);
    if (std::chrono::steady_clock::now() >= deadline || (!goes_on && is_closed())) return is_done();
  }
  return true;
}

Value BlockingConnection::wait_for_completion(
    const std::function<void(ClientConnection&, ClientConnection::Completion)>& start) {
  if (close_reason_) throw ClientException(*close_reason_);
  std::optional<Result<Value>> result;
  {
    const Serving serving(is_serving_);
    start(*connection_, [&](Result<Value>&& completed) { result = std::move(completed); });
  }
  while (!result && (has_handlers() || serve({}))) run_handlers();
  run_handlers();  // of what came before the answer
  if (!result) throw ClientException(make_error(ErrorCode::connection_error, "the connection is gone"));
  if (!*result) throw ClientException(result->error());
  return std::move(**result);
}

void BlockingConnection::close() {
  if (is_closed()) return;
  connection_->disconnect();
  if (!run_until([this] { return is_closed(); }, std::chrono::seconds(1)))
    connection_->close(make_error(ErrorCode::connection_error, "closed by the client"));
}

void BlockingConnection::authenticate(std::string_view username, std::string_view password) {
  wait_for([&](ClientConnection& connection, auto done) {
    connection.authenticate(username, password_credentials(password), std::move(done));
  });
}

void BlockingConnection::logout() {
  wait_for([](ClientConnection& connection, auto done) { connection.logout(std::move(done)); });
}

MonitorGuard::~MonitorGuard() {
  if (connection_ && !connection_->is_closed()) connection_->asynchronous().exit_monitor(path_, [](const auto&) {});
}

void MonitorGuard::exit() {
  if (!connection_) return;
  const auto connection = std::move(connection_);
  connection->wait_for([this](ClientConnection& session, auto done) { session.exit_monitor(path_, std::move(done)); });
}

Value RemoteObject::call_values(std::string_view function, std::span<const Value> arguments) const {
  return connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.call(path_, function, arguments, std::move(done)); });
}

RemoteGenerator RemoteObject::generator_values(std::string_view function, std::span<const Value> arguments) const {
  const Value index = connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.open_generator(path_, function, arguments, std::move(done));
  });
  return {connection_, path_, std::string(function), *index.to<std::int32_t>()};
}

Value RemoteObject::get(std::string_view property) const {
  return connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.get(path_, property, std::move(done)); });
}

void RemoteObject::set(std::string_view property, const Value& value) const {
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.set(path_, property, value, std::move(done)); });
}

RemoteObject RemoteObject::object(std::string_view objref) const {
  RemoteObject child(connection_, child_path(path_, objref));
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.find_object(child.path_, std::move(done)); });
  return child;
}

RemoteObject RemoteObject::object(std::string_view objref, std::string_view index) const {
  RemoteObject child(connection_, child_path(path_, objref, index));
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.find_object(child.path_, std::move(done)); });
  return child;
}

Value RemoteObject::peek_in(std::string_view wire) const {
  return connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.peek_in(path_, wire, std::move(done)); });
}

Value RemoteObject::peek_out(std::string_view wire) const {
  return connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.peek_out(path_, wire, std::move(done)); });
}

void RemoteObject::poke_out(std::string_view wire, const Value& value) const {
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.poke_out(path_, wire, value, std::move(done)); });
}

void RemoteObject::connect_wire(std::string_view wire, ClientConnection::WireHandler handler) const {
  struct Newest {
    ClientConnection::WireHandler handler;
    std::shared_ptr<bool> is_disconnected;
    std::optional<std::pair<Value, TimeSpec>> value;  ///< that waits for the handler
  };
  const auto newest = std::make_shared<Newest>();
  newest->handler = std::move(handler);
  newest->is_disconnected = std::make_shared<bool>(false);
  connection_->wires_[{path_, std::string(wire)}] = newest->is_disconnected;
  ClientConnection::WireHandler received;
  if (newest->handler)
    received = [connection = connection_.get(), newest, name = std::string(wire)](const Value& value, TimeSpec time) {
      const bool is_queued = newest->value.has_value();
      newest->value.emplace(value, time);
      if (is_queued) return;
      connection->queue({"wire", name, [newest] {
                           const auto [taken, at] = *std::exchange(newest->value, std::nullopt);
                           if (!*newest->is_disconnected) newest->handler(taken, at);
                         }});
    };
  connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.connect_wire(path_, wire, std::move(received), std::move(done));
  });
}

void RemoteObject::disconnect_wire(std::string_view wire) const {
  if (const auto found = connection_->wires_.extract({path_, std::string(wire)})) *found.mapped() = true;
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.disconnect_wire(path_, wire, std::move(done)); });
}

void RemoteObject::send_wire(std::string_view wire, const Value& value) const {
  if (auto sent = connection_->asynchronous().send_wire(path_, wire, value); !sent) throw ClientException(sent.error());
}

RemotePipe RemoteObject::connect_pipe(std::string_view pipe, std::function<void(Value)> received,
                                      std::int32_t index) const {
  RemotePipe endpoint(connection_, path_, std::string(pipe));
  ClientConnection::PipeHandlers handlers;
  handlers.closed = [state = endpoint.state_] { state->is_open = false; };
  if (received)
    handlers.received = [connection = connection_.get(), state = endpoint.state_, name = std::string(pipe),
                         handler = std::make_shared<std::function<void(Value)>>(std::move(received))](Value packet) {
      const auto bytes = held_bytes(packet);
      connection->queue({"pipe", name,
                         [state, handler, packet = std::move(packet)] {
                           if (!state->is_closed_here) (*handler)(packet);
                         },
                         bytes});
    };
  const Value connected = connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.connect_pipe(path_, pipe, index, std::move(handlers), std::move(done));
  });
  endpoint.state_->index = connected.to<std::int32_t>().value();
  return endpoint;
}

void RemotePipe::send(const Value& packet) const {
  ClientConnection& connection = connection_->asynchronous();
  auto sent = connection.send_pipe(path_, pipe_, index(), packet);
  if (!sent && sent.error().code == ErrorCode::out_of_system_resource) {
    const auto has_room = [&] {
      return connection_->is_closed() || connection.session().queued_bytes() < room_for_packets;
    };
    if (connection_->run_until(has_room, wait_for_room)) sent = connection.send_pipe(path_, pipe_, index(), packet);
  }
  if (!sent) throw ClientException(sent.error());
}

void RemotePipe::close() const {
  if (!is_open()) return;
  state_->is_open = false;
  state_->is_closed_here = true;
  connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.disconnect_pipe(path_, pipe_, index(), std::move(done));
  });
}

void RemoteObject::on_callback_values(std::string_view callback, ClientConnection::CallbackHandler handler) const {
  auto called = [connection = connection_.get(), name = std::string(callback),
                 handler = std::make_shared<ClientConnection::CallbackHandler>(std::move(handler))](
                    std::span<const Value> arguments, const ClientConnection::CallbackReply& reply) {
    connection->queue({"callback", name,
                       [handler, values = std::vector(arguments.begin(), arguments.end()), reply] {
                         try {
                           reply((*handler)(values));
                         } catch (...) {
                           const auto error = handler_error(std::current_exception());
                           reply(error);
                           if (is_unhandled(error)) throw;
                         }
                       },
                       bytes_of_values(arguments)});
  };
  connection_->asynchronous().on_callback_later(path_, callback, std::move(called));
}

HandlerRegistration RemoteObject::on_event(std::string_view event, ClientConnection::EventHandler handler) const {
  const auto is_removed = std::make_shared<bool>(false);
  auto received = [connection = connection_.get(), is_removed, name = std::string(event),
                   handler = std::make_shared<ClientConnection::EventHandler>(std::move(handler))](
                      std::span<const Value> arguments) {
    connection->queue({"event", name,
                       [is_removed, handler, values = std::vector(arguments.begin(), arguments.end())] {
                         if (!*is_removed) (*handler)(values);
                       },
                       bytes_of_values(arguments)});
  };
  return connection_->asynchronous().add_event_handler(path_, event, std::move(received), is_removed);
}

void RemoteObject::lock(LockKind kind) const {
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.lock(path_, kind, std::move(done)); });
}

void RemoteObject::unlock() const {
  connection_->wait_for([&](ClientConnection& connection, auto done) { connection.unlock(path_, std::move(done)); });
}

MonitorGuard RemoteObject::enter_monitor(std::chrono::milliseconds timeout) const {
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.enter_monitor(path_, timeout, std::move(done)); });
  return {connection_, path_};
}

const std::string& RemoteObject::type_name() const {
  const EntityDefinition* type = connection_->asynchronous().session().object_type(path_);
  if (!type) throw ClientException(make_error(ErrorCode::object_not_found, "object " + path_ + " was replaced"));
  return type->qualified_name;
}

RemoteObject connect(std::string_view url, ConnectOptions options) {
  auto connection = std::make_shared<BlockingConnection>(url, std::move(options));
  const std::string root = connection->asynchronous().root_path();
  return {std::move(connection), root};
}

RemoteObject connect(std::string_view url, std::string_view username, std::string_view password,
                     ConnectOptions options) {
  options.username = username;
  options.credentials = password_credentials(password);
  return connect(url, std::move(options));
}

}  // namespace rr
