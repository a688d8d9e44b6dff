#include "server/http/endpoints/devices.hpp"

#include <nlohmann/json.hpp>

#include "core/session/service_path.hpp"
#include "node/http/upgrade.hpp"
#include "server/recordings/recording_files.hpp"
#include "server/state/gateway_state.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

namespace {

/// Where the asker finds the device: by the host, scheme and path that it used itself.
nlohmann::ordered_json websocket_url(const Arrival& arrival, const std::string& device) {
  if (arrival.host.empty()) return nullptr;
  return (arrival.is_encrypted ? "wss://" : "ws://") + arrival.host + arrival.prefix + "/devices/" + device;
}

/// What makes the device safe when a lease ends, as "path.member", as far as the asker may have a lease of it.
nlohmann::ordered_json safe_members(const Device& device, const Identity& asker, const Access& access) {
  auto out = nlohmann::ordered_json::array();
  const auto& config = device.config();
  if (!device.is_shared() || !config.leases.is_offered) return out;
  for (const auto& action : config.leases.safe) {
    const auto service = rr::first_segments(action.path, 1);
    const AccessRequest lease{.device = config.name, .service = service, .path = action.path, .verb = Verb::lock};
    if (access.state().rules.check(asker, lease)) out.push_back(action.path + "." + action.member);
  }
  return out;
}

nlohmann::ordered_json describe(const Device& device, const Request& request, const Access& access) {
  const auto& arrival = request.arrival;
  nlohmann::ordered_json out;
  out["name"] = device.config().name;
  out["url"] = rr::format_url(device.config().url);
  out["websocket_url"] = websocket_url(arrival, device.config().name);
  out["mode"] = device.is_shared() ? "shared" : "relay";
  out["found"] = device.config().is_found;
  out["served"] = device.config().is_served;
  out["recording"] = nullptr;
  if (const auto recording = recording_of_replay(device.config().name); !recording.empty())
    out["recording"] = recording;
  out["node_id"] = nullptr;
  out["node_name"] = nullptr;
  const auto& identity = device.identity();
  if (identity) {
    out["node_id"] = rr::format_node_id(identity->node_id, rr::NodeIdFormat::dashes);
    out["node_name"] = identity->node_name;
  }
  out["state"] = std::string(to_string(device.state()));
  out["last_error"] = nullptr;
  if (!device.last_error().empty()) out["last_error"] = device.last_error();
  out["services"] = nlohmann::ordered_json::array();
  if (identity)
    for (const auto& service : identity->services)
      if (access.sees(request.identity, device.config().name, service.name))
        out["services"].push_back({{"name", service.name}, {"type", service.type}, {"implements", service.implements}});
  out["clients"] = device.clients();
  out["safe"] = safe_members(device, request.identity, access);
  return out;
}

}  // namespace

Handler devices_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    nlohmann::ordered_json out;
    out["devices"] = nlohmann::ordered_json::array();
    const auto& access = gateway.access();
    for (const auto& device : gateway.devices().all())
      if (access.sees(request.identity, device->config().name))
        out["devices"].push_back(describe(*device, request, access));
    if (out["devices"].empty() && !access.is_open() && !request.identity.is_proven())
      return gateway.http_access().refusal(request, rr::make_error(rr::ErrorCode::permission_denied,
                                                                   "a client that is not logged in may see no device"));
    return json_response(200, rr::write_json(out) + "\n");
  };
}

Response no_such_device(std::string_view name) {
  return problem_response(404, "no device " + rr::quote(name) + "; /api/v1/devices lists them");
}

Response describe_device(const Device& device, const Request& request, const Access& access) {
  return json_response(200, rr::write_json(describe(device, request, access)) + "\n");
}

Response list_subscriptions(GatewayState& gateway, const Identity& asker, const Device& device) {
  const auto& access = gateway.access();
  const auto& rules = access.state().rules;
  const bool shows_clients = rules.check(asker, {.verb = Verb::admin}).has_value();
  nlohmann::ordered_json out;
  auto& list = out["subscriptions"] = nlohmann::ordered_json::array();
  gateway.shared().visit_ledgers([&](const SharedDevice& shared, const SharedClient& client, const std::string& path,
                                     const rr::MemberDefinition& member, const rr::Ledger& ledger) {
    if (shared.device().get() != &device) return;
    if (client.service() && !access.sees(asker, device.config().name, client.service()->name(), path)) return;
    list.push_back({{"client", shows_clients ? nlohmann::ordered_json(client.peer()) : nullptr},
                    {"service", client.service() ? client.service()->name() : std::string()},
                    {"path", path},
                    {"member", member.name},
                    {"kind", std::string(member_kind_name(member.kind))},
                    {"delivered", ledger.delivered},
                    {"conflated", ledger.conflated},
                    {"dropped", ledger.dropped},
                    {"age_p50_ms", static_cast<double>(ledger.ages.quantile(0.5).count()) / 1000},
                    {"age_p99_ms", static_cast<double>(ledger.ages.quantile(0.99).count()) / 1000}});
  });
  return json_response(200, rr::write_json(out) + "\n");
}

Handler no_such_api_endpoint() {
  return [](const Request& request, std::string_view) {
    return problem_response(404, "nothing is at " + rr::quote(request.path()));
  };
}

Handler device_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view name) {
    // Strangers are not told what there is.
    if (const auto allowed = gateway.access().check(request.identity, {.device = name}); !allowed) {
      gateway.reject(Rejection::forbidden);
      return gateway.http_access().refusal(request, allowed.error());
    }
    if (!gateway.devices().find(name)) return no_such_device(name);
    return upgrade_required("this is a WebSocket for Robot Raconteur clients; connect with a ws:// or rr+ws:// URL");
  };
}

}  // namespace rrgate
