// What agents ask a person for, one command each, and what the person says. Layer: server/access. See docs/mcp.md.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/support/error.hpp"
#include "server/access/access_rules.hpp"
#include "server/access/safe_answer.hpp"

namespace rrgate {

enum class ApprovalState : std::uint8_t { pending, allowed, denied };

/// A command that an agent wants to give, as a person is shown it.
struct WantedCommand {
  Identity who = {};
  std::string device = {};
  std::string service = {};
  std::string path = {};  ///< of the object
  std::string member = {};
  Verb verb = Verb::call;
  std::string values = {};  ///< JSON: what would be sent, by the names of parameters or of the property
  std::string why = {};     ///< as the agent says

  /// Borrows this.
  AccessRequest what() const { return {device, service, path, member, verb}; }
};

struct Approval {
  std::string id = {};
  WantedCommand command = {};
  std::chrono::steady_clock::time_point ends = {};  ///< nobody can allow it any more
};

/// Few at a time, and each for a short time: nobody who answers is a refusal. Also what a person stops agents by. For
/// the gateway's thread.
class Approvals {
 public:
  using Clock = std::chrono::steady_clock;  ///< one that nobody sets: a step would end a stop, or prolong a grant
  using Time = Clock::time_point;
  using Wake = std::function<void()>;
  /// Ends a command. Returns  what the device answers to that; null: nothing made it safe.
  using End = std::function<SafeAnswerPtr()>;
  /// What stop() has ended.
  struct Stopped {
    std::size_t commands = 0;
    std::vector<SafeAnswerPtr> answers = {};  ///< of devices that were made safe
  };
  static constexpr std::size_t max_pending = 64;
  static constexpr std::size_t max_of_subject = 4;
  static constexpr std::size_t max_values = 16 * 1024;  ///< bytes: nobody judges more
  static constexpr std::size_t max_why = 500;
  static constexpr std::chrono::minutes longest_grant{60};
  static constexpr std::chrono::minutes longest_stop{24 * 60};

  /// One request of an agent, from when it asks until it is over. Once it is gone, nobody can allow it any more.
  class Asked {
   public:
    ApprovalState state() const { return state_; }
    const Approval& approval() const { return approval_; }

   private:
    friend class Approvals;
    Approval approval_;
    ApprovalState state_ = ApprovalState::pending;
    Wake wake_;
  };
  using AskedPtr = std::shared_ptr<const Asked>;

  /// `wake`  is called when a person has answered. It may outlive nothing but what it holds itself.
  /// Errors   invalid_argument: more than a person can judge; out_of_system_resource: too many wait already.
  rr::Result<AskedPtr> ask(WantedCommand command, Wake wake, Time ends, Time now);
  /// Whether a person has allowed commands like this one for some time that is not over: of the same agent, by the same
  /// token or password, to the same member.
  bool is_granted(const WantedCommand& command, Time now) const;

  /// What waits, the oldest first.
  std::vector<Approval> list(Time now) const;
  /// What a person says. `grant`  how long commands like it are allowed too; 0: this one alone.
  /// Errors   resource_not_found: it was answered, is too old, or the agent has gone; permission_denied: it is its own.
  rr::Result<Approval> answer(const std::string& id, const Identity& by, bool is_allowed, std::chrono::minutes grant,
                              Time now);

  /// Agents command nothing for so long, and as long as an earlier stop says; 0: they go on at once. What waits is
  /// denied, what is allowed for some time is not any more, and what goes on is ended.
  Stopped stop(std::chrono::minutes time, Time now);
  bool is_stopped(Time now) const { return now < stopped_until_; }
  Time stopped_until() const { return stopped_until_; }
  /// Calls `end` at stop(), as long as what is returned is kept.
  std::shared_ptr<const void> watch_stop(End end);

 private:
  static std::string key_of(const WantedCommand& command);
  std::vector<std::shared_ptr<Asked>> pending(Time now) const;

  std::list<std::weak_ptr<Asked>> asked_;  ///< the oldest first
  std::map<std::string, Time> grants_;     ///< until when, by key_of()
  std::list<std::weak_ptr<const End>> running_;
  Time stopped_until_{};
};

}  // namespace rrgate
