// To stay connected to a service, or to every service of a type; to find nodes and to be found (rr::Discovery).
// docs/subscriptions.md, docs/discovery.md. What this includes is internal, and changes.
#pragma once

#include "node/subscribe/subscribe_service_by_type.hpp"
