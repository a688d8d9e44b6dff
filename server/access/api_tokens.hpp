// API tokens: long random passwords for programs, of which a file keeps the hash alone. Layer: server/access.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/support/error.hpp"
#include "server/access/identity.hpp"

namespace rrgate {

/// One token a line, fields separated by blanks; empty lines and those that begin with '#' are skipped:
///
///   name  SHA-256 of the token in hex  role,role|_  YYYY-MM-DD|_
///
/// The date is the last day on which it is good (UTC), `_` for no end.
class ApiTokens {
 public:
  /// Errors   invalid_configuration: names the line, never what stands in its hash.
  static rr::Result<ApiTokens> from_text(std::string_view text);

  /// Errors   authentication_error: unknown, or no longer good.
  rr::Result<Identity> verify(std::string_view token, std::chrono::system_clock::time_point now) const;
  /// By the identity's credential. nullopt: as above.
  std::optional<Identity> find(std::string_view credential, std::chrono::system_clock::time_point now) const;
  std::size_t size() const { return by_hash_.size(); }

  struct Entry {
    std::string name;
    std::vector<std::string> roles;
    std::optional<std::chrono::sys_days> last_day;

    bool operator==(const Entry&) const = default;
  };
  using Entries = std::map<std::string, Entry, std::less<>>;
  const Entries& by_hash() const { return by_hash_; }

 private:
  rr::Result<> add_line(std::string_view line);

  Entries by_hash_;
};

/// A new one: "rrg_" and 256 random bits.
std::string make_api_token();
/// SHA-256 in hex, as the file has it.
std::string hash_api_token(std::string_view token);
/// nullopt: not YYYY-MM-DD, or no such day.
std::optional<std::chrono::sys_days> parse_day(std::string_view text);
std::string format_day(std::chrono::sys_days day);

}  // namespace rrgate
