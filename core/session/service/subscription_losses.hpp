// What a service session tells its client of that client's own subscriptions: an attribute of ours in the answer to
// GetServiceAttributes, docs/shared-sessions.md "Losses and ages". Layer: session.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/member/ledger.hpp"
#include "core/types/value.hpp"

namespace rr {

/// A map{string}, only there while there are subscriptions: by losses_key() a double[5]: values delivered, conflated
/// and dropped, and in seconds the ages that half and 99 % of them did not exceed.
inline constexpr std::string_view losses_attribute = "rrgate.subscriptions";
/// An int32, only there where not all are told: how many are missing.
inline constexpr std::string_view left_out_attribute = "rrgate.subscriptions_left_out";
inline constexpr std::size_t max_told_subscriptions = 1024;

/// See Ledger.
struct SubscriptionLosses {
  std::uint64_t delivered = 0;
  std::uint64_t conflated = 0;
  std::uint64_t dropped = 0;
  std::chrono::duration<double> age_p50{};
  std::chrono::duration<double> age_p99{};
};

/// "Create.distance"; of a pipe endpoint "Create.frames[3]".
std::string losses_key(std::string_view path, std::string_view member, std::optional<std::int32_t> pipe_index = {});

Value losses_value(const Ledger& ledger);

/// `attributes`  what ClientSession::get_attributes() completes with.
/// Returns  nullopt: the service keeps none, or the client has no such subscription.
std::optional<SubscriptionLosses> read_losses(const Value& attributes, std::string_view path, std::string_view member,
                                              std::optional<std::int32_t> pipe_index = {});

}  // namespace rr
