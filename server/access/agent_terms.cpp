#include "server/access/agent_terms.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace rrgate {

namespace {

/// Whether all numbers at a place below `json` lie within. Of an array each item counts; an empty one has none.
bool is_within(const rr::OrderedJson& json, std::string_view place, const AgentTerms::Range& range) {
  if (json.is_array())
    return !json.empty() &&
           std::all_of(json.begin(), json.end(), [&](const auto& item) { return is_within(item, place, range); });
  if (place.empty()) {
    if (!json.is_number()) return false;  // also no text: what is one may as well be base64
    const auto number = json.get<double>();
    return std::isfinite(number) && number >= range.least && number <= range.most;
  }
  if (!json.is_object()) return false;
  const auto dot = place.find('.');
  const auto found = json.find(std::string(place.substr(0, dot)));
  return found != json.end() &&
         is_within(*found, dot == std::string_view::npos ? std::string_view() : place.substr(dot + 1), range);
}

}  // namespace

rr::Result<> AgentTerms::check(const rr::OrderedJson& values) const {
  for (const auto& [place, range] : limits)
    if (!is_within(values, place, range))
      return rr::make_error(rr::ErrorCode::out_of_range,
                            rr::quote(place) + " has to be a number from " + rr::Json(range.least).dump() + " to " +
                                rr::Json(range.most).dump() + ", as the gateway's rules say for agents");
  return {};
}

void AgentTerms::add(const AgentTerms& other) {
  for (const auto& [place, range] : other.limits) {
    const auto [known, is_new] = limits.emplace(place, range);
    if (is_new) continue;
    known->second.least = std::max(known->second.least, range.least);
    known->second.most = std::min(known->second.most, range.most);
  }
  needs_approval = needs_approval || other.needs_approval;
  needs_lease = needs_lease || other.needs_lease;
  hold = std::min(hold, other.hold);
}

}  // namespace rrgate
