// Who may do what: rules that allow. Layer: server/access.
//
// A right is there when one rule gives it: no order, no refusing rules, nothing that takes away again. So a rule can be
// read alone. docs/access.md tells operators the same.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/robdef/model/service_definition.hpp"
#include "core/support/error.hpp"
#include "server/access/agent_terms.hpp"
#include "server/access/identity.hpp"

namespace rrgate {

/// What one may do. Those up to `lock` are done to members and objects of devices; `record` is done to services as a
/// whole; `serve` is to be a device by that name; the others are done to the gateway itself.
enum class Verb : std::uint8_t { read, write, call, subscribe, lock, record, serve, metrics, admin };
inline constexpr Verb device_verbs[] = {Verb::read, Verb::write, Verb::call, Verb::subscribe, Verb::lock};
inline constexpr Verb all_verbs[] = {Verb::read,   Verb::write, Verb::call,    Verb::subscribe, Verb::lock,
                                     Verb::record, Verb::serve, Verb::metrics, Verb::admin};
std::string_view to_string(Verb verb);
/// nullopt: no such verb.
std::optional<Verb> parse_verb(std::string_view text);
constexpr bool is_device_verb(Verb verb) {
  return verb <= Verb::record;
}

/// Of how much of a device somebody may do something.
enum class Extent : std::uint8_t { none, some, all };
std::string_view to_string(Extent extent);

/// What it takes to connect a wire or a pipe: where clients only send, nobody hears anything by it.
inline Verb verb_to_connect(const rr::MemberDefinition& member) {
  return member.direction() == rr::MemberDirection::writeonly ? Verb::write : Verb::subscribe;
}

/// The gateway's own service, as a device. It does not know who reads it.
inline constexpr std::string_view gateway_device = "gateway";

/// What somebody wants. Borrowed for the call.
struct AccessRequest {
  std::string_view device = {};   ///< its name in the gateway; empty for the gateway itself
  std::string_view service = {};  ///< "Create"; empty: the device as such
  std::string_view path = {};     ///< of the object, as Robot Raconteur says it: "Create.axes[2]"; empty: the service
  std::string_view member = {};   ///< empty: the object as such
  Verb verb = Verb::read;         ///< to read a device, a service or an object as such is to know of it
  bool is_shape = false;          ///< to read how large a memory is: also for those who may write it
  /// Stops something, or keeps or gives back what is held: done also where it can't be recorded.
  bool is_vital = false;
};

/// Gives everybody who has one of the roles all of `may` on whatever fits one pattern of each list. Patterns have '*'
/// for any characters ('.' too) and '?' for one; an empty list fits everything.
struct AccessRule {
  std::vector<std::string> roles = {};  ///< by their whole name; "*": everybody who has proven who he is
  std::vector<std::string> devices = {};
  std::vector<std::string> services = {};
  std::vector<std::string> paths = {};
  std::vector<std::string> members = {};
  std::vector<Verb> may = {};
  /// Set: for agents, who come by Face::mcp, alone; and what they write or call is on these terms.
  std::optional<AgentTerms> agent = {};

  bool operator==(const AccessRule&) const = default;
};

/// Commands of agents, who come by Face::mcp, are given by rules with `agent` alone, whatever else gives them to
/// others: nobody moves a device by what he reads unless an operator has said so. A device that plays a recording
/// (replay_name.hpp) is judged by the rules for the device and service that were recorded. Never changes once made.
class AccessRules {
 public:
  /// Everybody may do everything.
  AccessRules() = default;
  /// Without rules everybody may do everything who has proven who he is, and with `needs_login` false everybody at all.
  /// With rules all else is refused.
  AccessRules(std::vector<AccessRule> rules, bool needs_login)
      : rules_(std::move(rules)), needs_login_(needs_login || !rules_.empty()) {}

  /// Whoever may do anything within a device, a service or an object may read it as such: also to what is below the
  /// object, since it is on the way there. Members of gateway_device that tell of devices are for those who may do
  /// something with everything of all devices. Errors   permission_denied: a sentence that says who may not do what,
  /// for the client.
  [[nodiscard]] rr::Result<> check(const Identity& who, const AccessRequest& asked) const;
  /// On which terms an agent may write or call something: those of all rules that give it together. nullopt: it may
  /// not, or is no agent.
  std::optional<AgentTerms> terms(const Identity& who, const AccessRequest& what) const;
  /// How much of a device somebody may do something to. all: by one rule; rules that together give it on every part
  /// are some. `verb`  one that is_device_verb().
  Extent extent(const Identity& who, std::string_view device, Verb verb) const;
  /// Whether somebody may do all of device_verbs to everything of a device: only then can his bytes pass unread.
  /// Errors   permission_denied.
  [[nodiscard]] rr::Result<> check_whole_device(const Identity& who, std::string_view device) const;
  /// Whether there is anything of a device, of a service of it, of an object of that or of one below it, that somebody
  /// may do something to.
  bool sees(const Identity& who, std::string_view device, std::optional<std::string_view> service = {},
            std::optional<std::string_view> path = {}) const;
  /// Whether there is nothing of any device that is hidden from somebody.
  bool sees_all(const Identity& who) const;
  /// Whether there is any device at all that somebody may do something to.
  bool sees_any(const Identity& who) const;
  /// Whether there may be something that somebody may do this to.
  bool gives_any(const Identity& who, Verb verb) const;

  /// Whether there may be anything of an object, or of one below it, that somebody may write or call.
  bool may_command(const Identity& who, const AccessRequest& object) const;

  bool is_open() const { return !needs_login_; }
  bool has_rules() const { return !rules_.empty(); }

 private:
  /// Without a look at the rules: whether all may be done by who he is.
  bool may_all(const Identity& who) const { return is_open() || (!has_rules() && who.is_proven()); }

  std::vector<AccessRule> rules_;
  bool needs_login_ = false;
};

}  // namespace rrgate
