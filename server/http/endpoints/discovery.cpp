#include "server/http/endpoints/discovery.hpp"

#include <algorithm>
#include <functional>

#include "server/json/json.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

namespace {

using Json = rr::OrderedJson;

/// Whether who asks may know of a service.
using Sees = std::function<bool(const std::string& service)>;

Json describe_services(const FoundDevices::Entry& entry, const Sees& sees) {
  Json out = Json::array();
  if (entry.device && entry.device->identity()) {
    for (const auto& service : entry.device->identity()->services)
      if (sees(service.name))
        out.push_back({{"name", service.name}, {"type", service.type}, {"implements", service.implements}});
  } else if (entry.services) {
    for (const auto& service : *entry.services)
      if (sees(service.name))
        out.push_back({{"name", service.name},
                       {"type", service.root_object_type},
                       {"implements", service.root_object_implements}});
  } else {
    return nullptr;
  }
  return out;
}

Json describe(const FoundDevices::Entry& entry, const Sees& sees, std::chrono::steady_clock::time_point now) {
  const auto age = [now](const rr::NodeDiscoveryUrl& url) {
    return std::chrono::duration_cast<std::chrono::seconds>(now - url.last_announce).count();
  };
  Json out;
  out["node_id"] = rr::format_node_id(entry.node.node_id, rr::NodeIdFormat::dashes);
  out["node_name"] = entry.node.node_name;
  out["urls"] = Json::array();
  for (const auto& url : entry.node.urls) out["urls"].push_back({{"url", url.url}, {"age", age(url)}});
  const auto newest = std::max_element(entry.node.urls.begin(), entry.node.urls.end(),
                                       [](const auto& a, const auto& b) { return a.last_announce < b.last_announce; });
  out["age"] = age(*newest);  // a node has at least one URL
  out["services"] = describe_services(entry, sees);
  out["allowed"] = entry.is_allowed;
  out["device"] = nullptr;
  if (entry.device) out["device"] = entry.device->config().name;
  return out;
}

}  // namespace

Handler discovery_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    const auto& access = gateway.access();
    const bool sees_all = access.state().rules.check(request.identity, {.verb = Verb::admin}).has_value();
    const auto now = std::chrono::steady_clock::now();
    const auto* found = gateway.found();
    Json out;
    out["enabled"] = found != nullptr;
    out["nodes"] = Json::array();
    if (found)
      for (const auto& entry : found->list()) {
        const auto sees = [&](const std::string& service) {
          return sees_all || (entry.device && access.sees(request.identity, entry.device->config().name, service));
        };
        if (sees_all || (entry.device && access.sees(request.identity, entry.device->config().name)))
          out["nodes"].push_back(describe(entry, sees, now));
      }
    return json_response(200, rr::write_json(out) + "\n");
  };
}

}  // namespace rrgate
