#include "server/access/api_tokens.hpp"

#include <algorithm>

#include "core/support/hex.hpp"
#include "core/support/whole_number.hpp"
#include "core/support/words.hpp"
#include "node/tls/digest.hpp"
#include "server/access/access_text.hpp"
#include "server/access/base64url.hpp"

namespace rrgate {

namespace {

constexpr std::string_view prefix = "rrg_";
constexpr std::size_t token_bytes = 32;
constexpr std::size_t hash_digits = 64;

rr::Error unusable(std::string why) {
  return rr::make_error(rr::ErrorCode::invalid_configuration, std::move(why));
}

/// Exactly `size` digits.
std::optional<unsigned> number_of(std::string_view text, std::size_t size) {
  return text.size() == size ? rr::whole_number<unsigned>(text) : std::nullopt;
}

std::string padded(unsigned number, std::size_t digits) {
  auto out = std::to_string(number);
  return std::string(digits - std::min(digits, out.size()), '0') + out;
}

/// The clock counts nanoseconds, from 1677 to 2262: days may be earlier and later.
Identity::Time end_of(std::chrono::sys_days last_day) {
  const auto end = last_day + std::chrono::days(1);
  if (end > std::chrono::floor<std::chrono::days>(Identity::never)) return Identity::never;
  return std::max(end, std::chrono::ceil<std::chrono::days>(Identity::Time::min()));
}

}  // namespace

std::optional<std::chrono::sys_days> parse_day(std::string_view text) {
  if (text.size() != 10 || text[4] != '-' || text[7] != '-') return std::nullopt;
  const auto year = number_of(text.substr(0, 4), 4);
  const auto month = number_of(text.substr(5, 2), 2);
  const auto day = number_of(text.substr(8, 2), 2);
  if (!year || !month || !day) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(*year)), std::chrono::month(*month),
                                         std::chrono::day(*day)};
  return date.ok() ? std::optional(std::chrono::sys_days(date)) : std::nullopt;
}

std::string format_day(std::chrono::sys_days day) {
  const std::chrono::year_month_day date(day);
  return padded(static_cast<unsigned>(static_cast<int>(date.year())), 4) + "-" +
         padded(static_cast<unsigned>(date.month()), 2) + "-" + padded(static_cast<unsigned>(date.day()), 2);
}

std::string make_api_token() {
  return std::string(prefix) + encode_base64url(rr::random_bytes(token_bytes));
}

std::string hash_api_token(std::string_view token) {
  std::string out;
  for (const auto byte : rr::sha256(rr::as_bytes(token))) out += rr::hex_text(byte, 2);
  return out;
}

rr::Result<ApiTokens> ApiTokens::from_text(std::string_view text) {
  ApiTokens out;
  std::size_t number = 0;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    ++number;
    if (auto added = out.add_line(text.substr(0, end)); !added)
      return unusable("line " + std::to_string(number) + ": " + added.error().message);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

rr::Result<> ApiTokens::add_line(std::string_view line) {
  const auto fields = rr::split_words(line);
  if (fields.empty() || fields.front().front() == '#') return {};
  if (fields.size() != 4)
    return unusable("has " + std::to_string(fields.size()) + " fields, expected name, SHA-256, roles or _, day or _");
  if (auto checked = check_name("token name", fields[0]); !checked) return checked.error();
  if (fields[1].size() != hash_digits || fields[1].find_first_not_of(rr::lower_hex_digits) != std::string_view::npos)
    return unusable("the second field of " + rr::quote(fields[0]) + " is no SHA-256 in lower-case hex");
  auto roles = parse_roles(fields[2]);
  if (!roles) return roles.error();
  Entry entry{std::string(fields[0]), std::move(*roles), parse_day(fields[3])};
  if (!entry.last_day && fields[3] != "_")
    return unusable("found " + rr::quote(fields[3]) + ", expected a day as 2030-12-31, or _");
  by_hash_.emplace(fields[1], std::move(entry));
  return {};
}

rr::Result<Identity> ApiTokens::verify(std::string_view token, std::chrono::system_clock::time_point now) const {
  const auto hash = hash_api_token(token);
  if (!by_hash_.contains(hash)) return rr::make_error(rr::ErrorCode::authentication_error, "token refused: unknown");
  auto found = find(hash, now);
  if (!found) return rr::make_error(rr::ErrorCode::authentication_error, "token refused: it has expired");
  return std::move(*found);
}

std::optional<Identity> ApiTokens::find(std::string_view credential, std::chrono::system_clock::time_point now) const {
  const auto found = by_hash_.find(credential);
  if (found == by_hash_.end()) return std::nullopt;
  const auto& entry = found->second;
  Identity out;
  out.name = entry.name;
  out.roles = out.proven_roles = entry.roles;
  out.proof = Proof::token;
  out.credential = credential;
  if (entry.last_day) out.ends = end_of(*entry.last_day);
  if (now >= out.ends) return std::nullopt;
  return out;
}

}  // namespace rrgate
