// The capability words of CreateConnection. Layer: session. Source: transports spec section 3.1.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/support/error.hpp"
#include "core/wire/codec.hpp"

namespace rr {

/// What a side can do, or what both agreed on.
struct Features {
  bool combined_v2 = true;  ///< ConnectClientCombined while version 2 is used
  bool v4 = true;
  bool combined_v4 = true;
  StringTableMode string_table = {.local = true, .standard = true};  ///< only with v4

  /// Whether a client may use ConnectClientCombined.
  bool combined() const { return v4 ? combined_v4 : combined_v2; }
  bool operator==(const Features&) const = default;
};

/// What holds with a peer that never sent or answered capabilities: version 2, nothing else.
inline constexpr Features legacy_features{
    .combined_v2 = false, .v4 = false, .combined_v4 = false, .string_table = {.local = false, .standard = false}};

std::vector<std::uint32_t> format_capabilities(const Features& features);

/// Service side: what is agreed on when a client offers `words`. Unknown pages are ignored, the last word of a page
/// wins. Errors   protocol_error: a version-2 word without its enable flag.
Result<Features> negotiate(std::span<const std::uint32_t> words, const Features& own);

/// Client side: what a service's reply to our offer means.
/// Errors   protocol_error: flags outside the table, something that was not offered, a string table without version 4.
Result<Features> accept_reply(std::span<const std::uint32_t> words, const Features& offered);

}  // namespace rr
