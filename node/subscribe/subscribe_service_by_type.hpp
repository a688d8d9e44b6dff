// A subscription that is connected to every service of a type, as they are found on the network. Layer:
// node/subscribe. Source: sessions spec section 2.17.
//
//   rr::Discovery discovery(io);
//   rr::ServiceSubscriptionFilter filter;
//   filter.nodes.push_back({.node_name = "lab.*"});
//   auto robots = rr::subscribe_service_by_type(discovery, {"experimental.create2.Create"}, filter);
//   robots.on_connected([](const rr::AsyncObject& robot) { ... });
#pragma once

#include <string>
#include <vector>

#include "node/discovery/discovery.hpp"
#include "node/subscribe/service_subscription.hpp"
#include "node/subscribe/service_subscription_filter.hpp"

namespace rr {

/// Connects to each service whose root object is of one of the types, or implements it; to all where `types` is empty.
/// A node that nobody hears of any more is not tried again once its connection is lost. Of the URLs of a node those
/// that stay on this machine come first, then those with TLS, and of each kind those that were announced last. At most
/// options.max_clients services are wanted at a time; further ones when others have gone.
/// `discovery`  outlives the subscription's end.
ServiceSubscription subscribe_service_by_type(Discovery& discovery, std::vector<std::string> types,
                                              ServiceSubscriptionFilter filter = {}, SubscriptionOptions options = {});

}  // namespace rr
