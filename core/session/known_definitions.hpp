// What a client tells of the definitions that it has, so that a service need not send them again: an extension of ours,
// docs/subscriptions.md "What a reconnect costs". Layer: session.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace rr {

/// The element that carries a tag: from a client the one that it has, or an empty one; from a service the one of what
/// it would send. Where both are the same, the service leaves the definitions out. Others know no such element.
inline constexpr std::string_view definitions_element = "rrgate.definitions";

/// Definitions of an earlier session, to be used again where the service says that they are still the same.
struct KnownDefinitions {
  std::string name;  ///< empty: all that came with connecting; else the one that was fetched by this name
  std::string tag;   ///< as the service gave it; clients make nothing of it
  std::vector<std::string> texts;
};

/// A client remembers no more than that.
inline constexpr std::size_t max_known_definitions = 64;

/// Names exactly these texts in this order, a UUID made of them (RFC 4122, version 5). So it is the same after a
/// restart and on every node that has the service.
std::string make_definitions_tag(const std::vector<std::string_view>& texts);

}  // namespace rr
