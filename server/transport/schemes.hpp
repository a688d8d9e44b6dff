// Which URL schemes a device may have. Layer: server/transport. Kept apart from dial.hpp, which needs Asio.
#pragma once

#include <string>
#include <string_view>

#include "core/session/url.hpp"

namespace rr {

bool can_dial(std::string_view scheme);
/// "rr+tcp, ..." for messages.
std::string dialable_schemes();

}  // namespace rr
