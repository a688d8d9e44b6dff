// Who one is, sign-ins of pages, tickets for upgrades, requests of access. Layer: server/http/endpoints.
#pragma once

#include <array>
#include <string_view>

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

/// GET /api/v1/access: {"user","roles","proof","login": whether there is anything to prove,"requests": whether one may
/// ask for access,"admin": whether one decides on that,"session": whether a cookie has said so,"expires_in": seconds
/// until what was shown is good no more,"may": what may be done to the gateway,"devices": {NAME: {VERB: "all" or
/// "some"}}}; user is null for who has shown nothing, expires_in for what is good for ever. ?devices=false leaves those
/// out.
Handler who_endpoint(GatewayState& gateway);
/// POST /api/v1/session {"user","password"}, {"token"}, or with Authorization: 201 {"user","roles","expires_in"} and a
/// cookie that says the same from then on (SignIns).
Handler sign_in_endpoint(GatewayState& gateway);
/// DELETE /api/v1/session: takes the cookie away, and what goes on by it ends. 204, signed in or not.
Handler sign_out_endpoint(GatewayState& gateway);
/// POST /api/v1/tickets: {"ticket","expires_in"}, for the upgrade .../devices/NAME?ticket=TICKET, once.
Handler tickets_endpoint(GatewayState& gateway);

/// POST /api/v1/access/requests {"name","reason"}, by anybody: 202 {"id","secret","expires_in"}.
Handler ask_endpoint(GatewayState& gateway);
/// GET /api/v1/access/requests, for admins: {"requests":[{"id","name","reason","client","state","asked"}]}.
Handler requests_endpoint(GatewayState& gateway);
/// What can be done with one.
inline constexpr std::array<std::string_view, 3> request_actions = {"approve", "deny", "claim"};
/// POST /api/v1/access/requests/ID/approve {"roles":[...],"days":N}, .../deny, for admins; .../claim {"secret"}, by who
/// has asked: {"state"} and, the first time after approval, {"token"}.
Handler request_endpoint(GatewayState& gateway);

}  // namespace rrgate
