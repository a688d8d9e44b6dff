// Objects of an upstream: found once for all clients, found again after an outage, released. Layer: server/upstream.
#include <algorithm>
#include <boost/asio/post.hpp>

#include "core/session/service/hosted_service.hpp"
#include "core/session/service_path.hpp"
#include "node/driver/clocks.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// Objects that all clients together have found.
constexpr std::size_t max_objects = 65'536;

}  // namespace

/// Whoever has joined something has definitions in hand: they stay, unless the device says something else now.
void Upstream::take_over_definitions(const rr::TypeRegistry& from) {
  const auto differs = [&](const auto& definition) {
    const auto* known = types_->find_service(definition->name);
    return known && known->text != definition->text;
  };
  if (!types_ || std::any_of(from.definitions().begin(), from.definitions().end(), differs)) {
    const auto changed = rr::make_error(rr::ErrorCode::invalid_state, "the service has changed");
    while (!wires_.empty()) drop_wire(MemberKey(wires_.begin()->first), &changed);
    while (!pipes_.empty()) drop_pipe(pipes_.begin()->first);
    if (types_)
      asio::post(device_->executor(), [weak = weak_from_this()] {
        if (const auto self = weak.lock(); self && self->on_types_replaced_) self->on_types_replaced_();
      });
    types_ = std::make_shared<rr::TypeRegistry>();
  }
  types_->share(from);
}

const rr::EntityDefinition* Upstream::object_type(const std::string& path) const {
  const auto* type = connection_ ? connection_->session().object_type(path) : nullptr;
  return type ? types_->find_entity(type->qualified_name) : nullptr;
}

/// What an index is of is known by the object above it, which is found first.
void Upstream::find_object(const std::string& path, Completion done) {
  if (!connection_) return done(lost_error());
  const auto index = path.rfind('[');
  const auto dot = path.rfind('.', index);
  auto parent = path.substr(0, dot);
  if (index == std::string::npos || dot == std::string::npos || object_type(parent))
    return look_up(path, std::move(done));
  find_object(parent, [weak = weak_from_this(), path, done = std::move(done)](const rr::Result<rr::Value>& found) {
    const auto self = weak.lock();
    if (!found) return done(found);
    if (!self) return done(session_has_ended());
    self->look_up(path, done);
  });
}

/// A device may ignore the index of a plain objref (1.2.8 does), or take several spellings of one: locks, leases and
/// rights would not know the object. What is above the last index was checked when it was found.
rr::Result<> Upstream::check_index(std::string_view path) const {
  const auto index = path.rfind('[');
  const auto dot = path.rfind('.', index);
  if (index == std::string_view::npos || dot == std::string_view::npos) return {};
  const auto segments = rr::parse_service_path(path.substr(0, path.find(']', index) + 1));
  if (!segments) return segments.error();
  const auto* parent = object_type(std::string(path.substr(0, dot)));
  const auto* objref = parent ? parent->find_member(segments->back().name) : nullptr;
  if (!objref || objref->kind != rr::MemberKind::objref) return {};  // as the device says
  return rr::check_index(*objref, segments->back().index);
}

void Upstream::look_up(const std::string& path, Completion done) {
  if (!connection_) return done(lost_error());
  if (auto valid = check_index(path); !valid) return done(valid.error());
  if (objects_.size() >= max_objects && !objects_.contains(path))
    return done(
        rr::make_error(rr::ErrorCode::out_of_system_resource,
                       "clients of this device have found " + std::to_string(max_objects) + " objects already"));
  connection_->find_object(path, [weak = weak_from_this(), path, done = std::move(done)](rr::Result<rr::Value> found) {
    const auto self = weak.lock();
    if (self && self->connection_ && found) {
      self->take_over_definitions(self->connection_->session().types());
      if (const auto* type = self->object_type(path)) self->watch_object(path, *type);
    }
    done(std::move(found));
  });
}

/// Events and callbacks of an object reach all clients, whether or not they ever looked at it.
void Upstream::watch_object(const std::string& path, const rr::EntityDefinition& type) {
  objects_[path] = type.qualified_name;
  for (const auto& member : type.members) {
    if (member.kind == rr::MemberKind::event) {
      connection_->on_event(
          path, member.name,
          [weak = weak_from_this(), path, &member, types = types_](std::span<const rr::Value> arguments) {
            const auto self = weak.lock();
            if (!self) return;
            rr::EventPacket packet(path, member, arguments);
            const auto now = rr::read_clocks();
            self->for_each_client([&](UpstreamClient& client) { client.receive_event(packet, now); });
          });
    } else if (member.kind == rr::MemberKind::callback) {
      connection_->on_callback_later(
          path, member.name,
          [weak = weak_from_this(), path, &member, types = types_](std::span<const rr::Value> arguments,
                                                                   const rr::ClientConnection::CallbackReply& answer) {
            if (const auto self = weak.lock()) self->route_callback(path, member, arguments, answer);
          });
    }
  }
}

void Upstream::note_object(const std::string& path, const std::string& type) {
  if (objects_.size() < max_objects) objects_.try_emplace(path, type);
}

/// After the device has come back: what clients had found there, they have found again, or it is gone.
void Upstream::look_up_again() {
  auto known = objects_;
  // Also where it was lost while they were looked for.
  for (const auto& [key, wire] : wires_) known.try_emplace(key.first);
  for (const auto& [number, pipe] : pipes_) known.try_emplace(pipe.path);
  for (const auto& each : known)
    find_object(each.first, [weak = weak_from_this(), each](const rr::Result<rr::Value>& found) {
      if (const auto self = weak.lock()) self->handle_looked_up(each.first, each.second, found);
    });
}

void Upstream::handle_looked_up(const std::string& path, const std::string& known_type,
                                const rr::Result<rr::Value>& found) {
  if (is_lost()) return;
  // What one login does not get others may have still, by sessions of theirs.
  if (!found && (use_ != UpstreamUse::all_clients || is_refusal(found.error()))) return drop_objects(path);
  if (!found || (!known_type.empty() && found->to_text().value() != known_type)) return handle_released(path);
  std::vector<MemberKey> wires;
  for (const auto& [key, wire] : wires_)
    if (key.first == path) wires.push_back(key);
  for (const auto& key : wires) attach_wire(key);
  std::vector<PipeNumber> pipes;
  for (const auto& [number, pipe] : pipes_)
    if (pipe.path == path) pipes.push_back(number);
  for (const auto number : pipes) attach_pipe(number);
  for_each_client([&](UpstreamClient& client) { client.found_again(path); });
}

void Upstream::drop_objects(const std::string& path) {
  std::erase_if(objects_, [&](const auto& each) { return rr::is_within(each.first, path); });
  std::vector<MemberKey> wires;
  for (const auto& [key, wire] : wires_)
    if (rr::is_within(key.first, path)) wires.push_back(key);
  for (const auto& key : wires) drop_wire(key, nullptr);
  std::vector<PipeNumber> pipes;
  for (const auto& [number, pipe] : pipes_)
    if (rr::is_within(pipe.path, path)) pipes.push_back(number);
  for (const auto number : pipes) drop_pipe(number);
  std::erase_if(generators_, [&](const auto& each) { return rr::is_within(each.second.path, path); });
  for_each_client([&](UpstreamClient& client) { client.release_path(path); });
}

/// There may be other objects now, or none.
void Upstream::handle_released(const std::string& path) {
  const auto self = shared_from_this();
  locks_->handle_released(path);
  if (on_released_) on_released_(path);
  drop_objects(path);
  locks_->check_safe_values(path, self);
}

}  // namespace rrgate
