#include "server/upstream/upstream.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "node/client/unread_reply.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

std::uint64_t next_number() {
  static std::uint64_t last = 0;
  return ++last;
}

/// What a request does to a member. A peek is not what `nolockread` lets through.
MemberUse use_of(rr::CallKind kind) {
  switch (kind) {
    case rr::CallKind::property_get:
    case rr::CallKind::memory_read:
    case rr::CallKind::memory_dimensions:
      return MemberUse::read;
    case rr::CallKind::peek_in:
    case rr::CallKind::peek_out:
      return MemberUse::connect;
    default:
      return MemberUse::command;
  }
}

/// What ends something is nobody's harm.
bool ends_generator(const rr::Called& called) {
  return called.kind == rr::CallKind::generator_close || called.kind == rr::CallKind::generator_abort;
}

/// The object of a call: hosted services of shared devices have no others.
const std::string& path_of(const rr::Called& called) {
  return static_cast<const SharedObject&>(*called.object).path();
}

}  // namespace

bool is_refusal(const rr::Error& error) {
  return error.code == rr::ErrorCode::authentication_error || error.code == rr::ErrorCode::permission_denied;
}

Upstream::Upstream(std::shared_ptr<Device> device, std::string service, UpstreamLogin login, UpstreamUse use)
    : device_(std::move(device)),
      service_(std::move(service)),
      login_(std::move(login)),
      locks_(device_->locks_of(service_)),
      use_(use),
      number_(next_number()),
      wake_(device_->executor()),
      attempted_(device_->executor(), asio::steady_timer::time_point::max()) {}

Upstream::~Upstream() {
  if (locks_->is_owing()) device_->keep_owing(locks_);
}

rr::Error Upstream::session_has_ended() {
  return rr::make_error(rr::ErrorCode::connection_error, "the session with the device has ended");
}

// --- clients ---

void Upstream::add(UpstreamClient& client) {
  clients_.push_back(&client);
  wake();
  locks_->add(client, *this);
}

void Upstream::change_user(UpstreamClient& client) {
  if (!has(client)) return;  // it is leaving, and nobody would take it off again
  locks_->remove(client);
  locks_->add(client, *this);
}

bool Upstream::has(const UpstreamClient& client) const {
  return std::find(clients_.begin(), clients_.end(), &client) != clients_.end();
}

void Upstream::remove(UpstreamClient& client, std::function<void()> left) {
  if (std::erase(clients_, &client) == 0) {
    if (left) left();
    return;
  }
  ++clients_left_;
  shared_reads_.forget(client);
  callback_routes_.forget(client);
  for (;;) {  // the device may be lost with it, and end those of others
    const auto it = endpoints_.lower_bound({&client, 0});
    if (it == endpoints_.end() || it->first.first != &client) break;
    leave_pipe(client, it->first.second);
  }
  for (const auto& [key, wire] : wires_)
    if (wire->out_value && wire->out_value->sender == &client) wire->out_value.reset();
  std::vector<std::shared_ptr<Wire>> wires;
  for (const auto& [key, wire] : wires_)
    if (has_joined(client, key)) wires.push_back(wire);
  for (const auto& wire : wires) leave_wire(client, wire->path, wire->member);
  std::vector<rr::GeneratorId> generators;
  for (const auto& [key, generator] : generators_)
    if (key.first == &client) generators.push_back(key.second);
  for (const auto id : generators) drop_generator(client, id);
  locks_->remove(client, std::move(left));
  if (!clients_.empty()) return;
  if (closes_unused_) return close();
  if (is_open()) wake_.cancel();  // it is unused from now on
}

// --- requests ---

void Upstream::request(UpstreamClient& client, const rr::Called& called, Completion done) {
  if (!connection_) return done(lost_error());
  // What the device lost while it was asked is said in our words: clients know by them that it may come back.
  done = [weak = weak_from_this(), done = std::move(done)](rr::Result<rr::Value> result) {
    const auto self = weak.lock();
    if (result || !self) return done(std::move(result));
    if (!self->connection_) return done(self->lost_error());
    if (self->is_lost()) return done(self->lost_error(result.error()));
    // The device has done what it was asked for: clients must not take that for refused, and ask again.
    if (rr::is_unread_reply(result.error())) return done(rr::protocol_error(result.error().message));
    done(std::move(result));
  };
  const auto& path = path_of(called);
  if (!ends_generator(called))
    if (const auto allowed = locks_->check(client, path, *called.member, use_of(called.kind)); !allowed)
      return done(allowed.error());
  if (!connection_) return done(lost_error());  // a lease that has ended meanwhile had something sent
  if (!has(client)) return done(rr::make_error(rr::ErrorCode::operation_cancelled, "the client has left"));
  if (!connection_->session().object_type(path)) {  // another session of this service has found it
    return find_object(path, [weak = weak_from_this(), &client, life = client.life(), called,
                              done](const rr::Result<rr::Value>& found) {
      const auto self = weak.lock();
      if (!found) return done(found);
      if (!self || life.expired()) return done(session_has_ended());
      const auto& known_type = called.object->type_name();  // empty: whatever it is
      const auto type = std::string(found->to_text().value());
      if (!known_type.empty() && type != known_type) {
        self->handle_released(path_of(called));
        return done(rr::make_error(rr::ErrorCode::object_not_found,
                                   "object " + rr::quote(path_of(called)) + " is of type " + rr::quote(type) +
                                       " now, and no longer of " + rr::quote(known_type) + ": look it up again"));
      }
      self->request(client, called, done);
    });
  }
  if (device_->config().shares_reads && use_of(called.kind) == MemberUse::command) shared_reads_.note_command(client);
  if (called.generator != 0) return answer_generator(client, called, path, std::move(done));
  if (called.kind == rr::CallKind::function) {
    const auto number = callback_routes_.begin_call(client, path);
    done = [weak = weak_from_this(), number, done = std::move(done)](rr::Result<rr::Value> result) {
      if (const auto self = weak.lock()) self->callback_routes_.end_call(number);
      done(std::move(result));
    };
  }
  // It may be the last; nothing of it is touched where nothing is offered.
  const auto connection = locks_->is_urgent(path, *called.member) ? connection_ : nullptr;
  if (connection) connection->set_urgent(true);
  begin_request(client, called, path, std::move(done));
  if (connection) connection->set_urgent(false);
}

void Upstream::make_safe(const SafeRequest& request, Completion done) {
  if (!connection_) return done(lost_error());
  if (!connection_->session().object_type(request.path))  // another session of this service has found it
    return find_object(request.path,
                       [weak = weak_from_this(), request, done = std::move(done)](const rr::Result<rr::Value>& found) {
                         const auto self = weak.lock();
                         if (!found) return done(found);
                         if (!self) return done(session_has_ended());
                         self->make_safe(request, done);
                       });
  const auto count_answer = [this](Completion answered) {
    ++unanswered_->count;
    return [unanswered = unanswered_, answered = std::move(answered)](const rr::Result<rr::Value>& result) {
      answered(result);
      if (--unanswered->count == 0 && unanswered->on_none) std::exchange(unanswered->on_none, nullptr)();
    };
  };
  const auto connection = connection_;  // it may be lost
  const bool has_waiting = connection->session().queued_bytes() > 0;
  connection->set_urgent(true);
  send_safe(request, count_answer(std::move(done)));
  connection->set_urgent(false);
  // What waits may be an older command, which must not be the last one.
  if (has_waiting && connection_) send_safe(request, count_answer(ignore_result));
  const auto wire = wires_.find({request.path, request.member});
  if (request.kind != SafeAction::Kind::wire || wire == wires_.end()) return;
  wire->second->out_value.reset();
  if (connection_ && wire->second->state == AttachState::attached)
    (void)connection_->send_wire(request.path, request.member, request.values.front());
  else
    wire->second->out_value = OutValue{nullptr, request.values.front()};
}

void Upstream::forget_commands(std::string_view path) {
  for (const auto& [key, wire] : wires_) {
    if (!rr::is_within(key.first, path) || locks_->is_urgent(key.first, wire->member)) continue;
    wire->out_value.reset();
    if (connection_) connection_->drop_waiting_value(key.first, key.second);
  }
}

void Upstream::send_safe(const SafeRequest& request, Completion done) {
  switch (request.kind) {
    case SafeAction::Kind::call:
      return connection_->call(request.path, request.member, request.values, std::move(done));
    case SafeAction::Kind::wire:
      return connection_->poke_out(request.path, request.member, request.values.front(), std::move(done));
    case SafeAction::Kind::property:
      return connection_->set(request.path, request.member, request.values.front(), std::move(done));
  }
}

void Upstream::begin_request(const UpstreamClient& client, const rr::Called& called, const std::string& path,
                             Completion done) {
  const auto& name = called.member->name;
  switch (called.kind) {
    case rr::CallKind::property_get:
      if (!device_->config().shares_reads) return connection_->get(path, name, std::move(done));
      if (const auto read = shared_reads_.join(client, {path, name}, std::move(done)))
        connection_->get(path, name, [weak = weak_from_this(), read](const rr::Result<rr::Value>& value) {
          if (const auto self = weak.lock()) self->shared_reads_.handle_answer(read, value);
        });
      return;
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
  const auto life = client.life();  // once it has ended, its address may be another client's
  if (called.kind == rr::CallKind::generator_open) {
    auto opened = [weak = weak_from_this(), key, life, path, name,
                   done = std::move(done)](rr::Result<rr::Value> index) mutable {
      const auto self = weak.lock();
      if (index && self && self->connection_) {
        const auto number = index->to<std::int32_t>().value();
        if (!life.expired() && self->has(*key.first))
          self->generators_[key] = {path, name, number};
        else
          self->connection_->close_generator(path, name, number, ignore_result);
      }
      done(std::move(index));
    };
    connection_->open_generator(path, name, called.arguments, std::move(opened));
    return;
  }
  const auto found = generators_.find(key);
  if (found == generators_.end()) {
    if (called.kind != rr::CallKind::generator_next) return done(rr::Value());
    return done(rr::make_error(rr::ErrorCode::invalid_operation, "Invalid generator"));
  }
  const auto index = found->second.index;
  if (called.kind == rr::CallKind::generator_next) {
    auto stepped = [weak = weak_from_this(), key, life, done = std::move(done)](rr::Result<rr::Value> value) {
      if (const auto self = weak.lock(); self && !value && !life.expired())
        self->handle_failed_step(*key.first, key.second, value.error());
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

void Upstream::handle_failed_step(UpstreamClient& client, rr::GeneratorId id, const rr::Error& error) {
  // One that takes too long, or whose value can't be read, is still there, and is the client's to end.
  if (error.code == rr::ErrorCode::request_timeout || rr::is_unread_reply(error)) return;
  // The device has ended it, or has perhaps not heard of this step, which was too large to be sent.
  const bool has_ended = error.code == rr::ErrorCode::stop_iteration || error.code == rr::ErrorCode::operation_aborted;
  if (has_ended)
    generators_.erase({&client, id});
  else
    drop_generator(client, id);
}

void Upstream::drop_generator(UpstreamClient& client, rr::GeneratorId id) {
  const auto found = generators_.extract({&client, id});
  if (!found || !connection_) return;
  const auto& generator = found.mapped();
  connection_->close_generator(generator.path, generator.function, generator.index, ignore_result);
}

void Upstream::lock(UpstreamClient& client, const rr::LockWanted& wanted,
                    std::function<void(const rr::Result<>&)> done) {
  locks_->handle_wanted(client, wanted, std::move(done));
}

void Upstream::ask_for_lock(rr::LockCommand command, const std::string& path, std::chrono::milliseconds timeout,
                            Completion done) {
  if (!connection_) return done(lost_error());
  switch (command) {
    case rr::LockCommand::lock_for_user:
      connection_->lock(path, rr::LockKind::user, std::move(done));
      return;
    case rr::LockCommand::lock_for_client:
      connection_->lock(path, rr::LockKind::client, std::move(done));
      return;
    case rr::LockCommand::unlock:
      return connection_->unlock(path, std::move(done));
    case rr::LockCommand::enter_monitor:
      connection_->enter_monitor(path, timeout, std::move(done));
      return;
    case rr::LockCommand::exit_monitor:
      return connection_->exit_monitor(path, std::move(done));
    default:
      return done(rr::make_error(rr::ErrorCode::invalid_operation, "the device knows no leases"));
  }
}

// --- callbacks ---

void Upstream::route_callback(const std::string& path, const rr::MemberDefinition& callback,
                              std::span<const rr::Value> arguments, const rr::ClientConnection::CallbackReply& answer) {
  std::vector<UpstreamClient*> candidates;
  for (auto* client : clients_)
    if (client->may_answer(path, callback)) candidates.push_back(client);
  const auto asked = callback_routes_.choose(device_->config().callbacks, path, callback.name, std::move(candidates));
  if (asked.empty())
    return answer(rr::make_error(
        rr::ErrorCode::invalid_operation,
        "Callback function not set: " + std::to_string(clients_.size()) +
            " clients share this session and none of them is meant; \"callbacks\" of the device says who answers"));
  const auto take_answer = first_value(asked.size(), answer);
  for (auto* client : asked)  // one that is asked may end others
    if (has(*client))
      client->call_callback(path, callback, arguments, take_answer);
    else
      take_answer(rr::make_error(rr::ErrorCode::operation_aborted, "the client has gone"));
}

}  // namespace rrgate
