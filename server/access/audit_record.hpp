// One record of the audit log: its text, and the chain that joins it to the one before. Layer: server/access.
//
// A record is a line: {"seq":17,...,"hash":"<64 hex digits>"}. Its hash is the SHA-256 of the previous record's hash
// (as digits) and of this record's text without its hash, {"seq":17,...}. The first record of a file or of a start also
// says the hash before it, as "prev".
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/support/error.hpp"
#include "server/access/access_rules.hpp"

namespace rrgate {

enum class Outcome : std::uint8_t { ok, error, refused };
std::string_view to_string(Outcome outcome);

/// What a record tells. Borrowed for the call.
struct AuditEvent {
  std::string_view event = {};  ///< "write", "call", "lock", "login", "login_failed", "refused", ...
  const Identity* who = nullptr;
  const AccessRequest* what = nullptr;  ///< null: nothing in particular
  std::string_view detail = {};         ///< why, in words; empty: no more to say
  Outcome outcome = Outcome::ok;
  std::string_view trace = {};  ///< W3C trace id; empty: none
};

/// "2030-01-31T12:00:00.123Z".
std::string format_audit_time(std::chrono::system_clock::time_point now);
/// The members of a record, without its place in the chain: "\"time\":...,\"event\":...".
std::string format_audit_event(const AuditEvent& event, std::chrono::system_clock::time_point now);

/// Where a chain has got to.
struct AuditChain {
  std::uint64_t seq = 0;  ///< of the last record; 0: there is none
  std::string hash = std::string(64, '0');

  /// Adds a record. Returns its line, with the '\n'. `members`  see format_audit_event().
  std::string add(std::string_view members, bool names_previous);
  bool operator==(const AuditChain&) const = default;
};

/// A line as it was read.
struct AuditLine {
  std::uint64_t seq = 0;
  std::string hash;                          ///< that it claims
  std::optional<std::string> previous = {};  ///< hash that it claims the record before has
  std::string_view text;                     ///< what is hashed, without the closing '}'
};
/// `line`  borrowed, without '\n'. nullopt: no record.
std::optional<AuditLine> parse_audit_line(std::string_view line);
/// The hash that a record has behind one of the hash `previous`.
std::string hash_audit_line(std::string_view previous, const AuditLine& line);

}  // namespace rrgate
