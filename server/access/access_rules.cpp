#include "server/access/access_rules.hpp"

#include <algorithm>
#include <iterator>

#include "core/support/glob.hpp"
#include "server/access/replay_name.hpp"

namespace rrgate {

namespace {

constexpr std::string_view verb_names[] = {"read",   "write", "call",    "subscribe", "lock",
                                           "record", "serve", "metrics", "admin"};

bool fits(const std::vector<std::string>& patterns, std::string_view text) {
  return patterns.empty() || std::any_of(patterns.begin(), patterns.end(),
                                         [&](const auto& pattern) { return rr::glob_matches(pattern, text); });
}

/// Whether the patterns fit an object, or any below it.
bool leads_to(const std::vector<std::string>& patterns, std::string_view path) {
  if (fits(patterns, path)) return true;
  const auto below = std::string(path) + ".";
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const auto& pattern) { return rr::glob_leads_on(pattern, below); });
}

/// Whether the patterns fit every text there is.
bool fits_all(const std::vector<std::string>& patterns) {
  const auto is_stars = [](const std::string& pattern) {
    return !pattern.empty() && pattern.find_first_not_of('*') == std::string::npos;
  };
  return patterns.empty() || std::any_of(patterns.begin(), patterns.end(), is_stars);
}

/// Whether a member of gateway_device tells of devices, or of their clients.
bool tells_of_devices(std::string_view member) {
  constexpr std::string_view others[] = {"",           "version",     "uptime",       "acquire_lease",
                                         "take_lease", "renew_lease", "release_lease"};
  return std::find(std::begin(others), std::end(others), member) == std::end(others);
}

bool is_command(Verb verb) {
  return verb == Verb::write || verb == Verb::call || verb == Verb::lock;
}

bool is_agent(const Identity& who) {
  return who.face == Face::mcp;
}

bool is_for(const AccessRule& rule, const Identity& who) {
  if (rule.agent && !is_agent(who)) return false;
  return std::any_of(rule.roles.begin(), rule.roles.end(),
                     [&](const auto& role) { return role == "*" ? who.is_proven() : who.has_role(role); });
}

bool gives(const AccessRule& rule, Verb verb) {
  return std::find(rule.may.begin(), rule.may.end(), verb) != rule.may.end();
}

/// Of devices.
bool gives_something(const AccessRule& rule, const Identity& who) {
  return std::any_of(rule.may.begin(), rule.may.end(), is_device_verb) && is_for(rule, who);
}

bool fits(const AccessRule& rule, const AccessRequest& what) {
  return fits(rule.devices, what.device) && fits(rule.services, what.service) && fits(rule.paths, what.path) &&
         fits(rule.members, what.member);
}

/// A device that plays a recording is used by the rights to what was recorded; its other service, which controls it,
/// is for those who may record that.
AccessRequest as_recorded(AccessRequest what) {
  const auto played = played_by(what.device);
  if (!played) return what;
  if (!what.service.empty() && what.service != played->service) return to_record(*played);
  what.device = played->device;
  what.service = played->service;
  return what;
}

std::string describe(const Identity& who) {
  if (who.name.empty() && !who.device_user.empty())
    return rr::quote(who.device_user) + " of the device, who is no user of the gateway,";
  if (who.name.empty()) return "who is not logged in";
  std::string roles;
  for (const auto& role : who.roles) roles += (roles.empty() ? "" : ", ") + role;
  return rr::quote(who.name) + " (" + (roles.empty() ? "no roles" : roles) + ")";
}

std::string describe(const AccessRequest& what) {
  if (what.verb == Verb::metrics) return "read the gateway's metrics";
  if (what.verb == Verb::admin) return "manage the gateway";
  std::string out(to_string(what.verb));
  if (!what.member.empty()) out += " " + rr::quote(what.member) + " of";
  const auto path = what.path.empty() ? what.service : what.path;
  if (!path.empty()) out += " " + rr::quote(path) + " on";
  return out + " device " + rr::quote(what.device);
}

rr::Error denied(const Identity& who, const std::string& what) {
  return rr::make_error(rr::ErrorCode::permission_denied, describe(who) + " may not " + what);
}

}  // namespace

std::string_view to_string(Verb verb) {
  return verb_names[static_cast<std::size_t>(verb)];
}

std::string_view to_string(Extent extent) {
  constexpr std::string_view names[] = {"none", "some", "all"};
  return names[static_cast<std::size_t>(extent)];
}

std::optional<Verb> parse_verb(std::string_view text) {
  const auto* found = std::find(std::begin(verb_names), std::end(verb_names), text);
  if (found == std::end(verb_names)) return std::nullopt;
  return static_cast<Verb>(found - std::begin(verb_names));
}

rr::Result<> AccessRules::check(const Identity& who, const AccessRequest& asked) const {
  if (asked.device == gateway_device && tells_of_devices(asked.member) && !sees_all(who))
    return denied(who, describe(asked) + ", which tells of all devices: no rule gives something of all devices");
  if (is_agent(who) && is_command(asked.verb)) {
    if (terms(who, asked)) return {};
    return denied(who, describe(asked) + ": no rule with \"agent\" gives it");
  }
  if (may_all(who)) return {};
  const auto what = as_recorded(asked);
  const auto given = [](std::string_view text) { return text.empty() ? std::nullopt : std::optional(text); };
  if (what.verb == Verb::read && what.member.empty())
    return sees(who, what.device, given(what.service), given(what.path)) ? rr::Result<>() : denied(who, describe(what));
  for (const auto& rule : rules_)
    if ((gives(rule, what.verb) || (what.is_shape && gives(rule, Verb::write))) && is_for(rule, who) &&
        fits(rule, what))
      return {};
  return denied(who, describe(what));
}

std::optional<AgentTerms> AccessRules::terms(const Identity& who, const AccessRequest& what) const {
  std::optional<AgentTerms> out;
  if (is_replay(what.device)) return out;  // it takes no commands but those of who looks at it
  for (const auto& rule : rules_) {
    if (!rule.agent || !gives(rule, what.verb) || !is_for(rule, who) || !fits(rule, what)) continue;
    if (out)
      out->add(*rule.agent);
    else
      out = rule.agent;
  }
  return out;
}

Extent AccessRules::extent(const Identity& who, std::string_view device, Verb verb) const {
  const bool needs_agent_rule = is_agent(who) && is_command(verb);
  if (may_all(who) && !needs_agent_rule) return Extent::all;
  auto out = Extent::none;
  if (const auto played = played_by(device)) {
    if (!needs_agent_rule) out = extent(who, played->device, verb);
    return out == Extent::all && !check(who, to_record(*played)) ? Extent::some : out;
  }
  for (const auto& rule : rules_) {
    if (!gives(rule, verb) || !is_for(rule, who) || !fits(rule.devices, device)) continue;
    if (needs_agent_rule && !rule.agent) continue;
    const bool is_of_whole_services = fits_all(rule.paths) && fits_all(rule.members);
    if (is_of_whole_services && fits_all(rule.services)) return Extent::all;
    if (is_of_whole_services || verb != Verb::record) out = Extent::some;
  }
  return out;
}

rr::Result<> AccessRules::check_whole_device(const Identity& who, std::string_view device) const {
  const auto has_all_of = [&](Verb verb) { return extent(who, device, verb) == Extent::all; };
  if (!is_agent(who) && std::all_of(std::begin(device_verbs), std::end(device_verbs), has_all_of)) return {};
  return denied(who, "do everything to " + (device.empty() ? "a device" : "device " + rr::quote(device)) +
                         ", which a connection needs that passes through the gateway unread; with \"mode\": \"shared\" "
                         "of the device rights hold for each member");
}

bool AccessRules::sees_all(const Identity& who) const {
  if (may_all(who)) return true;
  return std::any_of(rules_.begin(), rules_.end(), [&](const AccessRule& rule) {
    return gives_something(rule, who) && fits_all(rule.devices) && fits_all(rule.services) && fits_all(rule.paths);
  });
}

bool AccessRules::sees_any(const Identity& who) const {
  if (may_all(who)) return true;
  return std::any_of(rules_.begin(), rules_.end(), [&](const AccessRule& rule) { return gives_something(rule, who); });
}

bool AccessRules::gives_any(const Identity& who, Verb verb) const {
  if (may_all(who)) return true;
  return std::any_of(rules_.begin(), rules_.end(),
                     [&](const AccessRule& rule) { return gives(rule, verb) && is_for(rule, who); });
}

bool AccessRules::may_command(const Identity& who, const AccessRequest& object) const {
  if (may_all(who) && !is_agent(who)) return true;
  return std::any_of(rules_.begin(), rules_.end(), [&](const AccessRule& rule) {
    return (gives(rule, Verb::write) || gives(rule, Verb::call)) && is_for(rule, who) &&
           (rule.agent || !is_agent(who)) && fits(rule.devices, object.device) && fits(rule.services, object.service) &&
           leads_to(rule.paths, object.path);
  });
}

bool AccessRules::sees(const Identity& who, std::string_view device, std::optional<std::string_view> service,
                       std::optional<std::string_view> path) const {
  if (may_all(who)) return true;
  if (const auto played = played_by(device)) {
    if (service && *service != played->service) return check(who, to_record(*played)).has_value();
    return sees(who, played->device, played->service, path);
  }
  if (!path) path = service;  // its root object: all others are below
  return std::any_of(rules_.begin(), rules_.end(), [&](const AccessRule& rule) {
    return gives_something(rule, who) && fits(rule.devices, device) && (!service || fits(rule.services, *service)) &&
           (!path || leads_to(rule.paths, *path));
  });
}

}  // namespace rrgate
