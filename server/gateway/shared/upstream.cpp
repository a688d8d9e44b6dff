#include "server/gateway/shared/upstream.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>

#include "core/session/service_path.hpp"
#include "core/support/glob.hpp"
#include "server/gateway/open_session.hpp"
#include "server/log/log.hpp"
#include "server/node/async_object.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// Objects that all clients together have found.
constexpr std::size_t max_objects = 65'536;

const auto ignore = [](const rr::Result<rr::Value>&) {};

/// The object of a call: hosted services of shared devices have no others.
const std::string& path_of(const rr::Called& called) {
  return static_cast<const SharedObject&>(*called.object).path();
}

}  // namespace

Upstream::Upstream(std::shared_ptr<Device> device, std::string service, UpstreamLogin login)
    : device_(std::move(device)), service_(std::move(service)), login_(std::move(login)) {}

// --- the session ---

rr::awaitable<rr::Result<>> Upstream::open() {
  const auto self = shared_from_this();
  auto opened = co_await open_connection(false);
  // Whoever has no login may look at the service, and so may his clients; what they do is for the device to refuse.
  requires_user_ = !opened && login_.username.empty() && opened.error().code == rr::ErrorCode::authentication_error;
  if (requires_user_) opened = co_await open_connection(true);
  if (!opened) co_return opened.error();
  if (login_.is_late) {
    const rr::AsyncObject root(*opened, service_);
    const rr::Value credentials(login_.credentials);
    try {
      co_await root.authenticate(login_.username, credentials);
    } catch (const rr::Exception& exception) {
      (*opened)->disconnect();
      co_return exception.error();
    }
  }
  connection_ = std::move(*opened);
  connection_->on_closed([weak = weak_from_this(), which = connection_.get()](const rr::Error& reason) {
    const auto still_there = weak.lock();
    if (still_there && still_there->connection_.get() == which) still_there->lost(reason);
  });
  connection_->on_path_released([weak = weak_from_this()](const std::string& path) {
    if (const auto still_there = weak.lock()) still_there->handle_released(path);
  });
  loss_.reset();
  if (const auto* root = connection_->session().object_type(service_)) watch_object(service_, *root);
  look_up_again();
  co_return rr::Result<>();
}

rr::awaitable<rr::Result<std::shared_ptr<rr::ClientConnection>>> Upstream::open_connection(bool is_stepwise) {
  auto stream = co_await device_->connect();
  if (!stream)
    co_return rr::make_error(rr::ErrorCode::connection_error,
                             "device " + rr::quoted(device_->config().name) + " is offline: " + stream.error().message);
  const auto& url = device_->config().url;
  const rr::NodeIdentity target{url.node_id.value_or(rr::NodeId{}), url.node_name};
  const std::string username = login_.is_late ? std::string() : login_.username;
  co_return co_await open_session(std::move(*stream), service_, target, username, login_.credentials, is_stepwise);
}

void Upstream::close(std::function<void()> closed) {
  on_lost_ = nullptr;
  const auto connection = std::exchange(connection_, nullptr);
  if (!connection) {
    if (closed) closed();
    return;
  }
  if (closed) connection->on_closed([closed = std::move(closed)](const rr::Error&) { closed(); });
  connection->disconnect();
}

rr::Error Upstream::lost_error() const {
  return rr::make_error(rr::ErrorCode::connection_error,
                        "connection_lost: device " + rr::quoted(device_->config().name) +
                            (loss_ ? ": " + loss_->message : std::string(" is not connected")));
}

void Upstream::lost(const rr::Error& reason) {
  connection_.reset();
  loss_ = reason;
  generators_.clear();
  for (auto& [key, wire] : wires_) wire.is_attached = false;
  for (auto& [number, pipe] : pipes_) pipe.state = PipeState::detached;
  device_->note_trouble();
  if (const auto handler = on_lost_) handler();
}

void Upstream::add(UpstreamClient& client) {
  clients_.push_back(&client);
}

void Upstream::remove(UpstreamClient& client) {
  std::erase(clients_, &client);
  std::erase_if(calls_, [&](const OpenCall& call) { return call.client == &client; });
  for (auto it = endpoints_.lower_bound({&client, 0}); it != endpoints_.end() && it->first.first == &client;)
    leave_pipe(client, (it++)->first.second);
  std::vector<std::pair<std::string, const rr::MemberDefinition*>> wires;
  for (const auto& [key, wire] : wires_)
    if (std::find(wire.clients.begin(), wire.clients.end(), &client) != wire.clients.end())
      wires.emplace_back(key.first, wire.member);
  for (const auto& [path, member] : wires) leave_wire(client, path, *member);
  std::vector<rr::GeneratorId> generators;
  for (const auto& [key, generator] : generators_)
    if (key.first == &client) generators.push_back(key.second);
  for (const auto id : generators) drop_generator(client, id);
}

// --- objects ---

void Upstream::find_object(const std::string& path, Completion done) {
  if (!connection_) return done(lost_error());
  if (objects_.size() >= max_objects && !objects_.contains(path))
    return done(
        rr::make_error(rr::ErrorCode::out_of_system_resource,
                       "clients of this device have found " + std::to_string(max_objects) + " objects already"));
  connection_->find_object(path, [weak = weak_from_this(), path, done = std::move(done)](rr::Result<rr::Value> found) {
    if (const auto self = weak.lock(); self && self->connection_ && found)
      if (const auto* type = self->connection_->session().object_type(path)) self->watch_object(path, *type);
    done(std::move(found));
  });
}

/// Events and callbacks of an object reach all clients, whether or not they ever looked at it.
void Upstream::watch_object(const std::string& path, const rr::EntityDefinition& type) {
  objects_.insert(path);
  for (const auto& member : type.members) {
    if (member.kind == rr::MemberKind::event) {
      connection_->on_event(path, member.name,
                            [weak = weak_from_this(), path, &member](std::span<const rr::Value> arguments) {
                              const auto self = weak.lock();
                              if (!self) return;
                              const auto clients = self->clients_;  // they may leave
                              for (auto* client : clients)
                                if (self->has(*client)) client->receive_event(path, member, arguments);
                            });
    } else if (member.kind == rr::MemberKind::callback) {
      connection_->on_callback_later(
          path, member.name,
          [weak = weak_from_this(), path, &member](std::span<const rr::Value> arguments,
                                                   const rr::ClientConnection::CallbackReply& answer) {
            if (const auto self = weak.lock()) self->route_callback(path, member, arguments, answer);
          });
    }
  }
}

/// After the device has come back: what clients had found there, they have found again, or it is gone.
void Upstream::look_up_again() {
  const auto known = objects_;
  for (const auto& path : known) {
    find_object(path, [weak = weak_from_this(), path](const rr::Result<rr::Value>& found) {
      const auto self = weak.lock();
      if (!self || !self->connection_) return;
      if (!found) return self->handle_released(path);
      std::vector<MemberKey> wires;
      for (const auto& [key, wire] : self->wires_)
        if (key.first == path) wires.push_back(key);
      for (const auto& key : wires) self->attach_wire(key);
      std::vector<PipeNumber> pipes;
      for (const auto& [number, pipe] : self->pipes_)
        if (pipe.path == path) pipes.push_back(number);
      for (const auto number : pipes) self->attach_pipe(number);
    });
  }
}

void Upstream::handle_released(const std::string& path) {
  std::erase_if(objects_, [&](const auto& each) { return rr::is_within(each, path); });
  std::vector<MemberKey> wires;
  for (const auto& [key, wire] : wires_)
    if (rr::is_within(key.first, path)) wires.push_back(key);
  for (const auto& key : wires) drop_wire(key, nullptr);
  std::vector<PipeNumber> pipes;
  for (const auto& [number, pipe] : pipes_)
    if (rr::is_within(pipe.path, path)) pipes.push_back(number);
  for (const auto number : pipes) drop_pipe(number);
  std::erase_if(generators_, [&](const auto& each) { return rr::is_within(each.second.path, path); });
  if (on_released_) on_released_(path);
  const auto clients = clients_;
  for (auto* client : clients)
    if (has(*client)) client->release_path(path);
}

// --- requests ---

void Upstream::request(UpstreamClient& client, const rr::Called& called, Completion done) {
  if (!connection_) return done(lost_error());
  // What the device lost while it was asked is said in our words: clients know by them that it may come back.
  done = [weak = weak_from_this(), done = std::move(done)](rr::Result<rr::Value> result) {
    const auto self = weak.lock();
    if (!result && self && !self->connection_) return done(self->lost_error());
    done(std::move(result));
  };
  const auto& path = path_of(called);
  if (!connection_->session().object_type(path)) {  // another session of this service has found it
    return find_object(path, [weak = weak_from_this(), &client, life = client.life(), called,
                              done](const rr::Result<rr::Value>& found) {
      const auto self = weak.lock();
      if (!self || !found || life.expired()) return done(found);
      self->request(client, called, done);
    });
  }
  if (called.generator != 0) return answer_generator(client, called, path, std::move(done));
  if (called.kind == rr::CallKind::function) {
    const auto number = ++last_call_;
    calls_.push_back({&client, path, number});
    done = [weak = weak_from_this(), number, done = std::move(done)](rr::Result<rr::Value> result) {
      if (const auto self = weak.lock())
        std::erase_if(self->calls_, [number](const OpenCall& call) { return call.number == number; });
      done(std::move(result));
    };
  }
  begin_request(called, path, std::move(done));
}

void Upstream::share_read(const std::string& path, const std::string& property, Completion done) {
  const MemberKey key(path, property);
  auto& waiting = reads_[key];
  waiting.push_back(std::move(done));
  if (waiting.size() > 1) return;
  connection_->get(path, property, [weak = weak_from_this(), key](const rr::Result<rr::Value>& value) {
    const auto self = weak.lock();
    if (!self) return;
    const auto readers = self->reads_.extract(key);
    if (!readers) return;
    for (const auto& reader : readers.mapped()) reader(value);
  });
}

void Upstream::begin_request(const rr::Called& called, const std::string& path, Completion done) {
  const auto& name = called.member->name;
  switch (called.kind) {
    case rr::CallKind::property_get:
      if (device_->config().shares_reads) return share_read(path, name, std::move(done));
      return connection_->get(path, name, std::move(done));
    case rr::CallKind::property_set:
      return connection_->set(path, name, called.arguments.front(), std::move(done));
    case rr::CallKind::function:
      return connection_->call(path, name, called.arguments, std::move(done));
    case rr::CallKind::peek_in:
      return connection_->peek_in(path, name, std::move(done));
    case rr::CallKind::peek_out:
      return connection_->peek_out(path, name, std::move(done));
    case rr::CallKind::poke_out:
      return connection_->poke_out(path, name, called.arguments.front(), std::move(done));
    case rr::CallKind::memory_dimensions:
      return connection_->get_memory_dimensions(path, name, std::move(done));
    case rr::CallKind::memory_read:
      return connection_->read_memory(path, name, called.range, std::move(done));
    case rr::CallKind::memory_write:
      return connection_->write_memory(path, name, called.range.position, called.arguments.front(), std::move(done));
    default:
      return done(rr::make_error(rr::ErrorCode::not_implemented_error, "no such request"));
  }
}

void Upstream::answer_generator(UpstreamClient& client, const rr::Called& called, const std::string& path,
                                Completion done) {
  const std::pair key(&client, called.generator);
  const auto& name = called.member->name;
  if (called.kind == rr::CallKind::generator_open) {
    auto opened = [weak = weak_from_this(), key, path, name,
                   done = std::move(done)](rr::Result<rr::Value> index) mutable {
      const auto self = weak.lock();
      if (index && self && self->connection_) {
        const auto number = index->to<std::int32_t>().value();
        if (self->has(*key.first))
          self->generators_[key] = {path, name, number};
        else
          self->connection_->close_generator(path, name, number, ignore);
      }
      done(std::move(index));
    };
    return connection_->open_generator(path, name, called.arguments, std::move(opened));
  }
  const auto found = generators_.find(key);
  if (found == generators_.end()) {
    if (called.kind != rr::CallKind::generator_next) return done(rr::Value());
    return done(rr::make_error(rr::ErrorCode::invalid_operation, "Invalid generator"));
  }
  const auto index = found->second.index;
  if (called.kind == rr::CallKind::generator_next) {
    auto stepped = [weak = weak_from_this(), key, done = std::move(done)](rr::Result<rr::Value> value) {
      if (const auto self = weak.lock(); self && !value) self->generators_.erase(key);
      done(std::move(value));
    };
    std::optional<rr::Value> parameter;
    if (!called.arguments.empty()) parameter = called.arguments.front();
    return connection_->next_generator(path, name, index, parameter, std::move(stepped));
  }
  generators_.erase(found);
  if (called.kind == rr::CallKind::generator_close)
    connection_->close_generator(path, name, index, std::move(done));
  else
    connection_->abort_generator(path, name, index, std::move(done));
}

void Upstream::drop_generator(UpstreamClient& client, rr::GeneratorId id) {
  const auto found = generators_.extract({&client, id});
  if (!found || !connection_) return;
  const auto& generator = found.mapped();
  connection_->close_generator(generator.path, generator.function, generator.index, ignore);
}

void Upstream::lock(const rr::LockWanted& wanted, Completion done) {
  if (!connection_) return done(lost_error());
  switch (wanted.command) {
    case rr::LockCommand::lock_for_user:
      return connection_->lock(wanted.path, rr::LockKind::user, std::move(done));
    case rr::LockCommand::lock_for_client:
      return connection_->lock(wanted.path, rr::LockKind::client, std::move(done));
    case rr::LockCommand::unlock:
      return connection_->unlock(wanted.path, std::move(done));
    case rr::LockCommand::enter_monitor:
      return connection_->enter_monitor(wanted.path, wanted.timeout, std::move(done));
    case rr::LockCommand::exit_monitor:
      return connection_->exit_monitor(wanted.path, std::move(done));
  }
}

// --- wires ---

void Upstream::join_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& member) {
  if (!connection_) return client.answer_wire(path, member, lost_error());
  const MemberKey key(path, member.name);
  auto& wire = wires_[key];
  wire.member = &member;
  wire.clients.push_back(&client);
  if (wire.is_attached) {
    const auto newest = wire.newest;  // the client may leave
    const auto arrived = wire.arrived;
    const bool is_due = wire.is_due;
    client.answer_wire(path, member, {});
    if (newest && !is_due) client.receive_wire(path, member, *newest, arrived);
  } else if (wire.clients.size() == 1) {
    attach_wire(key);
  }
}

void Upstream::attach_wire(const MemberKey& key) {
  if (!connection_) return;
  const auto weak = weak_from_this();
  if (!connection_->session().object_type(key.first))  // another session of this service has found it
    return find_object(key.first, [weak, key](const rr::Result<rr::Value>& found) {
      const auto self = weak.lock();
      if (!self || !self->connection_) return;
      if (found) return self->attach_wire(key);
      const auto reason = found.error();
      self->drop_wire(key, &reason);
    });
  auto received = [weak, key](const rr::Value& value, rr::TimeSpec time) {
    if (const auto self = weak.lock()) self->publish_wire(key, value, time);
  };
  auto connected = [weak, key](const rr::Result<rr::Value>& done) {
    const auto self = weak.lock();
    if (!self || !self->connection_) return;
    const auto found = self->wires_.find(key);
    if (found == self->wires_.end()) return;
    if (!done) {
      const auto reason = done.error();
      return self->drop_wire(key, &reason);
    }
    auto& wire = found->second;
    wire.is_attached = true;
    const auto clients = wire.clients;
    for (auto* client : clients)
      if (self->has_joined(*client, key)) client->answer_wire(key.first, *wire.member, {});
    const auto still_there = self->wires_.find(key);
    if (still_there == self->wires_.end() || !self->connection_) return;
    if (const auto value = std::exchange(still_there->second.out_value, std::nullopt))
      (void)self->connection_->send_wire(key.first, key.second, *value);
  };
  connection_->on_wire_closed(key.first, key.second, [weak, key] {
    const auto closed = rr::make_error(rr::ErrorCode::service_error, "the device closed the wire");
    if (const auto self = weak.lock()) self->drop_wire(key, &closed);
  });
  connection_->connect_wire(key.first, key.second, std::move(received), std::move(connected));
}

void Upstream::publish_wire(const MemberKey& key, const rr::Value& value, rr::TimeSpec time) {
  const auto found = wires_.find(key);
  if (found == wires_.end()) return;
  auto& wire = found->second;
  wire.newest = rr::WireValue{time, value};
  wire.arrived = std::chrono::steady_clock::now();
  if (wire.is_due) {
    ++wire.conflated;
    return;
  }
  // Not here: one read may bring hundreds of values, of which the last one counts, and everybody else has to get a
  // turn.
  wire.is_due = true;
  asio::post(device_->executor(), [weak = weak_from_this(), key] {
    if (const auto self = weak.lock()) self->hand_out(key);
  });
}

void Upstream::hand_out(const MemberKey& key) {
  const auto found = wires_.find(key);
  if (found == wires_.end() || !found->second.newest) return;
  auto& wire = found->second;
  wire.is_due = false;
  const auto conflated = std::exchange(wire.conflated, 0);
  // Clients may leave while they are sent to: the value and the list must stay.
  const auto clients = wire.clients;
  const auto newest = *wire.newest;
  const auto arrived = wire.arrived;
  const auto& member = *wire.member;
  for (auto* client : clients) {
    const auto still_there = wires_.find(key);
    if (still_there == wires_.end()) return;
    if (still_there->second.clients.size() != clients.size() && !has_joined(*client, key)) continue;
    if (conflated > 0) client->note_conflated(key.first, member, conflated);
    client->receive_wire(key.first, member, newest, arrived);
  }
}

void Upstream::leave_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& member) {
  const MemberKey key(path, member.name);
  const auto found = wires_.find(key);
  if (found == wires_.end()) return;
  std::erase(found->second.clients, &client);
  if (!found->second.clients.empty()) return;
  wires_.erase(found);
  if (connection_) connection_->disconnect_wire(path, member.name, ignore);
}

void Upstream::drop_wire(const MemberKey& key, const rr::Error* reason) {
  const auto dropped = wires_.extract(key);
  if (!dropped || !reason) return;
  const auto& member = *dropped.mapped().member;
  for (auto* client : dropped.mapped().clients) {
    if (has(*client)) client->answer_wire(key.first, member, *reason);
    if (has(*client)) client->close_wire(key.first, member);
  }
}

bool Upstream::has(const UpstreamClient& client) const {
  return std::find(clients_.begin(), clients_.end(), &client) != clients_.end();
}

bool Upstream::has_joined(const UpstreamClient& client, const MemberKey& key) const {
  const auto found = wires_.find(key);
  if (found == wires_.end()) return false;
  const auto& clients = found->second.clients;
  return std::find(clients.begin(), clients.end(), &client) != clients.end();
}

void Upstream::send_wire(const std::string& path, const rr::MemberDefinition& member, const rr::Value& value) {
  const auto found = wires_.find({path, member.name});
  if (found == wires_.end()) return;
  if (!connection_ || !found->second.is_attached)
    found->second.out_value = value;
  else
    (void)connection_->send_wire(path, member.name, value);  // the newest wins: one that can't be sent is replaced
}

// --- pipes ---

void Upstream::join_pipe(UpstreamClient& client, rr::PipeId id, const std::string& path,
                         const rr::MemberDefinition& member) {
  if (!connection_) return client.refuse_pipe(id, lost_error());
  const EndpointKey endpoint(&client, id);
  const bool is_shared = member.direction() == rr::MemberDirection::readonly;
  const MemberKey key(path, member.name);
  if (is_shared) {
    if (const auto known = shared_pipes_.find(key); known != shared_pipes_.end()) {
      auto& pipe = pipes_.at(known->second);
      pipe.endpoints.push_back(endpoint);
      endpoints_[endpoint] = known->second;
      if (pipe.state == PipeState::attached) client.accept_pipe(id);
      return;
    }
  }
  const auto number = ++last_pipe_;
  auto& pipe = pipes_[number];
  pipe.path = path;
  pipe.member = &member;
  pipe.endpoints.push_back(endpoint);
  endpoints_[endpoint] = number;
  if (is_shared) shared_pipes_[key] = number;
  attach_pipe(number);
}

void Upstream::attach_pipe(PipeNumber number) {
  const auto found = pipes_.find(number);
  if (found == pipes_.end() || !connection_ || found->second.state != PipeState::detached) return;
  auto& pipe = found->second;
  const auto weak = weak_from_this();
  if (!connection_->session().object_type(pipe.path))  // another session of this service has found it
    return find_object(pipe.path, [weak, number](const rr::Result<rr::Value>& object) {
      const auto self = weak.lock();
      if (!self || !self->connection_) return;
      if (object) return self->attach_pipe(number);
      self->drop_pipe(number);
    });
  pipe.state = PipeState::attaching;
  rr::ClientConnection::PipeHandlers handlers;
  handlers.received = [weak, number](const rr::Value& packet) {
    const auto self = weak.lock();
    if (!self) return;
    const auto at = self->pipes_.find(number);
    if (at == self->pipes_.end()) return;
    const auto endpoints = at->second.endpoints;  // they may leave
    for (const auto& endpoint : endpoints)
      if (self->endpoints_.contains(endpoint)) endpoint.first->receive_packet(endpoint.second, packet);
  };
  handlers.closed = [weak, number] {
    if (const auto self = weak.lock()) self->drop_pipe(number);
  };
  const bool is_first = pipe.index == 0;
  connection_->connect_pipe(
      pipe.path, pipe.member->name, rr::any_pipe_index, std::move(handlers),
      [weak, number, is_first, path = pipe.path, member = pipe.member->name](const rr::Result<rr::Value>& result) {
        const auto self = weak.lock();
        if (self) self->pipe_attached(number, path, member, result, is_first);
      });
}

void Upstream::pipe_attached(PipeNumber number, const std::string& path, const std::string& member,
                             const rr::Result<rr::Value>& result, bool is_first) {
  const auto found = pipes_.find(number);
  if (found == pipes_.end()) {  // everybody has left meanwhile
    if (result && connection_) connection_->disconnect_pipe(path, member, result->to<std::int32_t>().value(), ignore);
    return;
  }
  auto& pipe = found->second;
  if (!result) {
    if (!is_first && !connection_) return;  // lost again: the next attempt will do
    const auto endpoints = pipe.endpoints;
    if (!is_first) return drop_pipe(number);
    for (const auto& endpoint : endpoints) endpoints_.erase(endpoint);
    shared_pipes_.erase({pipe.path, pipe.member->name});
    pipes_.erase(found);
    for (const auto& endpoint : endpoints)
      if (has(*endpoint.first)) endpoint.first->refuse_pipe(endpoint.second, result.error());
    return;
  }
  pipe.index = result->to<std::int32_t>().value();
  pipe.state = PipeState::attached;
  const auto endpoints = pipe.endpoints;
  for (const auto& endpoint : endpoints)
    if (endpoints_.contains(endpoint)) endpoint.first->accept_pipe(endpoint.second);
}

void Upstream::leave_pipe(UpstreamClient& client, rr::PipeId id) {
  const EndpointKey endpoint(&client, id);
  const auto known = endpoints_.find(endpoint);
  if (known == endpoints_.end()) return;
  const auto found = pipes_.find(known->second);
  endpoints_.erase(known);
  auto& pipe = found->second;
  std::erase(pipe.endpoints, endpoint);
  if (!pipe.endpoints.empty()) return;
  if (connection_ && pipe.state == PipeState::attached)
    connection_->disconnect_pipe(pipe.path, pipe.member->name, pipe.index, ignore);
  if (pipe.member->direction() == rr::MemberDirection::readonly) shared_pipes_.erase({pipe.path, pipe.member->name});
  pipes_.erase(found);
}

void Upstream::drop_pipe(PipeNumber number) {
  const auto dropped = pipes_.extract(number);
  if (!dropped) return;
  const auto& pipe = dropped.mapped();
  if (const auto known = shared_pipes_.find({pipe.path, pipe.member->name});
      known != shared_pipes_.end() && known->second == number)
    shared_pipes_.erase(known);
  for (const auto& endpoint : pipe.endpoints) endpoints_.erase(endpoint);
  for (const auto& endpoint : pipe.endpoints)
    if (has(*endpoint.first)) endpoint.first->close_pipe(endpoint.second);
}

void Upstream::send_pipe(UpstreamClient& client, rr::PipeId id, const rr::Value& packet) {
  const auto known = endpoints_.find({&client, id});
  if (known == endpoints_.end()) return;
  auto& pipe = pipes_.at(known->second);
  const auto sent = pipe.state == PipeState::attached && connection_
                        ? connection_->send_pipe(pipe.path, pipe.member->name, pipe.index, packet)
                        : rr::Result<>(lost_error());
  if (sent) return;
  log(LogLevel::info, "pipe endpoint closed: the device takes no packet",
      {{"device", device_->config().name},
       {"pipe", pipe.path + "." + pipe.member->name},
       {"error", sent.error().message}});
  leave_pipe(client, id);
  client.close_pipe(id);
}

// --- callbacks ---

UpstreamClient* Upstream::owner_of_callback(const std::string& path) const {
  const auto here =
      std::find_if(calls_.rbegin(), calls_.rend(), [&](const OpenCall& call) { return call.path == path; });
  if (here != calls_.rend()) return here->client;
  if (!calls_.empty()) return calls_.back().client;
  return clients_.size() == 1 ? clients_.front() : nullptr;
}

void Upstream::route_callback(const std::string& path, const rr::MemberDefinition& callback,
                              std::span<const rr::Value> arguments, const rr::ClientConnection::CallbackReply& answer) {
  const auto name = path + "." + callback.name;
  auto policy = CallbackPolicy::owner;
  for (const auto& rule : device_->config().callbacks)
    if (rr::glob_matches(rule.member, name)) {
      policy = rule.policy;
      break;
    }
  if (policy == CallbackPolicy::all && !clients_.empty()) {
    struct Votes {
      std::size_t left;
      bool is_answered = false;
    };
    const auto votes = std::make_shared<Votes>(Votes{clients_.size()});
    const auto clients = clients_;
    for (auto* client : clients)
      client->call_callback(path, callback, arguments, [votes, answer](const rr::Result<rr::Value>& vote) {
        --votes->left;
        if (votes->is_answered || (!vote && votes->left > 0)) return;
        votes->is_answered = true;
        answer(vote);
      });
    return;
  }
  auto* client = policy == CallbackPolicy::first && !clients_.empty() ? clients_.front() : owner_of_callback(path);
  if (client) return client->call_callback(path, callback, arguments, answer);
  answer(
      rr::make_error(rr::ErrorCode::invalid_operation, "Callback function not set: " + std::to_string(clients_.size()) +
                                                           " clients share this session and none of them is meant"));
}

}  // namespace rrgate
