#include "server/upstream/lock_path.hpp"

#include <algorithm>
#include <optional>

#include "core/session/service_path.hpp"

namespace rrgate {

namespace {

/// "01" and "+1" may name the same object as "1". A string key that is such a text is taken for another one, which
/// keeps out too many, not too few.
std::string canonical_index(std::string_view index) {
  const bool has_sign = !index.empty() && (index.front() == '+' || index.front() == '-');
  auto digits = index.substr(has_sign ? 1 : 0);
  const auto is_digit = [](char each) { return each >= '0' && each <= '9'; };
  if (digits.empty() || !std::all_of(digits.begin(), digits.end(), is_digit)) return std::string(index);
  while (digits.size() > 1 && digits.front() == '0') digits.remove_prefix(1);
  return (index.front() == '-' && digits != "0" ? "-" : "") + std::string(digits);
}

}  // namespace

std::string canonical_lock_path(std::string_view path) {
  const auto segments = rr::parse_service_path(path);
  if (!segments) return std::string(path);
  std::string canonical;
  for (const auto& [name, index] : *segments) {
    std::optional<std::string> text;
    if (index) text = canonical_index(*index);
    canonical = canonical.empty() ? name : rr::child_path(canonical, name, text);
  }
  return canonical;
}

}  // namespace rrgate
