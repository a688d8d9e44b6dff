// The objects of devices over HTTP: GET, PUT, POST and streams. Layer: server/http/endpoints. See docs/http-api.md.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "server/http/router.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

/// What is below a device and no service of it, the definitions "NAME.robdef" apart.
inline constexpr std::array<std::string_view, 5> device_resources = {"subscriptions", "openapi.json", "asyncapi.json",
                                                                     "thing-description.json", "types.d.ts"};

/// "DEVICE", "DEVICE/SERVICE" and what is below, for all methods.
/// Whether a request commands a member of a device that is urgent (LeaseConfig::is_urgent()), and of which service.
struct UrgentCommand {
  std::string device = {};  ///< empty: it does not
  std::string service = {};
};
UrgentCommand find_urgent(GatewayState& gateway, const Request& request);

Handler objects_endpoint(GatewayState& gateway);

}  // namespace rrgate
