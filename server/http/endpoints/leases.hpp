// Leases for clients of HTTP: POST .../OBJECT?lease=acquire. Layer: server/http/endpoints. See docs/leases.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "server/http/endpoints/object_request.hpp"

namespace rrgate {

/// The header by which requests show the key of their lease.
inline constexpr std::string_view lease_header = "Rrgate-Lease";

/// The name of the record of a request: where it asks for a lease, that; empty: its verb. nullopt: it is not recorded,
/// since a lease is renewed several times a second, and its end has a record of its own.
std::optional<std::string_view> lease_event(const ObjectRequest& request, const Target& target);
/// Whether the request releases a lease that its client has: that takes no right.
bool releases_own_lease(const ObjectRequest& request, const Target& target);
/// Whether the request takes a lease, if it is one for an object.
bool takes_lease(const Request& request);
/// Of a release, as far as the head of the request tells: whether it shows the key of a lease of the object that it
/// names.
bool shows_own_lease(GatewayState& gateway, const Request& request);
/// Whose right a lease needs to last: whoever has taken it must have the right to lock; or, where the gateway holds it
/// for a command, the gateway looks itself whether that may go on.
enum class LeaseNeeds : std::uint8_t { right_to_lock, nothing };
/// One more client of the session that `asker` uses: it holds the lease of an object until it is gone, or the lease
/// ends. Throws   rr::Exception.
rr::awaitable<std::shared_ptr<ValueClient>> hold_lease(GatewayState& gateway, std::shared_ptr<ValueClient> asker,
                                                       Identity who, std::string path, rr::LockCommand command,
                                                       milliseconds deadman, LeaseNeeds needs);
inline constexpr std::string_view unanswered_stop = "the device has not answered yet: whether it is safe is not known";
/// What has become of an object that was to be made safe: {"stopped": PATH}; {"sent": PATH, "unanswered": why}, where
/// the device has not answered yet; or {"refused": PATH, "error": as of the device}.
rr::OrderedJson stop_to_json(const SafeAnswer& safe);
/// Throws   rr::Exception.
rr::awaitable<Response> answer_lease(const ObjectRequest& request, const Target& target);

}  // namespace rrgate
