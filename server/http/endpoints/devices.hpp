// /api/v1/devices: what is behind the gateway. Layer: server/http/endpoints.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class Access;
class Device;
class GatewayState;

/// {"devices":[{"name","url","websocket_url","found","node_id","node_name","state","last_error","services":[{"name","type","implements"}],"clients"}]};
/// url: the device's own; websocket_url: the way to it through the gateway, and the proxies before it, that the asker
/// came; found: by discovery, not configured; node_id and node_name are null until the device has answered once,
/// last_error is null while it is online. Devices and services of which the asker may use nothing are left out.
Handler devices_endpoint(GatewayState& gateway);
/// What every client of a shared device has subscribed to, and what came of it. Where from a client comes is told to
/// those alone who may manage the gateway.
Response list_subscriptions(GatewayState& gateway, const Identity& asker, const Device& device);
/// 404.
Response no_such_device(std::string_view name);
/// One of them.
Response describe_device(const Device& device, const Request& request, const Access& access);
/// Everything else below /api/: 404.
Handler no_such_api_endpoint();
/// /devices/NAME without an upgrade: says that a WebSocket is expected, or 404.
Handler device_endpoint(GatewayState& gateway);

}  // namespace rrgate
