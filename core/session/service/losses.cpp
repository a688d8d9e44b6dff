// Attributes for one client: those of the service, and what became of the values of its own subscriptions.
// Layer: session. Source: subscription_losses.hpp.
#include <algorithm>
#include <utility>

#include "core/session/service/service_session.hpp"
#include "core/session/service/subscription_losses.hpp"

namespace rr {

MapString ServiceSession::attributes_of(const HostedService& service) const {
  MapString attributes;
  if (const auto* own = service.attributes().get_if<MapString>()) attributes = *own;
  for (const auto& item : options_.attributes.items) attributes.items.push_back(item);
  return attributes;
}

Value ServiceSession::attributes_with_losses() const {
  auto attributes = attributes_of(*service_);
  MapString told;
  const auto tell = [&told](std::string key, const Ledger& ledger) {
    if (told.items.size() < max_told_subscriptions) told.items.emplace_back(std::move(key), losses_value(ledger));
  };
  for (const auto& [key, wire] : wires_) tell(losses_key(key.path, key.member), wire.ledger);
  for (const auto& [id, pipe] : pipes_) tell(losses_key(pipe.key->path, pipe.key->member, pipe.index), pipe.ledger);
  if (told.items.empty()) return Value(std::move(attributes));
  const auto left_out = wires_.size() + pipes_.size() - told.items.size();
  std::erase_if(attributes.items,
                [](const auto& item) { return item.first == losses_attribute || item.first == left_out_attribute; });
  attributes.items.emplace_back(std::string(losses_attribute), Value(std::move(told)));
  if (left_out > 0)
    attributes.items.emplace_back(std::string(left_out_attribute), Value(static_cast<std::int32_t>(left_out)));
  return Value(std::move(attributes));
}

}  // namespace rr
