// Rights of clients of shared devices, member by member. Layer: server/rr.
#pragma once

#include <functional>

#include "core/session/service/service_session.hpp"
#include "server/access/access.hpp"
#include "server/rr/shared_node.hpp"

namespace rrgate {

/// What a session of `who` asks before anything is done with a member. A user who logs in is asked about from then on.
/// `access` and `node` outlive the session.
std::function<rr::Result<>(const rr::MemberAccess&)> make_admission(Access& access, const SharedNode& node,
                                                                    Identity who);

}  // namespace rrgate
