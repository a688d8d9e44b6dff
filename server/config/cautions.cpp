#include "server/config/cautions.hpp"

#include <algorithm>

namespace rrgate {

namespace {

/// What an agent would not be given by /mcp without terms, or could answer itself with.
bool gives_more(const AccessRule& rule) {
  return std::any_of(rule.may.begin(), rule.may.end(), [](Verb verb) {
    return verb == Verb::write || verb == Verb::call || verb == Verb::lock || verb == Verb::record ||
           verb == Verb::admin;
  });
}

bool share_role(const AccessRule& one, const AccessRule& other) {
  return std::any_of(one.roles.begin(), one.roles.end(), [&](const auto& role) {
    return role == "*" || std::any_of(other.roles.begin(), other.roles.end(),
                                      [&](const auto& each) { return each == "*" || each == role; });
  });
}

/// Where an agent could do by another way than /mcp what it may not there.
void find_ways_around(const Config& config, std::vector<Finding>& out) {
  const auto& rules = config.access.rules;
  if (config.mcp.is_enabled && config.access.has_users() && rules.empty())
    out.push_back({"/access/rules",
                   "missing: /mcp lets agents read alone, but by all other ways whoever proves who he is may do "
                   "everything, an agent too"});
  for (std::size_t i = 0; i < rules.size(); ++i) {
    if (rules[i].agent || !gives_more(rules[i])) continue;
    const auto is_of_agent = [&](const AccessRule& each) { return each.agent && share_role(each, rules[i]); };
    if (std::any_of(rules.begin(), rules.end(), is_of_agent))
      out.push_back({"/access/rules/" + std::to_string(i) + "/may",
                     "is for a role that another rule has for agents: by other ways than /mcp an agent of this role "
                     "does it without limits and without being asked about"});
  }
}

/// Devices whose sessions pass unread, though somebody wants to know what is done.
void find_unrecorded(const Config& config, std::vector<Finding>& out) {
  if (config.access.audit.file.empty()) return;
  const auto is_relayed = [](const auto& each) { return each.mode == DeviceMode::relay; };
  const auto relayed = std::find_if(config.devices.begin(), config.devices.end(), is_relayed);
  const std::string relay =
      "relay: what clients do in sessions that the gateway passes on unread is not in the audit log";
  if (relayed != config.devices.end())
    out.push_back({"/devices/" + std::to_string(relayed - config.devices.begin()) + "/mode", relay});
  else if (config.discover.is_enabled && is_relayed(config.discover))
    out.push_back({"/discover/mode", relay});
}

}  // namespace

std::vector<Finding> find_cautions(const Config& config) {
  std::vector<Finding> out;
  const auto& access = config.access;
  if (access.jwt.is_used() && access.jwt.claims.issuer.empty())
    out.push_back({"/access/jwt/issuer", "missing: a token of any issuer that uses these keys is taken"});
  if (access.jwt.is_used() && access.jwt.claims.audience.empty())
    out.push_back({"/access/jwt/audience", "missing: a token that was made for another service is taken"});
  for (std::size_t i = 0; i < config.devices.size(); ++i) {
    const auto& url = config.devices[i].url;
    if (has_node_tls(url) && !url.node_id)
      out.push_back({"/devices/" + std::to_string(i) + "/url",
                     "names no nodeid: whoever has a certificate of a node may pretend to be this device"});
  }
  if (!config.proxy.trust.proxies.empty() && access.rules.empty())
    out.push_back({"/access/rules",
                   std::string("missing: ") +
                       (access.has_users() ? "whoever proves who he is" : "everybody whom a proxy lets through") +
                       " may do everything"});
  if (!config.tls.certificates.empty() && access.has_users() && !config.tls.is_required)
    out.push_back({"/tls/required", "false: a password or a token that is sent in clear is taken"});
  find_ways_around(config, out);
  find_unrecorded(config, out);
  return out;
}

}  // namespace rrgate
