// The service index: what every node says about its services. Layer: session. Source: sessions spec section 2.16.
#pragma once

#include <functional>
#include <string_view>

#include "core/session/service/hosted_service.hpp"

namespace rr {

inline constexpr std::string_view service_index_name = "RobotRaconteurServiceIndex";

/// The definition that every node serves.
extern const std::string_view service_index_definition;

/// The index as a service of a node.
std::shared_ptr<HostedService> make_service_index();

/// The answer to `function` (GetLocalNodeServices, GetRoutedNodes, GetDetectedNodes).
/// `base_url`  of the connection the question came through, "rr+tcp://127.0.0.1:52222/".
/// `may_know`  whether the asker may hear of a service (null, its name) or a node (get_node_info, KnownNode::known_as).
/// Errors   service_error: the connection has no URL; member_not_found.
Result<Value> answer_service_index_call(std::string_view function, const ServiceDirectory& directory,
                                        std::string_view base_url,
                                        const std::function<bool(EntryType, std::string_view)>& may_know);

}  // namespace rr
