#include "core/support/node_id.hpp"

#include "core/support/hex.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

bool is_ascii_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
bool is_ascii_digit(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace

std::string format_node_id(const NodeId& id, NodeIdFormat format) {
  std::string out;
  out.reserve(38);
  if (format == NodeIdFormat::braces) out += '{';
  for (std::size_t i = 0; i < id.bytes.size(); ++i) {
    if (format != NodeIdFormat::plain && (i == 4 || i == 6 || i == 8 || i == 10)) out += '-';
    out += lower_hex_digits[id.bytes[i] >> 4];
    out += lower_hex_digits[id.bytes[i] & 15];
  }
  if (format == NodeIdFormat::braces) out += '}';
  return out;
}

Result<NodeId> parse_node_id(std::string_view text) {
  const auto fail = [text] {
    return make_error(ErrorCode::invalid_argument,
                      "NodeID " + quote(text) + ": expected 32 hex digits as 8-4-4-4-12, with or without braces");
  };
  if (trim(text) == "{0}") return NodeId{};
  std::string_view rest = text;
  const bool opens = !rest.empty() && rest.front() == '{';
  const bool closes = !rest.empty() && rest.back() == '}';
  if (opens != closes) return fail();
  if (opens) rest = rest.substr(1, rest.size() - 2);
  NodeId id;
  for (std::size_t i = 0; i < id.bytes.size(); ++i) {
    if ((i == 4 || i == 6 || i == 8 || i == 10) && !rest.empty() && rest.front() == '-') rest.remove_prefix(1);
    if (rest.size() < 2) return fail();
    const int high = hex_value(rest[0]);
    const int low = hex_value(rest[1]);
    if (high < 0 || low < 0) return fail();
    id.bytes[i] = static_cast<std::uint8_t>(high << 4 | low);
    rest.remove_prefix(2);
  }
  if (!rest.empty()) return fail();
  return id;
}

bool is_valid_node_name(std::string_view name) {
  if (name.empty() || name.size() > 1024 || !is_ascii_letter(name.front())) return false;
  for (const char c : name)
    if (!is_ascii_letter(c) && !is_ascii_digit(c) && c != '_' && c != '.' && c != '-') return false;
  return true;
}

}  // namespace rr
