#include "core/session/service/subscription_losses.hpp"

#include <vector>

namespace rr {

namespace {

double seconds(std::chrono::microseconds age) {
  return std::chrono::duration<double>(age).count();
}

}  // namespace

std::string losses_key(std::string_view path, std::string_view member, std::optional<std::int32_t> pipe_index) {
  std::string key(path);
  key.append(".").append(member);
  if (pipe_index) key.append("[").append(std::to_string(*pipe_index)).append("]");
  return key;
}

Value losses_value(const Ledger& ledger) {
  return Value(std::vector<double>{static_cast<double>(ledger.delivered), static_cast<double>(ledger.conflated),
                                   static_cast<double>(ledger.dropped), seconds(ledger.ages.quantile(0.5)),
                                   seconds(ledger.ages.quantile(0.99))});
}

std::optional<SubscriptionLosses> read_losses(const Value& attributes, std::string_view path, std::string_view member,
                                              std::optional<std::int32_t> pipe_index) {
  const auto* map = attributes.get_if<MapString>();
  const auto* all = map ? map->find(losses_attribute) : nullptr;
  const auto* subscriptions = all ? all->get_if<MapString>() : nullptr;
  const auto* found = subscriptions ? subscriptions->find(losses_key(path, member, pipe_index)) : nullptr;
  const auto* array = found ? found->get_if<Array>() : nullptr;
  if (!array || array->type() != DataType::double_t || array->size() != 5) return std::nullopt;
  const auto numbers = array->items<double>();
  // What a peer says may be anything: conversions of numbers that do not fit are undefined.
  for (std::size_t i = 0; i < 3; ++i)
    if (!(numbers[i] >= 0 && numbers[i] < 0x1p63)) return std::nullopt;
  SubscriptionLosses losses;
  losses.delivered = static_cast<std::uint64_t>(numbers[0]);
  losses.conflated = static_cast<std::uint64_t>(numbers[1]);
  losses.dropped = static_cast<std::uint64_t>(numbers[2]);
  losses.age_p50 = std::chrono::duration<double>(numbers[3]);
  losses.age_p99 = std::chrono::duration<double>(numbers[4]);
  return losses;
}

}  // namespace rr
