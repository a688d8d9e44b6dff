// What makes a service of a device safe when a lease ends. Layer: server/upstream. See docs/leases.md.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/value.hpp"
#include "node/driver/backoff.hpp"
#include "server/config/config.hpp"

namespace rrgate {

class Device;
class Upstream;

/// A SafeAction in the types that the device has declared.
struct SafeRequest {
  SafeAction::Kind kind = SafeAction::Kind::call;
  std::string path;
  std::string member;
  std::vector<rr::Value> values;  ///< a call's arguments; else one
};

/// What SafeValues asks, and tells, whoever has the sessions, locks and leases of the service.
struct SafeLinks {
  /// Some could not be sent now.
  std::function<void()> owed = [] {};
  /// Whether somebody has a lease of an object: what was sent before and has not arrived is not sent again then, as the
  /// end of that lease makes the object safe.
  std::function<bool(const std::string& path)> is_leased = [](const std::string&) { return false; };
  /// The session that has the lock of an object, and is open; null: there is none.
  std::function<std::shared_ptr<Upstream>(const std::string& path)> locked_by = [](const std::string&) {
    return nullptr;
  };
};

/// Lives in a shared_ptr, which its requests that are under way do not keep.
class SafeValues : public std::enable_shared_from_this<SafeValues> {
 public:
  using Answered = std::function<void(const rr::Result<>&)>;
  enum class Why : std::uint8_t { lease_ended, stop };

  /// What a device has refused for so long because of a lock, it is not sent any more: it may keep the lock of a lost
  /// session for ten minutes, and what comes much later would stop what somebody has begun since.
  static constexpr std::chrono::minutes longest_refused{10};

  /// Those of `actions` that are about the service.
  SafeValues(std::string device, std::string_view service, const std::vector<SafeAction>& actions);
  /// What is owed still is given up, and logged.
  ~SafeValues();
  SafeValues(const SafeValues&) = delete;
  SafeValues& operator=(const SafeValues&) = delete;

  /// A session with the device is open: what the configuration says is held against what the device declares, and what
  /// could not be sent before is sent.
  void handle_opened(const std::shared_ptr<Upstream>& upstream);
  /// The same for what is at and below a path, where objects may be others now.
  void check_again(std::string_view path, const std::shared_ptr<Upstream>& upstream);
  /// Whether the device can be made safe at and below a path. Errors   invalid_configuration: what does not fit.
  rr::Result<> check(std::string_view path) const;
  /// Whether there are any at or below a path.
  bool has(std::string_view path) const;
  /// Whether some could not be sent yet, or may have to be sent again.
  bool is_owing() const;
  void link(SafeLinks links) { links_ = std::move(links); }
  /// Sends all at and below a path, past whatever waits. False: there is no session, or it was lost at this moment;
  /// they are sent as soon as there is one. Those that the device has not taken then are sent again, see Open; not
  /// where somebody has the lease by then.
  /// `by`  the session; where the device refuses that because of a lock, the one that has the lock follows it; what is
  /// no stop not where somebody has the lease by then.
  /// `answered`  called once, when all are answered: the first error; connection_error: they could not be sent.
  bool send(const std::string& path, const std::shared_ptr<Upstream>& by, Why why, Answered answered = nullptr);
  /// Sends what could not be sent before, where it has been held against what the device is now.
  void pay(const std::shared_ptr<Upstream>& upstream);
  /// The same for what is owed at, above and below a path, at once: somebody is about to command there.
  void pay_around(std::string_view path, const std::shared_ptr<Upstream>& upstream);
  /// The session of the upstream with the device has ended.
  void handle_lost(std::uint64_t upstream);
  /// What was refused may be taken now: a lock at the device was given back.
  void send_again();

 private:
  /// Whether the device may not have taken what it was sent last, and when that is sent again.
  enum class Open : std::uint8_t {
    no,
    unanswered,  ///< when the session has ended that has not answered in time
    refused,     ///< after a while, or then: because of a lock, or by another gateway that has lost the device
    owed,        ///< as soon as there is a session
  };
  struct Item {
    SafeAction action;
    rr::Result<SafeRequest> request;
    std::optional<SafeRequest> last = {};  ///< that was good: for leases of before the object was released
    bool is_checked = false;               ///< looked at, well or not, since a session was opened
    Open open = Open::no;
    std::uint64_t upstream = 0;  ///< whose session has not answered, or was refused
    std::uint64_t sendings = 0;  ///< only the answer to the last one counts
    std::optional<std::chrono::steady_clock::time_point> refused_since = {};  ///< until it is taken, or sent anew
    std::optional<std::string> failure = {};  ///< that was logged: not again with each sending
  };

  void look_up(std::size_t index, const std::shared_ptr<Upstream>& upstream);
  void read(Item& item, Upstream& upstream);
  void take(Item& item, rr::Result<SafeRequest> request);
  bool is_checked(std::string_view path) const;
  void pay_due(const std::shared_ptr<Upstream>& upstream, const std::function<bool(const std::string&)>& is_due);
  void send_item(Item& item, const std::shared_ptr<Upstream>& by, Why why, const Answered& answered);
  static void note_refused(Item& item, const Upstream& by);
  void handle_answer(Item& item, const Upstream& by, const rr::Result<>& answer);
  void handle_failed(Item& item, const Upstream& by, const rr::Error& error);
  /// Unless somebody has the lease: the end of that makes the object safe.
  void owe(Item& item);
  bool has_open(Open open) const;
  void send_again_later(Device& device);
  /// Where nothing is refused: a gateway that stops waits for no timer.
  void end_waiting();

  std::string device_;
  std::vector<Item> items_;
  std::vector<std::string> owed_;  ///< paths of leases that have ended while there was no session
  SafeLinks links_;
  std::optional<boost::asio::steady_timer> again_;  ///< while anything is refused: until it is sent again
  std::optional<rr::Backoff> backoff_;              ///< likewise
};

}  // namespace rrgate
