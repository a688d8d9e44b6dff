// The objects of devices over HTTP: GET, PUT, POST and streams. Layer: server/http/endpoints. See docs/http-api.md.
#pragma once

#include <optional>
#include <string>

#include "server/http/router.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

/// A request that neither a rate nor a lack of memory holds up, as long as somebody may `verb` the service: it commands
/// a member of a device that is urgent (LeaseConfig::is_urgent()), takes a lease whose end makes something safe, gives
/// one back whose key it shows, or stops all agents.
struct UrgentCommand {
  std::string device = {};
  std::string service = {};
  Verb verb = Verb::read;
};
std::optional<UrgentCommand> find_urgent(GatewayState& gateway, const Request& request);

/// "DEVICE", "DEVICE/SERVICE" and what is below, for all methods.
Handler objects_endpoint(GatewayState& gateway);

}  // namespace rrgate
