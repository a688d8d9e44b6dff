// Asks a device who it is. Layer: server/upstream. Source: transports spec section 3.1.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/support/node_id.hpp"
#include "core/types/read_definitions.hpp"
#include "node/transport/dial.hpp"

namespace rrgate {

/// The name of the node by which gateways go to devices, and know each other.
inline constexpr const char* gateway_node_name = "rrgate";

struct DeviceService {
  std::string name;
  std::string type;
  std::vector<std::string> implements;  ///< types that the root object can be used as, too

  bool operator==(const DeviceService&) const = default;
};

struct ProbeResult {
  rr::NodeId node_id;
  std::string node_name;
  std::vector<DeviceService> services;

  bool operator==(const ProbeResult&) const = default;
};

struct ProbeOptions {
  rr::NodeId self_id;    ///< the node to come as
  rr::DialOptions dial;  ///< timeout: for all that follows, too
  std::shared_ptr<rr::ReadDefinitions> definitions;
};

/// Connects to the service index, asks for the services, disconnects.
/// Errors   connection_error: not reached, no or a wrong answer. node_not_found: another node than the URL names.
rr::awaitable<rr::Result<ProbeResult>> probe(rr::ConnectionUrl url, ProbeOptions options);

}  // namespace rrgate
