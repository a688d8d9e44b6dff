// Services that are there. Layer: server/cli.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace rrgate {

/// URLs of the services of nodes that are heard of on the network and this machine within `wait`.
std::vector<std::string> find_service_urls(std::chrono::milliseconds wait);

}  // namespace rrgate
