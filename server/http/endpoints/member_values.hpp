// What members take and give, as JSON, whatever carries it. Layer: server/http/endpoints.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "server/http/endpoints/object_request.hpp"
#include "server/http/endpoints/refusal.hpp"
#include "server/json/arguments.hpp"

namespace rrgate {

/// What one request may read of a memory.
inline constexpr std::uint64_t max_memory_bytes = 16u * 1024 * 1024;

/// Documentation without the blank that follows "##" in each line of a definition.
std::string plain_documentation(std::string_view documentation);

/// What an object has: for people who look around, and programs that do.
rr::OrderedJson describe_object(const Target& target);

/// What a sample says: a value, or an event's arguments by name.
rr::Result<rr::OrderedJson> sample_to_json(const Sample& sample, const rr::MemberDefinition& member,
                                           const rr::TypeRegistry& types, const rr::JsonForm& form);
/// "connected", "connection_lost", "closed" (a pipe, by the device): what listeners hear beside samples.
std::string_view state_name(const rr::Error* error);

/// What the device has answered for the target's member. Throws   rr::Exception, protocol_error: it can't be told as
/// JSON, though the device has done what it was asked for.
rr::OrderedJson to_json(const Target& target, const rr::Value& value, const rr::JsonForm& form);

using Shape = std::vector<std::uint64_t>;

/// Bytes of an item of a memory; 0 where its items have no fixed size.
std::size_t item_bytes_of(const Target& target);
/// Items a dimension. Throws   rr::Exception.
rr::awaitable<Shape> memory_shape(const Target& target);
/// A part of a memory of `shape`; from the first item, to the last one, where nothing else is said.
/// Throws   rr::Exception: buffer_limit_violation for more than max_memory_bytes; what the device said.
rr::awaitable<rr::Value> read_items(const Target& target, const Shape& shape, const std::optional<Shape>& offset,
                                    const std::optional<Shape>& count);
/// The same for writing. Throws   rr::Exception: invalid_argument where `count` is not what `items` has; what the
/// device said.
rr::awaitable<void> write_items(const Target& target, const Shape& shape, const std::optional<Shape>& offset,
                                const std::optional<Shape>& count, rr::Value items);

}  // namespace rrgate
