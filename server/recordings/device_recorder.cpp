#include "server/recordings/device_recorder.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "node/values/exception.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// How often it is looked whether the service, and all that is followed of it, is still there.
constexpr std::chrono::milliseconds watch_period{1000};
/// What is missing is looked for again so often.
constexpr std::chrono::seconds missing_period{5};

bool is_same_place(const RecordedMemberPlace& a, const RecordedMemberPlace& b) {
  return a.path == b.path && a.member == b.member;
}

asio::awaitable<const rr::EntityDefinition*> find_object(std::shared_ptr<ValueClient> client, std::string path) {
  const auto upstream = client->upstream();
  if (!upstream->object_type(path)) co_await client->find_object(path);
  const auto* type = upstream->object_type(path);
  if (!type) throw rr::Exception(upstream->lost_error());
  co_return type;
}

asio::awaitable<rr::Value> read_property(std::shared_ptr<ValueClient> client, std::string path, std::string type,
                                         const rr::MemberDefinition* property) {
  rr::Called called;
  called.kind = rr::CallKind::property_get;
  called.object = std::make_shared<SharedObject>(std::move(path), std::move(type));
  called.member = property;
  co_return co_await client->ask(std::move(called));
}

}  // namespace

DeviceRecorder::DeviceRecorder(std::shared_ptr<Device> device, std::string service, ValueClients& clients,
                               RecordingWriter& writer, RecorderOptions options, RecordListener listener)
    : device_(std::move(device)),
      service_(std::move(service)),
      clients_(clients),
      failed_(listener.failed),
      record_(std::make_shared<ServiceRecord>(writer, rr::format_url(device_->config().url), std::move(options),
                                              std::move(listener))),
      backoff_(device_->retry().min, device_->retry().max),
      wake_(device_->executor()) {}

void DeviceRecorder::start() {
  const auto keep_running = [](std::shared_ptr<DeviceRecorder> self) -> asio::awaitable<void> { co_await self->run(); };
  asio::co_spawn(device_->executor(), keep_running(shared_from_this()), asio::detached);
}

void DeviceRecorder::close() {
  record_->close();
  leave();
  wake_.cancel();
}

void DeviceRecorder::leave() {
  record_->end_connection();
  client_.reset();
  followed_.clear();
  properties_.clear();
}

asio::awaitable<void> DeviceRecorder::wait(std::chrono::milliseconds time) {
  wake_.expires_after(time);
  co_await wake_.async_wait(asio::as_tuple(asio::use_awaitable));
}

asio::awaitable<void> DeviceRecorder::run() {
  while (!record_->is_closed()) {
    SessionKey key{service_};
    const auto client = co_await clients_.open(device_, std::move(key));
    if (record_->is_closed()) co_return;
    rr::Result<> outcome;
    if (!client) outcome = client.error();
    if (client) {
      try {
        co_await record(*client);
      } catch (const rr::Exception& failure) {
        outcome = failure.error();
      }
    }
    leave();
    if (record_->is_closed()) co_return;
    if (!outcome && outcome.error().code == rr::ErrorCode::invalid_argument) {
      failed_(outcome.error());
      co_return;
    }
    if (!outcome) record_->tell_problem("connection", outcome.error().message);  // a device that is away may come
    co_await wait(backoff_.next());
  }
}

/// As long as the service is the one that it was. Wires and pipes outlive a connection; its objects may be others then.
asio::awaitable<void> DeviceRecorder::record(std::shared_ptr<ValueClient> client) {
  const auto upstream = client->upstream();
  const auto types = upstream->types();
  std::weak_ptr<rr::ClientConnection> seen;  // the connection of the last choice
  bool is_complete = false;
  std::chrono::steady_clock::time_point next_search{};
  const auto must_choose = [&] {
    if (!upstream->is_open()) return false;
    if (seen.lock() != upstream->connection() || has_one_ended()) return true;
    return !is_complete && std::chrono::steady_clock::now() >= next_search;
  };
  if (!upstream->is_open()) throw rr::Exception(upstream->lost_error());
  while (!record_->is_closed() && !upstream->is_closed() && upstream->types() == types) {
    if (must_choose()) {
      seen = upstream->connection();
      is_complete = co_await follow_chosen(client);
      next_search = std::chrono::steady_clock::now() + missing_period;
      if (record_->is_closed()) co_return;
      backoff_.reset();
      client_ = client;
      record_->solve_problem("connection");
      record_->begin({});
    }
    co_await wait(watch_period);
  }
}

bool DeviceRecorder::has_one_ended() const {
  return std::any_of(followed_.begin(), followed_.end(), [](const Followed& each) { return *each.has_ended; });
}

asio::awaitable<bool> DeviceRecorder::follow_chosen(std::shared_ptr<ValueClient> client) {
  const auto connection = client->upstream()->connection();
  const std::shared_ptr<const rr::TypeRegistry> types = client->upstream()->types();
  ServiceRecord::FindObject find = [client](std::string path) { return find_object(client, std::move(path)); };
  const auto choice = co_await record_->choose(connection->session(), *types, std::move(find));
  const auto is_chosen = [&choice](const Followed& followed) {
    return std::any_of(choice.members.begin(), choice.members.end(),
                       [&](const auto& each) { return is_same_place(each, followed.member); });
  };
  std::erase_if(followed_, [&](const Followed& each) { return *each.has_ended || !is_chosen(each); });
  bool is_complete = choice.is_complete;
  std::vector<RecordedMemberPlace> properties;
  for (const auto& each : choice.members) {
    if (record_->is_closed()) co_return false;
    if (each.member->kind == rr::MemberKind::property) {
      properties.push_back(each);
      continue;
    }
    const auto is_it = [&each](const Followed& followed) { return is_same_place(each, followed.member); };
    if (std::any_of(followed_.begin(), followed_.end(), is_it)) continue;
    const bool is_followed = co_await follow(client, each, types);
    is_complete = is_complete && is_followed;
  }
  if (!record_->is_closed()) read(client, std::move(properties));
  co_return is_complete;
}

/// Those that are read already go on in their time.
void DeviceRecorder::read(const std::shared_ptr<ValueClient>& client, std::vector<RecordedMemberPlace> properties) {
  const bool is_same = client_ == client && std::equal(properties.begin(), properties.end(), properties_.begin(),
                                                       properties_.end(), is_same_place);
  if (is_same) return;
  properties_ = std::move(properties);
  record_->end_connection();
  record_->read_properties(
      device_->executor(), properties_, client->upstream()->types(), [client](const RecordedMemberPlace& property) {
        const auto* type = client->upstream()->object_type(property.path);
        return read_property(client, property.path, type ? type->qualified_name : std::string(), property.member);
      });
}

asio::awaitable<bool> DeviceRecorder::follow(std::shared_ptr<ValueClient> client, RecordedMemberPlace member,
                                             std::shared_ptr<const rr::TypeRegistry> types) {
  const std::weak_ptr<ServiceRecord> weak = record_;
  Followed followed{member};
  SampleHandler handler = [weak, member, types, has_ended = followed.has_ended](const SamplePtr& sample,
                                                                                const rr::Error* error) {
    const auto record = weak.lock();
    if (!record) return;
    if (!sample) {
      if (!error) return record->solve_problem(member.name());
      if (error->code != rr::ErrorCode::connection_error) *has_ended = true;
      record->tell_problem(member.name(), error->message);
    } else if (member.member->kind == rr::MemberKind::event) {
      record->write_event(member, *types, sample->values);
    } else {
      const bool is_wire = member.member->kind == rr::MemberKind::wire;
      record->write_value(member, *types, sample->values.at(0), is_wire ? std::optional(sample->time) : std::nullopt);
    }
  };
  MemberPlace place{member.path, member.member, types};
  auto listener = co_await client->listen(std::move(place), 0, std::move(handler));
  if (!listener) {
    record_->tell_problem(member.name(), listener.error().message);
    co_return false;
  }
  record_->solve_problem(member.name());
  followed.listener = std::move(*listener);
  followed_.push_back(std::move(followed));
  co_return true;
}

}  // namespace rrgate
