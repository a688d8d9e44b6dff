#include "node/client/client.hpp"

#include "core/session/service_path.hpp"

namespace rr {

namespace {

/// A sender of pipe packets that met a full stream goes on when no more than this waits.
constexpr std::size_t room_for_packets = 1024 * 1024;
constexpr std::chrono::seconds wait_for_room{15};

/// Marks that handlers run; refuses to wait in one.
class Running {
 public:
  explicit Running(bool& flag) : flag_(flag) {
    if (flag_) throw std::logic_error("a handler of a blocking client cannot wait; use asynchronous()");
    flag_ = true;
  }
  ~Running() { flag_ = false; }

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
    if (opened)
      connection_ = std::move(*opened);
    else
      failure = opened.error();
  });
  while (!connection_ && !failure && io_.run_one() != 0) {
  }
  if (failure) throw ClientException(*failure);
  connection_->on_closed([this](const Error& reason) { close_reason_ = reason; });
}

BlockingConnection::~BlockingConnection() {
  close();
}

void BlockingConnection::run_for(std::chrono::milliseconds duration) {
  (void)run_until([] { return false; }, duration);
}

bool BlockingConnection::run_until(const std::function<bool()>& is_done, std::chrono::milliseconds timeout) {
  const Running running(is_running_);
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (!is_done()) {
    io_.restart();
    if (io_.run_one_until(deadline) == 0 && (is_closed() || std::chrono::steady_clock::now() >= deadline))
      return is_done();
  }
  return true;
}

Value BlockingConnection::wait_for(const std::function<void(ClientConnection&, ClientConnection::Completion)>& start) {
  if (close_reason_) throw ClientException(*close_reason_);
  const Running running(is_running_);
  std::optional<Result<Value>> result;
  start(*connection_, [&](Result<Value> completed) { result = std::move(completed); });
  io_.restart();
  while (!result && io_.run_one() != 0) {
  }
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
  connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.connect_wire(path_, wire, std::move(handler), std::move(done));
  });
}

void RemoteObject::disconnect_wire(std::string_view wire) const {
  connection_->wait_for(
      [&](ClientConnection& connection, auto done) { connection.disconnect_wire(path_, wire, std::move(done)); });
}

void RemoteObject::send_wire(std::string_view wire, const Value& value) const {
  if (auto sent = connection_->asynchronous().send_wire(path_, wire, value); !sent) throw ClientException(sent.error());
}

RemotePipe RemoteObject::connect_pipe(std::string_view pipe, std::function<void(Value)> received,
                                      std::int32_t index) const {
  RemotePipe endpoint(connection_, path_, std::string(pipe));
  ClientConnection::PipeHandlers handlers{std::move(received), [state = endpoint.state_] { state->is_open = false; }};
  const Value connected = connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.connect_pipe(path_, pipe, index, std::move(handlers), std::move(done));
  });
  endpoint.state_->index = connected.to<std::int32_t>().value();
  return endpoint;
}

void RemotePipe::send(const Value& packet) const {
  ClientConnection& connection = connection_->asynchronous();
  auto sent = connection.send_pipe(path_, pipe_, index(), packet);
  if (!sent && sent.error().code == ErrorCode::out_of_system_resource && !connection_->is_running()) {
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
  connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.disconnect_pipe(path_, pipe_, index(), std::move(done));
  });
}

void RemoteObject::on_callback_values(std::string_view callback, ClientConnection::CallbackHandler handler) const {
  connection_->asynchronous().on_callback(path_, callback, std::move(handler));
}

void RemoteObject::on_event(std::string_view event, ClientConnection::EventHandler handler) const {
  connection_->asynchronous().on_event(path_, event, std::move(handler));
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
