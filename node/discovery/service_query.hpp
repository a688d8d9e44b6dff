// Asks nodes for their services. Layer: node/discovery. Source: transports spec section 6.4, sessions spec section
// 2.16.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/discovery/detected_nodes.hpp"
#include "core/session/connection.hpp"
#include "core/types/read_definitions.hpp"
#include "core/types/value.hpp"
#include "node/transport/dial.hpp"

namespace rr {

/// What a node says about one of its services (ServiceInfo2 of the reference).
struct ServiceInfo {
  NodeIdentity node;  ///< as the node itself said it when connecting
  std::string name;
  std::string root_object_type;
  std::vector<std::string> root_object_implements;  ///< qualified
  std::string connection_url;                       ///< the way that the answer took, with the service's name
  MapString attributes;

  /// Whether the root object is of this type or implements it; qualified.
  bool implements(std::string_view type) const;
};

struct NodeServices {
  NodeIdentity node;
  std::vector<ServiceInfo> services;  ///< but for the index itself; none from a node without an index
};

struct ServiceQueryOptions {
  std::string self_name = {};  ///< node name to come under
  NodeId self_id = {};         ///< any: a random one
  DialOptions dial = {};       ///< timeout: for all that follows, too
  std::size_t max_answer_bytes = 64 * 1024;
  std::shared_ptr<ReadDefinitions> definitions = {};  ///< see ClientOptions::read_definitions
};

/// Connects to the service index of `url`'s node, asks, disconnects.
/// Errors   connection_error: not reached, no or a wrong answer, one that is too long. node_not_found: another node
/// than
///          the URL names.
awaitable<Result<NodeServices>> query_services(ConnectionUrl url, ServiceQueryOptions options);

/// URLs of a detected node to connect to: those with a scheme of the list (empty: any) that can be dialed, the ones
/// announced last first, at most 8. They demand the node's id and name.
std::vector<ConnectionUrl> candidate_urls(const NodeDiscoveryInfo& node, const std::vector<std::string>& schemes = {});

/// A way to a node as one to a service of it, that demands the node's id. The node's own idea of its URL lacks the zone
/// of a link-local address, and might name anybody: a way that is known is better.
std::string url_of_service(ConnectionUrl url, const NodeIdentity& node, std::string_view service);

/// Asks a node over several URLs, 15 ms apart; the first answer counts and ends the other attempts. Can be cancelled,
/// and leaves nothing behind. Errors   as of race(), with the cause for each URL; connection_error: no URL.
awaitable<Result<NodeServices>> query_node(std::vector<ConnectionUrl> urls, ServiceQueryOptions options);

}  // namespace rr
