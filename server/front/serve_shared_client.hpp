// Which node a client of the gateway gets to, and serving it there. Layer: server/front.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/state/gateway_state.hpp"

namespace rrgate {

/// Where a client goes.
struct Destination {
  Device* device = nullptr;    ///< to be relayed to, or the one that `node` stands for
  SharedNode* node = nullptr;  ///< to have a session with; null: relayed
};

/// By the node that a client asks for; any id and no name ask for none in particular. nullopt: there is no such node.
std::optional<Destination> find_destination(GatewayState& gateway, const rr::NodeId& node_id,
                                            std::string_view node_name);
Destination destination_of(GatewayState& gateway, Device& device);

/// Serves a client to its end. `client` is at the start of its Robot Raconteur stream.
/// `base_url`  of the node, as the client reaches it: "rr+tcp://10.0.0.5:52222/".
rr::awaitable<void> serve_shared_client(GatewayState& gateway, Connection& connection, Destination destination,
                                        std::unique_ptr<rr::ByteStream> client, std::string base_url);

}  // namespace rrgate
