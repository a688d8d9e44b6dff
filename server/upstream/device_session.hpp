// One session with a service of a device, shared by all who use it over HTTP. Layer: server/upstream.
//
// Robot Raconteur's clients have sessions of their own (see relay.hpp). Here a request is over in a moment, and a
// hundred readers of one wire are one client to the device.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <compare>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "node/client/async_object.hpp"
#include "node/transport/watchdog.hpp"
#include "server/upstream/device.hpp"

namespace rrgate {

/// Whose session: two users never share one.
struct SessionKey {
  std::string service;
  std::string username = {};  ///< empty: no login
  std::string password = {};
  auto operator<=>(const SessionKey&) const = default;
};

/// What a wire, a pipe or an event brought.
struct Sample {
  std::uint64_t number = 0;       ///< counts within a topic, from 1
  rr::TimeSpec time;              ///< of a wire's value
  std::vector<rr::Value> values;  ///< an event's arguments; else one
};
using SamplePtr = std::shared_ptr<const Sample>;

/// A wire, pipe or event that somebody listens to, or a callback that somebody answers.
struct TopicKey {
  TopicKey(rr::MemberKind kind_of, std::string at_path, std::string name)
      : kind(kind_of), path(std::move(at_path)), member(std::move(name)) {}

  rr::MemberKind kind;
  std::string path;
  std::string member;
  auto operator<=>(const TopicKey&) const = default;
};

/// What listeners hear. The sample is null where the connection to the device was lost (`error`) or is back (none).
using SampleHandler = std::function<void(const SamplePtr& sample, const rr::Error* error)>;

class DeviceSession : public std::enable_shared_from_this<DeviceSession> {
 public:
  DeviceSession(std::shared_ptr<Device> device, SessionKey key);

  /// The root object; connects where it is not. Callers of the same moment wait for one attempt.
  rr::awaitable<rr::Result<rr::AsyncObject>> root();

  /// Calls a handler with what a topic brings, until it is destroyed; also across reconnects.
  class Listener {
   public:
    Listener(std::shared_ptr<DeviceSession> session, TopicKey key, std::uint64_t id)
        : session_(std::move(session)), key_(std::move(key)), id_(id) {}
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;
    ~Listener() { session_->leave(key_, id_); }

   private:
    std::shared_ptr<DeviceSession> session_;
    TopicKey key_;
    std::uint64_t id_;
  };
  /// The object must have been found. Later listeners get a wire's newest value at once, and an event's samples after
  /// number `after` as far as they are kept. Errors   those of connecting wire or pipe.
  rr::awaitable<rr::Result<std::unique_ptr<Listener>>> listen(TopicKey key, std::uint64_t after, SampleHandler handler);

  /// Answers a callback until the Listener is destroyed, also across reconnects. The object must have been found.
  /// Errors   member_busy: somebody answers it already.
  rr::awaitable<rr::Result<std::unique_ptr<Listener>>> answer_callback(
      TopicKey key, rr::ClientConnection::LateCallbackHandler handler);
  /// A wire's OutValue, or a packet, over the connection that a listener holds; once lost, or closed by the device, it
  /// is opened anew. Errors   invalid_operation: nobody listens; those of connecting and sending.
  rr::awaitable<rr::Result<>> send(TopicKey key, rr::Value value);

  const Device& device() const { return *device_; }
  /// Ends the session and whatever waits for it.
  void stop();

 private:
  struct Topic {
    std::map<std::uint64_t, std::shared_ptr<SampleHandler>> handlers;
    std::vector<SamplePtr> recent;  ///< a wire's newest value; an event's last ones
    std::shared_ptr<rr::ClientConnection::LateCallbackHandler> callback;
    std::uint64_t last_number = 0;
    std::int32_t pipe_index = -1;
    bool is_attached = false;
    bool is_attaching = false;  ///< somebody waits for the device; others for them
  };

  rr::awaitable<rr::Result<>> connect();
  rr::awaitable<rr::Result<>> attach(TopicKey key);
  rr::awaitable<void> attach_to(rr::AsyncObject object, TopicKey key);
  static rr::awaitable<void> reattach(std::shared_ptr<DeviceSession> self);
  void lost(const rr::Error& reason);
  void publish(const TopicKey& key, Sample sample);
  void leave(const TopicKey& key, std::uint64_t id);
  void drop_if_unused(const TopicKey& key);

  std::shared_ptr<Device> device_;
  SessionKey key_;
  std::shared_ptr<rr::ClientConnection> connection_;
  std::optional<Device::Seat> seat_;
  std::map<TopicKey, Topic> topics_;
  std::uint64_t last_id_ = 0;
  bool is_connecting_ = false;
  bool is_stopped_ = false;
  boost::asio::steady_timer connected_;  ///< cancelled when an attempt has ended
  boost::asio::steady_timer attached_;   ///< the same for topics
  boost::asio::steady_timer retry_;
  rr::Error last_error_;
};

/// Sessions by device, service and user; made when somebody asks, ended when nobody has for half a minute.
class DeviceSessions {
 public:
  explicit DeviceSessions(const boost::asio::any_io_executor& executor) : sweep_(executor, [this] { sweep(); }) {}

  /// Errors   out_of_system_resource: too many at once.
  rr::Result<std::shared_ptr<DeviceSession>> open(Device& device, const SessionKey& key);
  void stop();

 private:
  struct Entry {
    std::shared_ptr<DeviceSession> session;
    std::chrono::steady_clock::time_point last_opened;
  };
  void sweep();

  static constexpr std::size_t max_sessions = 256;
  static constexpr std::chrono::seconds idle_time{30};

  std::map<std::pair<std::string, SessionKey>, Entry> sessions_;
  rr::Deadline sweep_;
};

}  // namespace rrgate
