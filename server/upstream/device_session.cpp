#include "server/upstream/device_session.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <random>

#include "core/session/service_path.hpp"
#include "server/log/log.hpp"
#include "server/upstream/open_session.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::size_t kept_events = 256;
constexpr milliseconds first_retry{500};
constexpr milliseconds last_retry{30'000};
constexpr auto wait_token = asio::as_tuple(asio::use_awaitable);

/// Every object on the way to `path`, root first.
std::vector<std::string> objects_on_the_way(const std::string& path) {
  std::vector<std::string> out;
  const auto segments = rr::parse_service_path(path);
  if (!segments) return out;
  for (const auto& segment : *segments)
    out.push_back(out.empty() ? segment.name : rr::child_path(out.back(), segment.name, segment.index));
  return out;
}

rr::awaitable<void> find_objects(rr::AsyncObject root, std::string path) {
  const auto objects = objects_on_the_way(path);
  for (std::size_t i = 1; i < objects.size(); ++i) {
    if (root.connection()->session().object_type(objects[i])) continue;
    const auto segments = rr::parse_service_path(objects[i]);
    const rr::AsyncObject parent(root.connection(), objects[i - 1]);
    co_await parent.object(segments->back().name, segments->back().index);
  }
}

milliseconds half_jitter(milliseconds wait) {
  static thread_local std::minstd_rand random(std::random_device{}());
  return wait / 2 + milliseconds(std::uniform_int_distribution<milliseconds::rep>(0, wait.count() / 2)(random));
}

}  // namespace

DeviceSession::DeviceSession(std::shared_ptr<Device> device, SessionKey key)
    : device_(std::move(device)),
      key_(std::move(key)),
      connected_(device_->executor(), asio::steady_timer::time_point::max()),
      attached_(device_->executor(), asio::steady_timer::time_point::max()),
      retry_(device_->executor()) {}

rr::awaitable<rr::Result<rr::AsyncObject>> DeviceSession::root() {
  const auto self = shared_from_this();
  if (is_connecting_) {
    while (is_connecting_) co_await connected_.async_wait(wait_token);
    if (!connection_) co_return last_error_;
  }
  if (!connection_) {
    is_connecting_ = true;
    const auto connected = co_await connect();
    is_connecting_ = false;
    if (!connected) last_error_ = connected.error();
    connected_.cancel();
    if (!connected) co_return connected.error();
  }
  co_return rr::AsyncObject(connection_, connection_->root_path());
}

rr::awaitable<rr::Result<>> DeviceSession::connect() {
  auto seat = device_->take_seat();
  if (!seat) co_return rr::make_error(rr::ErrorCode::out_of_system_resource, device_->full_text());
  auto stream = co_await device_->connect_client();
  if (!stream) co_return rr::make_error(rr::ErrorCode::connection_error, device_->offline_text(stream.error()));
  rr::MapString credentials;
  if (!key_.username.empty()) credentials.items.emplace_back("password", rr::Value(key_.password));
  auto opened =
      co_await open_session(std::move(*stream), key_.service, device_->client_target(), key_.username, credentials);
  if (!opened) co_return opened.error();
  connection_ = std::move(*opened);
  if (is_stopped_) {
    connection_->disconnect();
    connection_.reset();
    co_return rr::make_error(rr::ErrorCode::connection_error, "the gateway stops");
  }
  seat_.emplace(std::move(*seat));
  connection_->on_closed([self = weak_from_this()](const rr::Error& reason) {
    if (const auto session = self.lock()) session->lost(reason);
  });
  co_return rr::Result<>();
}

void DeviceSession::lost(const rr::Error& reason) {
  connection_.reset();
  seat_.reset();
  if (is_stopped_) return;
  const auto error = rr::make_error(rr::ErrorCode::connection_error, "connection_lost: " + reason.message);
  log(LogLevel::info, "device session lost", {{"device", device_->config().name}, {"error", reason.message}});
  device_->note_trouble();
  bool has_listeners = false;
  auto topics = topics_;  // handlers may leave
  for (auto& [key, topic] : topics_) topic.is_attached = false;
  for (const auto& [key, topic] : topics) {
    if (topic.callback) has_listeners = true;
    for (const auto& [id, handler] : topic.handlers) {
      has_listeners = true;
      (*handler)(nullptr, &error);
    }
  }
  if (has_listeners) asio::co_spawn(device_->executor(), reattach(shared_from_this()), asio::detached);
}

rr::awaitable<void> DeviceSession::reattach(std::shared_ptr<DeviceSession> self) {
  for (auto wait = first_retry; !self->is_stopped_ && !self->topics_.empty(); wait = std::min(wait * 2, last_retry)) {
    self->retry_.expires_after(half_jitter(wait));
    co_await self->retry_.async_wait(wait_token);
    if (self->is_stopped_ || self->topics_.empty()) break;
    const auto root = co_await self->root();
    if (!root) continue;
    bool has_failed = false;
    std::vector<TopicKey> keys;
    for (const auto& [key, topic] : self->topics_) keys.push_back(key);
    for (const auto& key : keys) {
      const auto attached = co_await self->attach(key);
      if (!attached) has_failed = true;
      const auto topic = self->topics_.find(key);
      if (!attached || topic == self->topics_.end()) continue;
      const auto handlers = topic->second.handlers;
      for (const auto& [id, handler] : handlers) (*handler)(nullptr, nullptr);
    }
    if (!has_failed) break;
  }
}

rr::awaitable<rr::Result<>> DeviceSession::attach(TopicKey key) {
  const auto self = shared_from_this();
  const auto is_attaching = [&] { return topics_.contains(key) && topics_[key].is_attaching; };
  while (is_attaching()) co_await attached_.async_wait(wait_token);
  if (!topics_.contains(key) || topics_[key].is_attached) co_return rr::Result<>();
  topics_[key].is_attaching = true;
  auto root = co_await this->root();
  auto attached = root ? rr::Result<>() : rr::Result<>(root.error());
  if (root) try {
      co_await find_objects(*root, key.path);
      const rr::AsyncObject object(root->connection(), key.path);
      co_await attach_to(object, key);
    } catch (const rr::Exception& exception) {
      attached = exception.error();
    }
  topics_[key].is_attaching = false;
  topics_[key].is_attached = attached && root->connection() == connection_;
  attached_.cancel();
  drop_if_unused(key);
  co_return attached;
}

rr::awaitable<void> DeviceSession::attach_to(rr::AsyncObject object, TopicKey key) {
  const std::weak_ptr<DeviceSession> weak = weak_from_this();
  if (key.kind == rr::MemberKind::callback) {
    if (const auto handler = topics_[key].callback)
      object.connection()->on_callback_later(key.path, key.member, *handler);
  } else if (key.kind == rr::MemberKind::event) {
    rr::ClientConnection::EventHandler handler = [weak, key](std::span<const rr::Value> arguments) {
      if (const auto session = weak.lock()) session->publish(key, Sample{0, {}, {arguments.begin(), arguments.end()}});
    };
    object.on_event(key.member, std::move(handler));
  } else if (key.kind == rr::MemberKind::wire) {
    rr::ClientConnection::WireHandler handler = [weak, key](const rr::Value& value, rr::TimeSpec time) {
      if (const auto session = weak.lock()) session->publish(key, Sample{0, time, {value}});
    };
    co_await object.connect_wire(key.member, std::move(handler));
  } else {
    rr::ClientConnection::PipeHandlers handlers;
    handlers.received = [weak, key](rr::Value packet) {
      if (const auto session = weak.lock()) session->publish(key, Sample{0, {}, {std::move(packet)}});
    };
    handlers.closed = [weak, key] {
      const auto session = weak.lock();
      const auto closed = rr::make_error(rr::ErrorCode::invalid_state, "the device closed the pipe");
      if (!session || !session->topics_.contains(key)) return;
      session->topics_[key].is_attached = false;
      const auto listening = session->topics_[key].handlers;
      for (const auto& [id, handler] : listening) (*handler)(nullptr, &closed);
    };
    const auto index = co_await object.connect_pipe(key.member, std::move(handlers));
    topics_[key].pipe_index = index.to<std::int32_t>().value();
  }
}

rr::awaitable<rr::Result<std::unique_ptr<DeviceSession::Listener>>> DeviceSession::listen(TopicKey key,
                                                                                          std::uint64_t after,
                                                                                          SampleHandler handler) {
  const auto self = shared_from_this();
  const auto id = ++last_id_;
  auto kept = std::make_shared<SampleHandler>(std::move(handler));
  auto listener = std::make_unique<Listener>(self, key, id);
  auto& topic = topics_[key];
  for (const auto& sample : topic.recent)
    if (key.kind == rr::MemberKind::wire || (after > 0 && sample->number > after)) (*kept)(sample, nullptr);
  topic.handlers[id] = kept;
  const auto attached = co_await attach(key);
  if (!attached) co_return attached.error();
  co_return listener;
}

rr::awaitable<rr::Result<std::unique_ptr<DeviceSession::Listener>>> DeviceSession::answer_callback(
    TopicKey key, rr::ClientConnection::LateCallbackHandler handler) {
  const auto self = shared_from_this();
  if (topics_.contains(key))
    co_return rr::make_error(rr::ErrorCode::member_busy, rr::quoted(key.member) + " is answered already");
  topics_[key].callback = std::make_shared<rr::ClientConnection::LateCallbackHandler>(std::move(handler));
  auto listener = std::make_unique<Listener>(self, key, ++last_id_);
  const auto attached = co_await attach(key);
  if (!attached) co_return attached.error();
  co_return listener;
}

rr::awaitable<rr::Result<>> DeviceSession::send(TopicKey key, rr::Value value) {
  const auto self = shared_from_this();
  const auto attached = co_await attach(key);
  if (!attached) co_return attached.error();
  const auto found = topics_.find(key);
  if (!connection_ || found == topics_.end() || !found->second.is_attached)
    co_return rr::make_error(rr::ErrorCode::invalid_operation, rr::quoted(key.member) + " is not connected");
  co_return key.kind == rr::MemberKind::wire
      ? connection_->send_wire(key.path, key.member, value)
      : connection_->send_pipe(key.path, key.member, found->second.pipe_index, value);
}

void DeviceSession::publish(const TopicKey& key, Sample sample) {
  const auto found = topics_.find(key);
  if (found == topics_.end()) return;
  auto& topic = found->second;
  sample.number = ++topic.last_number;
  const auto shared = std::make_shared<const Sample>(std::move(sample));
  if (key.kind == rr::MemberKind::wire) topic.recent.clear();
  if (key.kind != rr::MemberKind::pipe) topic.recent.push_back(shared);
  if (topic.recent.size() > kept_events) topic.recent.erase(topic.recent.begin());
  const auto handlers = topic.handlers;  // they may leave
  for (const auto& [id, handler] : handlers) (*handler)(shared, nullptr);
}

void DeviceSession::leave(const TopicKey& key, std::uint64_t id) {
  const auto found = topics_.find(key);
  if (found == topics_.end()) return;
  found->second.handlers.erase(id);
  if (key.kind == rr::MemberKind::callback) {
    found->second.callback.reset();
    if (connection_) connection_->forget_callback(key.path, key.member);
  }
  drop_if_unused(key);
}

void DeviceSession::drop_if_unused(const TopicKey& key) {
  const auto found = topics_.find(key);
  if (found == topics_.end()) return;
  const auto& topic = found->second;
  if (!topic.handlers.empty() || topic.callback || topic.is_attaching) return;
  // An event costs the device nothing, and who comes back wants to know what happened meanwhile.
  if (key.kind == rr::MemberKind::event && topic.is_attached) return;
  const auto ignore = [](const rr::Result<rr::Value>&) {};
  if (connection_ && topic.is_attached) {
    if (key.kind == rr::MemberKind::wire) connection_->disconnect_wire(key.path, key.member, ignore);
    if (key.kind == rr::MemberKind::pipe && topic.pipe_index >= 0)
      connection_->disconnect_pipe(key.path, key.member, topic.pipe_index, ignore);
  }
  topics_.erase(found);
}

void DeviceSession::stop() {
  is_stopped_ = true;
  retry_.cancel();
  if (const auto connection = std::exchange(connection_, nullptr)) connection->disconnect();
  seat_.reset();
}

rr::Result<std::shared_ptr<DeviceSession>> DeviceSessions::open(Device& device, const SessionKey& key) {
  auto& entry = sessions_[{device.config().name, key}];
  if (!entry.session || &entry.session->device() != &device) {
    if (sessions_.size() > max_sessions) {
      sessions_.erase({device.config().name, key});
      return rr::make_error(rr::ErrorCode::out_of_system_resource,
                            "the gateway has " + std::to_string(max_sessions) + " device sessions already");
    }
    if (entry.session) entry.session->stop();
    entry.session = std::make_shared<DeviceSession>(device.shared_from_this(), key);
  }
  entry.last_opened = std::chrono::steady_clock::now();
  if (!sweep_.is_armed()) sweep_.arm(idle_time / 3);
  return entry.session;
}

void DeviceSessions::sweep() {
  const auto now = std::chrono::steady_clock::now();
  std::erase_if(sessions_, [&](auto& item) {
    auto& entry = item.second;
    const bool is_idle = entry.session.use_count() == 1 && now - entry.last_opened > idle_time;
    if (is_idle) entry.session->stop();
    return is_idle;
  });
  if (!sessions_.empty()) sweep_.arm(idle_time / 3);
}

void DeviceSessions::stop() {
  sweep_.disarm();
  for (auto& [key, entry] : sessions_) entry.session->stop();
  sessions_.clear();
}

}  // namespace rrgate
