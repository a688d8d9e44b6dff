#include "server/mcp/mcp_summary.hpp"

#include <algorithm>

namespace rrgate {

namespace {

constexpr std::size_t most_places = 100;
constexpr std::size_t most_items = 16;

}  // namespace

void McpSummary::add(const rr::OrderedJson& value) {
  add(value, "");
}

void McpSummary::add(const rr::OrderedJson& value, const std::string& place) {
  const auto below = [&](const std::string& name) { return place.empty() ? name : place + "." + name; };
  if (value.is_number()) {
    const auto number = value.get<double>();
    auto found = places_.find(place);
    if (found == places_.end()) {
      if (places_.size() >= most_places) return;
      found = places_.emplace(place, Numbers{number, number, 0, 0}).first;
    }
    auto& numbers = found->second;
    numbers.min = std::min(numbers.min, number);
    numbers.max = std::max(numbers.max, number);
    numbers.sum += number;
    ++numbers.count;
  } else if (value.is_object()) {
    for (const auto& [name, item] : value.items()) add(item, below(name));
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < std::min(value.size(), most_items); ++i) add(value[i], below(std::to_string(i)));
  }
}

rr::OrderedJson McpSummary::to_json() const {
  auto out = rr::OrderedJson::object();
  for (const auto& [place, numbers] : places_) {
    auto& told = rr::add_key(out, place) = rr::OrderedJson::object();
    rr::add_key(told, "min") = numbers.min;
    rr::add_key(told, "max") = numbers.max;
    rr::add_key(told, "mean") = numbers.sum / static_cast<double>(numbers.count);
  }
  return out;
}

}  // namespace rrgate
