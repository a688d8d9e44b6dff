#include "server/access/audit_record.hpp"

#include <algorithm>
#include <charconv>

#include "core/support/hex.hpp"
#include "core/support/utf8.hpp"
#include "node/platform/utc_time.hpp"
#include "node/tls/digest.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

constexpr std::size_t longest_text = 500;  // of what strangers choose
constexpr std::size_t hash_digits = 64;
constexpr std::string_view seq_begins = "{\"seq\":";
constexpr std::string_view previous_begins = ",\"prev\":\"";
constexpr std::string_view hash_begins = ",\"hash\":\"";

/// Of the text in two parts, and the '}' that closes it.
std::string hash_of(std::string_view previous, std::string_view text) {
  std::string all(previous);
  all.append(text).append("}");
  return rr::hex_text(rr::sha256(rr::as_bytes(all)));
}

bool is_hash(std::string_view text) {
  return text.size() == hash_digits &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

}  // namespace

std::string_view to_string(Outcome outcome) {
  constexpr std::string_view names[] = {"ok", "error", "refused"};
  return names[static_cast<std::size_t>(outcome)];
}

std::string format_audit_time(std::chrono::system_clock::time_point now) {
  return rr::format_utc(rr::to_time_spec(now), 3);
}

std::string format_audit_event(const AuditEvent& event, std::chrono::system_clock::time_point now) {
  auto out = rr::OrderedJson::object();
  const auto add = [&out](std::string_view key, std::string_view text) {
    if (!text.empty()) rr::add_key(out, key) = std::string(rr::utf8_prefix(text, longest_text));
  };
  add("time", format_audit_time(now));
  add("event", event.event);
  add("outcome", to_string(event.outcome));
  if (event.who) {
    add("face", to_string(event.who->face));
    add("user", event.who->name);
    if (!event.who->roles.empty()) rr::add_key(out, "roles") = event.who->roles;
    add("proof", to_string(event.who->proof));
    add("client", event.who->client);
    add("device_user", event.who->device_user);
  }
  if (event.what) {
    add("verb", to_string(event.what->verb));
    add("device", event.what->device);
    add("service", event.what->service);
    add("path", event.what->path);
    add("member", event.what->member);
  }
  add("trace", event.trace);
  add("detail", event.detail);
  const auto text = rr::write_json(out);
  return text.substr(1, text.size() - 2);
}

std::string AuditChain::add(std::string_view members, bool names_previous) {
  std::string line(seq_begins);
  line += std::to_string(++seq);
  if (names_previous) line.append(previous_begins).append(hash).append("\"");
  line.append(",").append(members);
  hash = hash_of(hash, line);
  return line.append(hash_begins).append(hash).append("\"}\n");
}

std::optional<AuditLine> parse_audit_line(std::string_view line) {
  constexpr auto tail = hash_begins.size() + hash_digits + 2;
  if (line.size() < seq_begins.size() + tail || !line.starts_with(seq_begins) || !line.ends_with("\"}"))
    return std::nullopt;
  AuditLine out;
  out.text = line.substr(0, line.size() - tail);
  const auto end = line.substr(out.text.size());
  out.hash = end.substr(hash_begins.size(), hash_digits);
  if (!end.starts_with(hash_begins) || !is_hash(out.hash)) return std::nullopt;
  const auto read = std::from_chars(line.data() + seq_begins.size(), line.data() + out.text.size(), out.seq);
  if (read.ec != std::errc() || out.seq == 0) return std::nullopt;
  auto rest = out.text.substr(static_cast<std::size_t>(read.ptr - line.data()));
  if (rest.starts_with(previous_begins)) {
    const auto previous = rest.substr(previous_begins.size(), hash_digits);
    if (!is_hash(previous)) return std::nullopt;
    out.previous = previous;
  }
  return out;
}

std::string hash_audit_line(std::string_view previous, const AuditLine& line) {
  return hash_of(previous, line.text);
}

}  // namespace rrgate
