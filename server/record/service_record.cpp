#include "server/record/service_record.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <deque>

#include "core/support/glob.hpp"
#include "node/client/client.hpp"
#include "node/driver/clocks.hpp"
#include "server/http/split_path.hpp"
#include "server/json/arguments.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::size_t readings_at_once = 8;  // of properties
/// For so long a problem stays that values may come in spite of.
constexpr std::chrono::seconds shortest_problem{10};

bool is_recordable(const rr::MemberDefinition& member) {
  using enum rr::MemberKind;
  const bool is_kind = member.kind == wire || member.kind == pipe || member.kind == event || member.kind == property;
  return is_kind && member.direction() != rr::MemberDirection::writeonly;
}

[[noreturn]] void give_up(std::string why) {
  throw rr::ClientException(rr::make_error(rr::ErrorCode::invalid_argument, std::move(why)));
}

std::string recordable_names(const rr::EntityDefinition& type) {
  std::string out;
  for (const auto& member : type.members)
    if (is_recordable(member)) out += (out.empty() ? "" : ", ") + member.name;
  return out.empty() ? "none" : out;
}

rr::OrderedJson attributes_json(const rr::ClientSession& session) {
  rr::TypeDefinition type;
  type.type = rr::DataType::varvalue_t;
  type.container = rr::ContainerKind::map_string;
  const auto json = rr::value_to_json(rr::Value(session.attributes()), type, session.types());
  return json ? *json : rr::OrderedJson::object();
}

}  // namespace

void ServiceRecord::close() {
  is_closed_ = true;
  end_connection();
}

void ServiceRecord::begin(const rr::Result<>& outcome) {
  if (!std::exchange(has_begun_, true) && !is_closed_) listener_.begun(outcome);
}

std::string ServiceRecord::text_of(const std::string& where, const std::string& what) const {
  return url_ + ": " + where + ": " + what;
}

void ServiceRecord::tell_problem(const std::string& where, const std::string& what) {
  if (is_closed_) return;
  auto& problem = problems_[where];
  if (problem.what == what) return;
  problem = {what, ++last_problem_, std::chrono::steady_clock::now()};
  listener_.problem(text_of(where, what));
}

void ServiceRecord::solve_problem(const std::string& where) {
  if (problems_.erase(where) == 0 || is_closed_ || !listener_.solved) return;
  const auto newest = std::max_element(problems_.begin(), problems_.end(),
                                       [](const auto& a, const auto& b) { return a.second.number < b.second.number; });
  listener_.solved(newest == problems_.end() ? std::string() : text_of(newest->first, newest->second.what));
}

/// Where some values can be recorded and others can't, the problem is not told with each of them.
void ServiceRecord::handle_value(const RecordedMemberPlace& from) {
  if (problems_.empty()) return;
  const auto found = problems_.find(from.name());
  if (found != problems_.end() && std::chrono::steady_clock::now() - found->second.told >= shortest_problem)
    solve_problem(from.name());
}

// --- which members ---

asio::awaitable<ServiceRecord::Choice> ServiceRecord::choose(const rr::ClientSession& session,
                                                             const rr::TypeRegistry& types, FindObject find) {
  const auto self = shared_from_this();
  const bool is_first = !service_;
  RecordedService service;
  Choice out;
  const auto* root = co_await find(session.service());
  service.type = root->qualified_name;
  service.objects[session.service()] = service.type;
  for (const auto& pattern : options_.members) {
    const auto before = out.members.size();
    const auto where = rr::quote(pattern);  // no name of a member
    std::string refusal;
    try {
      co_await choose_by(pattern, session, find, service, out.members);
    } catch (const rr::Exception& failure) {
      if (failure.error().code == rr::ErrorCode::connection_error) throw;
      refusal = failure.what();
    }
    if (refusal.empty() && out.members.size() == before)
      refusal = "no member to record; " + service.type + " has: " + recordable_names(*root);
    if (!refusal.empty() && is_first && options_.members.size() == 1) give_up(where + ": " + refusal);
    if (refusal.empty()) {
      solve_problem(where);
    } else {
      tell_problem(where, refusal);
      out.is_complete = false;
    }
  }
  if (is_first && out.members.empty()) give_up("has none of the members to record");
  if (!is_closed_) add_to_file(session, types, service, out.members);
  co_return out;
}

asio::awaitable<void> ServiceRecord::choose_by(std::string pattern, const rr::ClientSession& session,
                                               const FindObject& find, RecordedService& service,
                                               std::vector<RecordedMemberPlace>& chosen) {
  const auto segments = split_path(pattern);
  if (!segments || segments->empty()) give_up("is no path of a member; expected \"state\" or \"axes/0/*\"");
  auto path = session.service();
  const auto* type = co_await find(path);
  expect_known_type(path, *type);
  std::string place;
  for (std::size_t i = 0; i + 1 < segments->size(); ++i) {
    const auto& name = (*segments)[i];
    const auto* member = type->find_member(name);
    if (!member || member->kind != rr::MemberKind::objref)
      give_up("no objref " + rr::quote(name) + " in " + type->qualified_name);
    std::optional<std::string> index;
    place += (place.empty() ? "" : "/") + name;
    if (member->is_indexed()) {
      if (++i + 1 >= segments->size()) give_up("objref " + rr::quote(name) + " needs an index: " + name + "/INDEX/*");
      index = (*segments)[i];
      place += "/" + *index;
    }
    path = rr::child_path(path, name, index);
    type = co_await find(path);
    expect_known_type(path, *type);
    service.objects.emplace(path, type->qualified_name);
  }
  for (const auto& member : type->members) {
    const auto is_same = [&, member_of = &member](const RecordedMemberPlace& other) {
      return other.place == place && other.member == member_of;
    };
    if (is_recordable(member) && rr::glob_matches(segments->back(), member.name) &&
        std::none_of(chosen.begin(), chosen.end(), is_same))
      chosen.push_back({path, place, &member});
  }
}

/// A channel has one type, and a replay has one for each object.
void ServiceRecord::expect_known_type(const std::string& path, const rr::EntityDefinition& type) const {
  if (!service_) return;
  const auto known = service_->objects.find(path);
  if (known != service_->objects.end() && known->second != type.qualified_name)
    give_up("object " + rr::quote(path) + " is of type " + type.qualified_name + " now, and was recorded as " +
            known->second);
}

/// Members that the file has already keep their channels; what is reachable only now is added.
void ServiceRecord::add_to_file(const rr::ClientSession& session, const rr::TypeRegistry& types,
                                RecordedService& service, std::vector<RecordedMemberPlace>& chosen) {
  const auto take = [this](const auto& done) {
    if (done) return;
    if (!is_closed_) listener_.failed(done.error());
    throw rr::ClientException(done.error());
  };
  bool has_more = false;
  auto known = service_ ? service_->definitions : std::vector<std::string>();
  for (const auto& definition : types.definitions()) {
    if (std::find(known.begin(), known.end(), definition->text) != known.end()) continue;
    if (!definition_names_.insert(definition->name).second)
      give_up("the service has come back with other definitions: it is recorded no more");
    known.push_back(definition->text);
    has_more = true;
  }
  if (!service_) {
    service.label = writer_.free_label(session.service());
    service.url = url_;
    service.service = session.service();
    service.node = session.connection().peer();
    service.attributes = attributes_json(session);
    service_ = service;
  }
  const auto known_objects = service_->objects.size();
  service_->definitions = std::move(known);
  service_->objects.merge(service.objects);
  if (has_more || service_->objects.size() != known_objects) take(writer_.add_service(*service_));
  rr::OrderedJson schemas;
  for (auto& each : chosen) {
    auto channel = channels_.find(each.name());
    if (channel == channels_.end()) {
      if (schemas.is_null()) schemas = rr::named_type_schemas(types);
      const auto added = writer_.add_member(*service_, each.path, each.place, *each.member, schemas);
      take(added);
      channel = channels_.emplace(each.name(), *added).first;
    }
    each.channel = channel->second;
  }
}

// --- values ---

struct ServiceRecord::Schedule {
  struct Due {
    std::chrono::steady_clock::time_point time;
    RecordedMemberPlace property;
  };
  asio::any_io_executor executor;
  std::uint64_t connection;
  std::shared_ptr<const rr::TypeRegistry> types;
  GetProperty get;
  std::deque<Due> due = {};
};

void ServiceRecord::read_properties(const asio::any_io_executor& executor,
                                    const std::vector<RecordedMemberPlace>& properties,
                                    std::shared_ptr<const rr::TypeRegistry> types, GetProperty get) {
  const auto schedule = std::make_shared<Schedule>(Schedule{executor, connection_, std::move(types), std::move(get)});
  for (const auto& each : properties) schedule->due.push_back({std::chrono::steady_clock::now(), each});
  for (std::size_t i = 0; i < std::min(properties.size(), readings_at_once); ++i)
    asio::co_spawn(executor, read_what_is_due(schedule), asio::detached);
}

/// One of those who share the properties: a slow one holds up its reader alone.
asio::awaitable<void> ServiceRecord::read_what_is_due(std::shared_ptr<Schedule> schedule) {
  const auto self = shared_from_this();
  asio::steady_timer timer(schedule->executor);
  while (schedule->connection == connection_) {
    auto next = std::move(schedule->due.front());  // not empty: each reader holds one, and there are no more than these
    schedule->due.pop_front();
    timer.expires_at(next.time);
    co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
    if (schedule->connection != connection_) co_return;
    std::string refusal;
    try {
      const auto value = co_await schedule->get(next.property);
      if (schedule->connection == connection_) {
        write_value(next.property, *schedule->types, value, {});
      }
    } catch (const rr::Exception& failure) {
      refusal = failure.what();
    }
    if (schedule->connection != connection_) co_return;
    if (!refusal.empty()) tell_problem(next.property.name(), refusal);
    next.time = std::max(next.time + options_.interval, std::chrono::steady_clock::now());
    schedule->due.push_back(std::move(next));
  }
}

void ServiceRecord::write_value(const RecordedMemberPlace& from, const rr::TypeRegistry& types, const rr::Value& value,
                                std::optional<rr::TimeSpec> sent) {
  auto json = rr::value_to_json(value, from.member->type, types);
  if (!json) return tell_problem(from.name(), json.error().message);
  auto message = rr::OrderedJson::object();
  message["value"] = std::move(*json);
  write(from, message, sent);
}

void ServiceRecord::write_event(const RecordedMemberPlace& from, const rr::TypeRegistry& types,
                                std::span<const rr::Value> values) {
  const auto json = rr::arguments_to_json(values, *from.member, types, {});
  if (json)
    write(from, *json, {});
  else
    tell_problem(from.name(), json.error().message);
}

void ServiceRecord::write(const RecordedMemberPlace& from, const rr::OrderedJson& message,
                          std::optional<rr::TimeSpec> sent) {
  if (is_closed_) return;
  const auto written = writer_.write(from.channel, message, sent, rr::read_clocks().utc);
  if (written)
    handle_value(from);
  else if (written.error().code == rr::ErrorCode::out_of_range)
    tell_problem(from.name(), written.error().message);
  else
    listener_.failed(written.error());
}

}  // namespace rrgate
