// A device behind the gateway: who it is and how it is. Layer: server/upstream.
#pragma once

#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/connection.hpp"
#include "core/types/read_definitions.hpp"
#include "node/driver/backoff.hpp"
#include "node/transport/dial.hpp"
#include "server/config/config.hpp"
#include "server/config/tls_files.hpp"
#include "server/log/metrics.hpp"
#include "server/upstream/look_pace.hpp"
#include "server/upstream/page_link.hpp"
#include "server/upstream/probe.hpp"

namespace rrgate {

class ServiceLocks;
class Upstream;
struct LeaseNews;

enum class DeviceState { connecting, online, offline };
std::string_view to_string(DeviceState state);

/// As much of what a peer says of an error as is passed on. Two gateways that are each other's device would otherwise
/// quote each other at ever greater length.
std::string quotable(std::string_view message);

/// One device. Looks at it from time to time; connects clients to it. Those who use it over a wait hold a Seat.
class Device : public std::enable_shared_from_this<Device> {
 public:
  /// `tls`  of all found devices; null: files of its own, where its URL wants them.
  /// `page`  how it is reached if a page is the device; null: by its URL.
  Device(const boost::asio::any_io_executor& executor, DeviceConfig config, const Config& whole,
         std::shared_ptr<TlsFiles> tls = nullptr, std::shared_ptr<PageLink> page = nullptr);

  const DeviceConfig& config() const { return config_; }
  boost::asio::any_io_executor executor() { return wake_.get_executor(); }
  DeviceState state() const { return state_; }
  /// Empty while the device is online.
  const std::string& last_error() const { return last_error_; }
  /// What the last answer said; kept while the device is offline, so that clients can still be told which one it is.
  const std::optional<ProbeResult>& identity() const { return identity_; }
  std::size_t clients() const { return clients_; }
  Traffic& traffic() { return traffic_; }
  const Traffic& traffic() const { return traffic_; }

  /// Whether it goes on when this is what the configuration says of it. What become() takes may differ.
  bool can_become(const DeviceConfig& config) const;
  void become(const DeviceConfig& config, const Config& whole);

  /// The ways to a found device, best first; the first that works becomes config().url.
  void set_urls(std::vector<rr::ConnectionUrl> urls);

  /// A connection to the device, by whichever URL is the quickest. A failure makes the device be looked at again soon.
  /// `way`    looks of the gateways that the client has come through (see way_header); empty: none that says so.
  /// Errors   also: the device's URL leads back to this gateway.
  rr::awaitable<rr::Result<std::unique_ptr<rr::ByteStream>>> connect(std::string way = {});
  /// Whether it is this device's own look that comes from this node, or by this way: then its URL leads back here.
  bool is_own_look(const rr::NodeId& sender) const { return sender == look_id_; }
  bool is_on_way(std::string_view way) const;
  /// Such a look has come. Until one is answered no client is connected, or each would go round in circles.
  void note_circle();
  /// The session that all clients of a service share, as long as it lives.
  void share(const std::string& service, std::weak_ptr<Upstream> by);
  /// Errors   service_not_found; connection_error: the device has not answered yet.
  rr::Result<std::shared_ptr<Upstream>> find_shared(const std::string& service) const;
  const Retry& retry() const { return retry_; }
  /// How long it may take to answer a request; see Timeouts.
  std::chrono::milliseconds request_timeout() const { return request_timeout_; }
  /// Of one service, for all sessions that the gateway has with it.
  std::shared_ptr<ServiceLocks> locks_of(const std::string& service);
  /// Keeps the locks of a service that nobody uses, as long as they owe the device what makes it safe.
  void keep_owing(std::shared_ptr<ServiceLocks> locks) { owing_.insert(std::move(locks)); }
  /// The same for all services that clients use now, by their names.
  std::map<std::string, std::shared_ptr<ServiceLocks>> locks() const;
  /// Told when a lease of one of its objects begins and ends.
  void on_lease(std::function<void(const LeaseNews&)> handler) { on_lease_ = std::move(handler); }
  void tell_lease(const LeaseNews& news) const {
    if (on_lease_) on_lease_(news);
  }
  bool is_shared() const { return config_.mode == DeviceMode::shared; }
  /// Called when state() or identity() has changed.
  void on_change(std::function<void()> handler) { on_change_ = std::move(handler); }
  /// A client's connection to the device broke: look at it again soon.
  void note_trouble() { look_again(); }

  /// Counts one client while it lives; see max_clients.
  class Seat {
   public:
    explicit Seat(Device& device) : device_(device.shared_from_this()) { ++device_->clients_; }
    Seat(Seat&& other) noexcept = default;
    Seat& operator=(Seat&&) = delete;
    ~Seat() {
      if (device_) --device_->clients_;
    }

   private:
    std::shared_ptr<Device> device_;  ///< a found device may be lost meanwhile
  };
  bool is_full() const { return config_.max_clients != 0 && clients_ >= config_.max_clients; }
  /// nullopt when it is.
  std::optional<Seat> take_seat();
  /// Held while a session with the device is open, whoever's: as long as there is one the device is there, though it
  /// may have no room for the connection of a look.
  std::shared_ptr<const void> begin_session();
  /// Held for a session that this side ends, until the device knows of it, with all that it was sent before: a gateway
  /// that stops waits for that.
  std::shared_ptr<const void> begin_closing();
  bool is_closing() const { return closing_ > 0; }
  // What those hear who can't get to it.
  std::string full_text() const;
  std::string offline_text(const rr::Error& error) const;
  /// For one that is not online. connection_error.
  rr::Error away_error() const;

  /// For devices by TLS: reads the CAs that it is checked against. See TlsFiles.
  [[nodiscard]] rr::Result<> load_tls();
  void reload_tls(bool is_forced);

  /// Its looks take their turns; without this none waits.
  void share_pace(std::shared_ptr<LookPace> pace) { pace_ = std::move(pace); }
  /// What it defines is read once for all that have the same; without this, each time anew.
  void share_definitions(std::shared_ptr<rr::ReadDefinitions> definitions) { definitions_ = std::move(definitions); }
  const std::shared_ptr<rr::ReadDefinitions>& definitions() const { return definitions_; }

  /// Probes until stop(), all URLs side by side; stop() ends what is being dialed.
  rr::awaitable<void> watch();
  /// The same, by itself.
  void start();
  void stop();

 private:
  rr::DialOptions dial_options(std::string_view way = {}) const;
  /// Errors   those of `work`; operation_aborted: stop() was called.
  template <class T>
  rr::awaitable<rr::Result<T>> until_stopped(rr::awaitable<rr::Result<T>> work);
  void look_again();
  /// Until its turn, or until somebody wants it looked at now.
  rr::awaitable<void> wait_for_turn();
  /// The one that worked last, then the others.
  std::vector<rr::ConnectionUrl> urls_to_try() const;
  void note(const rr::Result<ProbeResult>& result);
  void note_answer(const rr::Result<ProbeResult>& result, DeviceState before);

  DeviceConfig config_;
  std::vector<rr::ConnectionUrl> urls_;  ///< of a found device
  std::function<void()> on_change_;
  std::function<void(const LeaseNews&)> on_lease_;
  rr::DialOptions dial_options_;
  std::shared_ptr<TlsFiles> tls_;                                        ///< null: the URL wants none
  std::shared_ptr<TlsFiles> https_;                                      ///< the same of HTTPS, which is around that
  std::set<std::shared_ptr<boost::asio::cancellation_signal>> dialing_;  ///< what stop() ends
  Retry retry_;
  std::chrono::milliseconds request_timeout_;
  rr::Backoff backoff_;                               ///< between looks at it while it does not answer
  std::shared_ptr<LookPace> pace_;                    ///< of all devices; may be null
  std::shared_ptr<rr::ReadDefinitions> definitions_;  ///< likewise
  const rr::NodeId look_id_;                          ///< the node that looks come from: none but they have it
  bool has_come_back_ = false;                        ///< the look that is on its way
  bool is_circle_ = false;                            ///< the last look came back, and was not answered
  DeviceState state_ = DeviceState::connecting;
  std::string last_error_;
  std::optional<ProbeResult> identity_;
  std::map<std::string, std::weak_ptr<ServiceLocks>> locks_;  ///< by service
  std::set<std::shared_ptr<ServiceLocks>> owing_;
  std::map<std::string, std::weak_ptr<Upstream>> shared_;  ///< likewise
  std::size_t clients_ = 0;
  std::size_t sessions_ = 0;
  std::size_t closing_ = 0;
  Traffic traffic_;
  bool is_stopping_ = false;
  bool looks_again_ = false;
  bool waits_for_end_ = false;  ///< of the last session, before it looks again
  boost::asio::steady_timer wake_;
};

/// HTTP header of WebSockets from gateway to gateway: the look ids of the devices that the connection is for, one
/// behind the other.
inline constexpr const char* way_header = "X-Rrgate-Way";

}  // namespace rrgate
