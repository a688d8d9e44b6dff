// What a request does with a member. Layer: server/http/endpoints.
#pragma once

#include "server/http/endpoints/object_request.hpp"

namespace rrgate {

/// Answers at once: properties, functions, memories, wires peeked and poked.
/// Throws   rr::Exception: what the device said.
rr::awaitable<void> answer_member(const ObjectRequest& request, const Target& target);

/// The arguments of a function from the body {"name": value, ...}; nothing where it takes none.
/// Errors   those of value_from_json(); invalid_argument: missing, unknown or superfluous names.
rr::awaitable<rr::Result<std::vector<rr::Value>>> read_arguments(const ObjectRequest& request,
                                                                 const rr::MemberDefinition& member,
                                                                 const rr::TypeRegistry& types);

/// Answers while values come: events, pipes and wires as server-sent events, generators as those or as JSON lines.
/// Throws   rr::Exception, before anything was sent.
rr::awaitable<void> stream_topic(const ObjectRequest& request, const Target& target);
/// Values of a pipe or a wire that are images, as JPEG one after another; the newest for who reads slowly.
rr::awaitable<void> stream_images(const ObjectRequest& request, const Target& target);
rr::awaitable<void> stream_generator(const ObjectRequest& request, const Target& target);

}  // namespace rrgate
