// The part of a device's configuration that says who may command it. Layer: server/config.
#pragma once

#include "server/config/config.hpp"
#include "server/config/object_reader.hpp"

namespace rrgate {

void read_leases(ObjectReader& in, LeaseConfig& leases);

}  // namespace rrgate
