// The part of the configuration that says which devices there are, and how they are reached and shared. Layer:
// server/config.
#pragma once

#include "server/config/config.hpp"
#include "server/config/object_reader.hpp"

namespace rrgate {

void read_device(ObjectReader& in, DeviceConfig& device);
/// Of devices that are found.
void read_discover(ObjectReader& in, Discover& discover);

}  // namespace rrgate
