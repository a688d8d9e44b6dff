#include "server/http/endpoints/health.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/state/gateway_state.hpp"

namespace rrgate {

Handler health_endpoint() {
  return [](const Request&, std::string_view) { return json_response(200, "{\"status\":\"ok\"}\n"); };
}

Handler ready_endpoint(GatewayState& gateway) {
  return [&gateway](const Request&, std::string_view) {
    const auto& devices = gateway.devices().all();
    nlohmann::ordered_json out;
    out["status"] = gateway.is_stopping() ? "stopping" : "ready";
    out["devices"] = devices.size();
    out["devices_online"] = std::count_if(devices.begin(), devices.end(),
                                          [](const auto& device) { return device->state() == DeviceState::online; });
    return json_response(gateway.is_stopping() ? 503 : 200, out.dump() + "\n");
  };
}

}  // namespace rrgate
