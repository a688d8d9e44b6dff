// What agents are told of devices. Layer: server/mcp. See docs/mcp.md.
//
// What a device says stands under the key "from_device", bounded, and nowhere else: a model can tell it from what the
// gateway says.
#pragma once

#include <string>
#include <string_view>

#include "server/http/endpoints/object_request.hpp"

namespace rrgate {

inline constexpr std::string_view from_device = "from_device";

/// Text of a device or an agent as UTF-8, cut where it is longer than anybody needs. `most`  bytes.
std::string bounded_text(std::string_view text, std::size_t most = 1000);

/// The verbs by which an agent can use a member at all.
std::vector<Verb> uses_of(const rr::MemberDefinition& member);

/// Part of a list, from `cursor` on: an empty one begins it.
struct McpPage {
  std::size_t first = 0;
  std::size_t last = 0;
  std::string next = {};  ///< empty: that was all
};
/// Throws   rr::Exception, invalid_argument: a cursor that no list has given.
McpPage page_of(std::size_t count, const std::string& cursor);

/// The devices that the asker may use anything of.
std::vector<const Device*> devices_for_agent(GatewayState& gateway, const Identity& who);
rr::OrderedJson list_for_agent(GatewayState& gateway, const Identity& who, const std::string& cursor);
/// One of them.
rr::OrderedJson device_for_agent(GatewayState& gateway, const Identity& who, const Device& device);
/// The members of the object, or the one member, with their schemas and what the asker may do to them.
rr::OrderedJson describe_for_agent(GatewayState& gateway, const Identity& who, const Target& target,
                                   const std::string& cursor);

}  // namespace rrgate
