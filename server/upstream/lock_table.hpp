// Who holds which locks of one service, for all clients of the gateway: its own account, the device's behind it. Layer:
// server/upstream. Source: sessions spec sections 2.6, 2.7 and 2.20.
//
// Many clients are one session to the device, so that its locks alone keep none of them from another's object. Here a
// lock is a client's, and the device is asked for it in the session that this client uses: whoever goes by the gateway
// is refused here, everybody else there. No sockets, no clocks: what is to be asked comes out of poll_event(), what has
// been answered goes in.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/session/service/service_session.hpp"
#include "server/access/identity.hpp"

namespace rrgate {

/// A client, from add() to remove(); the caller's number, never used again, never 0.
using LockClient = std::uint64_t;
/// A session with the device, and those that follow it when it is lost.
using LockSession = std::uint64_t;

/// One who may hold locks.
struct LockParty {
  Subject user;  ///< whose user locks are his too
  LockSession session = 0;
  bool has_own_session = false;  ///< nobody else uses it: the device knows him by his name
};

// --- what comes out ---

/// To be asked of the device, and to be answered exactly once with handle_answer(), also where the session ends.
struct LockAsked {
  std::uint64_t id = 0;
  LockSession session = 0;
  rr::LockCommand command = rr::LockCommand::unlock;
  std::string path;
  std::chrono::milliseconds timeout{0};  ///< enter_monitor
};
/// A client's request is over.
struct LockAnswered {
  LockClient client = 0;
  rr::LockRequestId request = 0;
  rr::Result<> result;
};
/// Nothing is left of a client that was removed: the device has taken back what it had given.
struct LockClientLeft {
  LockClient client = 0;
};
/// The session may hold what is nobody's any more, and the device does not answer: ending it gives it back.
struct LockSessionInDoubt {
  LockSession session = 0;
};
using LockEvent = std::variant<LockAsked, LockAnswered, LockClientLeft, LockSessionInDoubt>;

/// A lock that keeps others out now.
struct HeldLock {
  enum class Kind : std::uint8_t { user, client, monitor };
  Kind kind = Kind::client;
  std::string path;  ///< canonical
  Subject by;        ///< as whom its owner has taken it

  bool operator==(const HeldLock&) const = default;
};

class LockTable {
 public:
  // --- told ---

  void add(LockClient client, LockParty party);
  /// Gives back what is this client's alone; LockClientLeft follows. Sessions of his own are left to the caller to end.
  void remove(LockClient client, rr::TimePoint now);
  /// LockAnswered follows.
  void handle_wanted(LockClient client, const rr::LockWanted& wanted, rr::TimePoint now);
  void handle_answer(std::uint64_t id, const rr::Result<>& result, rr::TimePoint now);
  /// The session has ended, with it the locks that it held: their holders are refused until they unlock or lock again.
  void handle_lost(LockSession session, rr::TimePoint now);
  /// The device has replaced the objects at and below a path: locks there are gone.
  void handle_released(std::string_view path, rr::TimePoint now);
  /// A client may not lock an object any more: what it has there is given back, and it is refused until it unlocks.
  void handle_right_lost(LockClient client, std::string_view path, rr::TimePoint now);
  /// A client has the lease of an object: others who wait for a monitor there, or below, are refused with `why`.
  void handle_leased(LockClient client, std::string_view path, const rr::Error& why);
  void handle_timeout(rr::TimePoint now);

  // --- asked ---

  /// Whether a client may use an object now; keeps a monitor that it owns. `client`  0: one who can hold nothing.
  /// `is_exempt`  the member is left alone by object locks (not by monitors).
  /// Errors   object_locked_error; invalid_operation: a monitor.
  rr::Result<> check(LockClient client, std::string_view path, bool is_exempt, rr::TimePoint now);
  /// Whether nobody else has a lock or a monitor of something below an object. Errors   object_locked_error.
  rr::Result<> check_below(LockClient client, std::string_view path) const;
  /// Of the objects of which a client has a lock or a monitor, is about to, or waits for it. Canonical.
  std::vector<std::string> paths_of(LockClient client) const;
  /// Whether a client has one of this object, or has lost one and was not told so yet.
  bool has_at(LockClient client, std::string_view path) const;
  /// The session that has, or is about to have, the lock that covers an object. nullopt: there is none.
  std::optional<LockSession> locked_by(std::string_view path);

  // --- answers ---

  std::optional<LockEvent> poll_event();
  /// Whether nobody holds, waits for, or has lost anything.
  bool is_empty() const;
  /// Those that a client holds, or is about to; without those that nobody holds any more.
  std::vector<HeldLock> held() const;
  rr::TimePoint poll_timeout() const;

 private:
  /// What is under way at the device.
  enum class Asking : std::uint8_t { nothing, take, give_back, override_it };

  /// What the device has given, or is asked for, or is to take back. Whoever is not the owner is kept out from the
  /// moment in which it is asked for, for the device tells nobody when it gives it.
  struct Hold {
    LockClient owner = 0;  ///< 0: it is nobody's any more
    LockSession session = 0;
    Subject user;      ///< of a user lock
    Subject by;        ///< as whom the owner has taken it
    std::string path;  ///< as the owner spells it
    Asking asking = Asking::nothing;
    std::uint64_t ask = 0;
    LockClient asker = 0;  ///< who hears of the answer; 0: nobody
    rr::LockRequestId request = 0;
    LockClient leaver = 0;  ///< who was removed and waits for it
  };
  struct Waiting {
    LockClient client = 0;
    rr::LockRequestId request = 0;
    std::string path;
    rr::TimePoint deadline;
  };
  struct Monitor : Hold {
    rr::TimePoint idle_deadline;
    std::deque<Waiting> queue;
  };
  using Locks = std::map<std::string, Hold, std::less<>>;
  using Monitors = std::map<std::string, Monitor, std::less<>>;
  /// What a client holds no more without having given it back, and why. By canonical path.
  using Lost = std::map<std::pair<LockClient, std::string>, std::string>;

  /// Nobody knows whether the device has done it, or will.
  static bool is_unknown(const rr::Result<>& result);
  bool owns(LockClient client, const Hold& lock) const;
  Locks::iterator find_covering(std::string_view path);
  void ask(Hold& hold, Asking what, LockSession session, rr::LockCommand command,
           std::chrono::milliseconds timeout = {});
  void answer(LockClient client, rr::LockRequestId request, rr::Result<> result);
  void end_leaving(LockClient leaver);
  void note_lost_lock(const std::string& key, const Hold& lock, const std::string& why);

  void lock(LockClient client, const rr::LockWanted& wanted);
  void unlock(LockClient client, const rr::LockWanted& wanted);
  void take_back_lock(Hold& lock, LockClient leaver);
  void lock_answered(Locks::iterator at, const rr::Result<>& result);

  rr::Result<> check_monitor(LockClient client, const std::string& key, rr::TimePoint now);
  void enter(LockClient client, const rr::LockWanted& wanted, rr::TimePoint now);
  void exit(LockClient client, const rr::LockWanted& wanted, rr::TimePoint now);
  void begin_entering(Monitor& monitor, const Waiting& waiting, rr::TimePoint now);
  void take_back_monitor(Monitor& monitor, LockClient leaver);
  /// Nobody is in it, nothing is under way.
  void hand_on(Monitors::iterator at, rr::TimePoint now);
  void lose_monitor(Monitor& monitor, const std::string& why);
  void monitor_answered(Monitors::iterator at, const rr::Result<>& result, rr::TimePoint now);

  std::map<LockClient, LockParty> parties_;
  Locks locks_;        ///< by canonical path; no two overlap
  Monitors monitors_;  ///< by canonical path
  Lost lost_locks_;
  Lost lost_monitors_;
  std::uint64_t last_ask_ = 0;
  std::deque<LockEvent> events_;
};

}  // namespace rrgate
