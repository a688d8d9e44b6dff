#include "server/record/recorder.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/support/glob.hpp"
#include "node/driver/clocks.hpp"
#include "server/http/split_path.hpp"
#include "server/json/arguments.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::size_t readings_at_once = 8;  // of properties

bool is_recordable(const rr::MemberDefinition& member) {
  using enum rr::MemberKind;
  const bool is_kind = member.kind == wire || member.kind == pipe || member.kind == event || member.kind == property;
  return is_kind && member.direction() != rr::MemberDirection::writeonly;
}

bool is_indexed_objref(const rr::MemberDefinition& member) {
  return member.type.array != rr::ArrayKind::none || member.type.container != rr::ContainerKind::none;
}

[[noreturn]] void give_up(std::string why) {
  throw rr::ClientException(rr::make_error(rr::ErrorCode::invalid_argument, std::move(why)));
}

const rr::EntityDefinition& type_of(const rr::AsyncObject& object) {
  const auto* type = object.connection()->session().object_type(object.path());
  if (!type) give_up("the type of " + rr::quote(object.path()) + " is not known");
  return *type;
}

std::string recordable_names(const rr::EntityDefinition& type) {
  std::string out;
  for (const auto& member : type.members)
    if (is_recordable(member)) out += (out.empty() ? "" : ", ") + member.name;
  return out.empty() ? "none" : out;
}

rr::OrderedJson attributes_json(const rr::AsyncObject& root) {
  const auto& session = root.connection()->session();
  rr::TypeDefinition type;
  type.type = rr::DataType::varvalue_t;
  type.container = rr::ContainerKind::map_string;
  const auto json = rr::value_to_json(rr::Value(session.attributes()), type, session.types());
  return json ? *json : rr::OrderedJson::object();
}

std::string place_and_member(const std::string& place, const std::string& member) {
  return place.empty() ? member : place + "/" + member;
}

}  // namespace

void Recorder::start(const std::string& url, const rr::ConnectOptions& options) {
  url_ = url;
  rr::SubscriptionOptions how;
  how.connect = options;
  subscription_ = rr::subscribe_service(io_, url, how);
  const std::weak_ptr<Recorder> weak = weak_from_this();
  subscription_->on_failed([weak](const rr::Error& error, const std::string&) {
    if (const auto self = weak.lock()) self->begin(error);
  });
  subscription_->on_lost([weak](const rr::AsyncObject&, const rr::Error& reason) {
    const auto self = weak.lock();
    if (!self) return;
    ++self->connection_;
    self->tell_problem("connection", "lost: " + reason.message);
  });
  subscription_->on_connected([weak](const rr::AsyncObject& root) {
    if (const auto self = weak.lock()) asio::co_spawn(self->io_, self->handle_connected(root), asio::detached);
  });
}

void Recorder::close() {
  is_closed_ = true;
  ++connection_;
  if (subscription_) subscription_->close();
}

void Recorder::begin(const rr::Result<>& outcome) {
  if (!std::exchange(has_begun_, true) && !is_closed_) listener_.begun(outcome);
}

void Recorder::tell_problem(const std::string& where, const std::string& what) {
  if (!is_closed_ && std::exchange(problems_[where], what) != what)
    listener_.problem(url_ + ": " + where + ": " + what);
}

asio::awaitable<void> Recorder::handle_connected(rr::AsyncObject root) {
  const auto self = shared_from_this();
  try {
    co_await record(root);
  } catch (const rr::Exception& failure) {
    if (has_begun_)
      tell_problem("connection", failure.what());
    else
      begin(failure.error());
  }
}

asio::awaitable<void> Recorder::record(const rr::AsyncObject& root) {
  const auto connection = ++connection_;
  RecordedService service;
  auto chosen = co_await choose(root, service);
  if (is_closed_) co_return;
  add_to_file(root, service, chosen);
  std::vector<Chosen> properties;
  for (const auto& each : chosen) {
    const auto where = place_and_member(each.place, each.member->name);
    std::string refusal;
    if (each.member->kind == rr::MemberKind::property) {
      properties.push_back(each);
      continue;
    }
    try {
      co_await follow(each);
      problems_.erase(where);
    } catch (const rr::Exception& failure) {
      refusal = failure.what();
    }
    if (!refusal.empty()) tell_problem(where, refusal);
  }
  problems_.erase("connection");
  begin({});
  read_properties(properties, connection);
}

asio::awaitable<std::vector<Recorder::Chosen>> Recorder::choose(const rr::AsyncObject& root, RecordedService& service) {
  std::vector<Chosen> out;
  service.objects[root.path()] = type_of(root).qualified_name;
  for (const auto& pattern : options_.members) {
    const auto before = out.size();
    std::string refusal;
    try {
      co_await choose_by(pattern, root, service, out);
    } catch (const rr::Exception& failure) {
      refusal = failure.what();
    }
    if (refusal.empty() && out.size() == before)
      refusal = "no member to record; " + type_of(root).qualified_name + " has: " + recordable_names(type_of(root));
    if (!refusal.empty() && options_.members.size() == 1) give_up(rr::quote(pattern) + ": " + refusal);
    if (!refusal.empty()) tell_problem(pattern, refusal);
  }
  if (out.empty()) give_up("has none of the members to record");
  co_return out;
}

asio::awaitable<void> Recorder::choose_by(const std::string& pattern, const rr::AsyncObject& root,
                                          RecordedService& service, std::vector<Chosen>& chosen) {
  const auto segments = split_path(pattern);
  if (!segments || segments->empty()) give_up("is no path of a member; expected \"state\" or \"axes/0/*\"");
  auto object = root;
  std::string place;
  for (std::size_t i = 0; i + 1 < segments->size(); ++i) {
    const auto& name = (*segments)[i];
    const auto* member = type_of(object).find_member(name);
    if (!member || member->kind != rr::MemberKind::objref)
      give_up("no objref " + rr::quote(name) + " in " + type_of(object).qualified_name);
    std::optional<std::string> index;
    place = place_and_member(place, name);
    if (is_indexed_objref(*member)) {
      if (++i + 1 >= segments->size()) give_up("objref " + rr::quote(name) + " needs an index: " + name + "/INDEX/*");
      index = (*segments)[i];
      place += "/" + *index;
    }
    object = co_await object.object(name, index);
    service.objects[object.path()] = type_of(object).qualified_name;
  }
  for (const auto& member : type_of(object).members) {
    const auto is_same = [&, member_of = &member](const Chosen& other) {
      return other.place == place && other.member == member_of;
    };
    if (is_recordable(member) && rr::glob_matches(segments->back(), member.name) &&
        std::none_of(chosen.begin(), chosen.end(), is_same))
      chosen.push_back({object, place, &member});
  }
}

/// Members that the file has already keep their channels; what is reachable only now is added.
void Recorder::add_to_file(const rr::AsyncObject& root, RecordedService& service, std::vector<Chosen>& chosen) {
  const auto& session = root.connection()->session();
  for (const auto& definition : session.types().definitions()) service.definitions.push_back(definition->text);
  const auto take = [this](const auto& done) {
    if (done) return;
    if (!is_closed_) listener_.failed(done.error());
    throw rr::ClientException(done.error());
  };
  if (service_ && service.definitions != service_->definitions)
    give_up("the service has come back with other definitions: it is recorded no more");
  if (!service_) {
    service.label = writer_.free_label(session.service());
    service.url = url_;
    service.service = session.service();
    service.type = type_of(root).qualified_name;
    service.node = session.connection().peer();
    service.attributes = attributes_json(root);
    take(writer_.add_service(service));
    service_ = service;
  }
  const auto known_objects = service_->objects.size();
  service_->objects.merge(service.objects);
  if (service_->objects.size() != known_objects) take(writer_.add_service(*service_));
  for (auto& each : chosen) {
    const auto where = place_and_member(each.place, each.member->name);
    auto channel = channels_.find(where);
    if (channel == channels_.end()) {
      const auto added = writer_.add_member(*service_, each.object.path(), each.place, *each.member, session.types());
      take(added);
      channel = channels_.emplace(where, *added).first;
    }
    each.channel = channel->second;
  }
}

asio::awaitable<void> Recorder::follow(const Chosen& chosen) {
  const auto& name = chosen.member->name;
  const std::weak_ptr<Recorder> weak = weak_from_this();
  // Without the connection, which has the handlers.
  Chosen at = chosen;
  at.object = {};
  const auto* types = &chosen.object.connection()->session().types();
  if (chosen.member->kind == rr::MemberKind::event) {
    chosen.object.on_event(name, [weak, at, types](std::span<const rr::Value> values) {
      const auto self = weak.lock();
      if (!self) return;
      const auto json = rr::arguments_to_json(values, *at.member, *types, {});
      if (json)
        self->write(at.channel, *json, {});
      else
        self->tell_problem(at.member->name, json.error().message);
    });
    co_return;
  }
  const auto received = [weak, at, types](const rr::Value& value, std::optional<rr::TimeSpec> sent) {
    if (const auto self = weak.lock()) self->write_value(at, *types, value, sent);
  };
  if (chosen.member->kind == rr::MemberKind::wire) {
    rr::ClientConnection::WireHandler handler = [received](const rr::Value& value, rr::TimeSpec time) {
      received(value, time);
    };
    co_await chosen.object.connect_wire(name, std::move(handler));
  } else {
    rr::ClientConnection::PipeHandlers handlers;
    handlers.received = [received](const rr::Value& packet) { received(packet, {}); };
    handlers.closed = [weak, at] {
      if (const auto self = weak.lock())
        self->tell_problem(place_and_member(at.place, at.member->name), "the device has closed the pipe");
    };
    co_await chosen.object.connect_pipe(name, std::move(handlers));
  }
}

void Recorder::read_properties(const std::vector<Chosen>& properties, std::uint64_t connection) {
  const auto due = std::make_shared<std::deque<Due>>();
  for (const auto& each : properties) due->push_back({std::chrono::steady_clock::now(), each});
  for (std::size_t i = 0; i < std::min(properties.size(), readings_at_once); ++i)
    asio::co_spawn(io_, read_what_is_due(due, connection), asio::detached);
}

/// One of those who share the properties: a slow one holds up its reader alone.
asio::awaitable<void> Recorder::read_what_is_due(std::shared_ptr<std::deque<Due>> due, std::uint64_t connection) {
  const auto self = shared_from_this();
  asio::steady_timer timer(io_);
  while (connection == connection_) {
    auto next = std::move(due->front());  // not empty: each reader holds one, and there are no more readers than these
    due->pop_front();
    timer.expires_at(next.time);
    co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
    if (connection != connection_) co_return;
    const auto& each = next.property;
    std::string refusal;
    try {
      const auto value = co_await each.object.get(each.member->name);
      if (connection == connection_) write_value(each, each.object.connection()->session().types(), value, {});
    } catch (const rr::Exception& failure) {
      refusal = failure.what();
    }
    if (connection != connection_) co_return;
    if (!refusal.empty()) tell_problem(place_and_member(each.place, each.member->name), refusal);
    next.time = std::max(next.time + options_.interval, std::chrono::steady_clock::now());
    due->push_back(std::move(next));
  }
}

void Recorder::write_value(const Chosen& chosen, const rr::TypeRegistry& types, const rr::Value& value,
                           std::optional<rr::TimeSpec> sent) {
  auto json = rr::value_to_json(value, chosen.member->type, types);
  if (!json) return tell_problem(place_and_member(chosen.place, chosen.member->name), json.error().message);
  auto message = rr::OrderedJson::object();
  message["value"] = std::move(*json);
  write(chosen.channel, message, sent);
}

void Recorder::write(std::uint16_t channel, const rr::OrderedJson& message, std::optional<rr::TimeSpec> sent) {
  if (is_closed_) return;
  const auto written = writer_.write(channel, message, sent, rr::read_clocks().utc);
  if (written) return;
  if (written.error().code == rr::ErrorCode::out_of_range)
    tell_problem(writer_.topics().at(channel), written.error().message);
  else
    listener_.failed(written.error());
}

}  // namespace rrgate
