// Equality of service definitions. Source: service definitions spec section 5.9.
#pragma once

#include "core/robdef/robdef.hpp"

namespace rr::test {

/// Whether both say the same; documentation does not count.
bool is_equal(const ServiceDefinition& left, const ServiceDefinition& right);

}  // namespace rr::test
