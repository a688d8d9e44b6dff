#include "server/recordings/device_recorder.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "node/values/exception.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// How often it is looked whether the service is still the one that is recorded.
constexpr std::chrono::milliseconds watch_period{1000};

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
  client_.reset();
  listeners_.clear();
  wake_.cancel();
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
    client_.reset();
    listeners_.clear();
    record_->end_connection();
    if (record_->is_closed()) co_return;
    if (!outcome && outcome.error().code == rr::ErrorCode::invalid_argument) {
      failed_(outcome.error());
      co_return;
    }
    if (!outcome) record_->tell_problem("connection", outcome.error().message);  // a device that is away may come
    co_await wait(backoff_.next());
  }
}

/// As long as the service is the one that it was.
asio::awaitable<void> DeviceRecorder::record(std::shared_ptr<ValueClient> client) {
  const auto upstream = client->upstream();
  const auto connection = upstream->connection();
  if (!connection) throw rr::Exception(upstream->lost_error());
  const std::shared_ptr<const rr::TypeRegistry> types = upstream->types();
  ServiceRecord::FindObject find = [client](std::string path) { return find_object(client, std::move(path)); };
  const auto chosen = co_await record_->choose(connection->session(), *types, std::move(find));
  std::vector<RecordedMemberPlace> properties;
  for (const auto& each : chosen) {
    if (record_->is_closed()) co_return;
    if (each.member->kind == rr::MemberKind::property)
      properties.push_back(each);
    else
      co_await follow(client, each, types);
  }
  if (record_->is_closed()) co_return;
  backoff_.reset();
  client_ = client;
  record_->solve_problem("connection");
  record_->begin({});
  record_->read_properties(device_->executor(), properties, types, [client](const RecordedMemberPlace& property) {
    const auto* type = client->upstream()->object_type(property.path);
    return read_property(client, property.path, type ? type->qualified_name : std::string(), property.member);
  });
  while (!record_->is_closed() && !upstream->is_closed() && upstream->types() == types) co_await wait(watch_period);
}

asio::awaitable<void> DeviceRecorder::follow(std::shared_ptr<ValueClient> client, RecordedMemberPlace member,
                                             std::shared_ptr<const rr::TypeRegistry> types) {
  const std::weak_ptr<ServiceRecord> weak = record_;
  SampleHandler handler = [weak, member, types](const SamplePtr& sample, const rr::Error* error) {
    const auto record = weak.lock();
    if (!record) return;
    if (!sample) {
      if (error)
        record->tell_problem(member.name(), error->message);
      else
        record->solve_problem(member.name());
    } else if (member.member->kind == rr::MemberKind::event) {
      record->write_event(member, *types, sample->values);
    } else {
      const bool is_wire = member.member->kind == rr::MemberKind::wire;
      record->write_value(member, *types, sample->values.at(0), is_wire ? std::optional(sample->time) : std::nullopt);
    }
  };
  MemberPlace place{member.path, member.member, types};
  auto listener = co_await client->listen(std::move(place), 0, std::move(handler));
  if (listener)
    listeners_.push_back(std::move(*listener));
  else
    record_->tell_problem(member.name(), listener.error().message);
}

}  // namespace rrgate
