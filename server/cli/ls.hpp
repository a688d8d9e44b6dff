// Services that are there. Layer: server/cli.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "server/cli/remote_service.hpp"

namespace rrgate {

/// URLs of the services of nodes that are heard of on the network and this machine within `wait`.
std::vector<std::string> find_service_urls(std::chrono::milliseconds wait);
/// URLs of the services of a node, of a gateway, of one device of a gateway ("http://HOST:PORT/devices/arm", or its
/// page), of which one service may be named, or, where `where.url` is empty, around here within 2 s. `type`  of the
/// root object; empty: any. Throws   as commands that use a service.
std::vector<std::string> list_service_urls(const RemoteOptions& where, const std::string& type);

}  // namespace rrgate
