// Clients by values of the services of all devices, one for each login. Layer: server/upstream.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "node/transport/watchdog.hpp"
#include "server/upstream/value_client.hpp"

namespace rrgate {

/// Whose session: two users never share one.
struct SessionKey {
  std::string service;
  std::string username = {};  ///< empty: no login
  std::string password = {};
  /// Whose name that is.
  Subject subject() const { return username.empty() ? Subject() : Subject{Subject::Kind::device_user, username}; }
  auto operator<=>(const SessionKey&) const = default;  // NOLINT(modernize-use-nullptr): of what it makes
};

/// Clients for plain requests by device, service and login; made when somebody asks, gone when nobody has for half a
/// minute. The upstream of a shared device is that of its Robot Raconteur clients.
class ValueClients {
 public:
  /// `memory`  see ValueClient.
  /// `idle_time`  how long a client stays that nobody uses.
  ValueClients(const boost::asio::any_io_executor& executor, MemoryBudget::Charge memory,
               std::chrono::milliseconds idle_time = std::chrono::seconds(30))
      : memory_(std::move(memory)), idle_time_(idle_time), sweep_(executor, [this] { sweep(); }) {}

  /// A client of an open session. Errors   those of connecting and of the login; out_of_system_resource: too many at
  /// once, here or at the device; service_not_found.
  rr::awaitable<rr::Result<std::shared_ptr<ValueClient>>> open(std::shared_ptr<Device> device, SessionKey key);
  /// One more client of a session, with a seat of its own. Errors   out_of_system_resource: the device is full.
  rr::Result<std::shared_ptr<ValueClient>> make_another(std::shared_ptr<Upstream> upstream, Subject user);
  /// Whether the device has judged this login, and there is a session for it.
  bool has(const Device& device, const SessionKey& key) const;
  /// Closes sessions with devices that are not what their names stand for any more, also those that are in use.
  void close_all_but(const std::function<bool(const Device&)>& is_still_there);
  void stop();

 private:
  struct Entry {
    std::shared_ptr<Upstream> upstream;
    std::shared_ptr<ValueClient> client;  ///< null until the login was judged: it takes nobody's place before
    bool is_ours = true;                  ///< false: the upstream is that of the device's Robot Raconteur clients
    std::chrono::steady_clock::time_point last_used;
  };
  using Entries = std::map<std::pair<std::string, SessionKey>, Entry>;
  /// Of one that is not wanted any more. An upstream with a client ends with that.
  static void close_unjudged(const Entry& entry);
  rr::Result<std::shared_ptr<Upstream>> find_or_make(const std::shared_ptr<Device>& device, const SessionKey& key);
  /// The client of an entry whose session is open.
  rr::Result<std::shared_ptr<ValueClient>> let_in(Entry& entry, const SessionKey& key);
  void sweep();

  static constexpr std::size_t max_clients = 256;

  MemoryBudget::Charge memory_;  ///< of nothing: those of the clients are its siblings
  Entries entries_;
  std::chrono::milliseconds idle_time_;
  rr::Deadline sweep_;
  bool is_stopped_ = false;
};

}  // namespace rrgate
