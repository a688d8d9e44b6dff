// How locks and leases know the objects of a device. Layer: server/upstream. Source: sessions spec section 2.5.
#pragma once

#include <string>
#include <string_view>

namespace rrgate {

/// One spelling of a path for all that name the same object, whatever they escape.
std::string canonical_lock_path(std::string_view path);

}  // namespace rrgate
