#include "core/session/service_path.hpp"

#include "core/robdef/model/names.hpp"
#include "core/support/hex.hpp"

namespace rr {

namespace {

bool is_alnum(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// How one peer spells indexes; what it does once it always does.
class Spelling {
 public:
  bool has_capitals(bool now) { return agrees(capitals_, now); }          ///< %C3, not %c3
  bool has_capital_dots(bool now) { return agrees(dot_capitals_, now); }  ///< %2E; RobotRaconteurWeb has %C3 and %2e
  bool leaves_marks(bool now) { return agrees(marks_, now); }             ///< '-', '_' and '~' as they are
  bool extends_sign(bool now) { return agrees(sign_, now); }              ///< %ffffffc3, not %c3

 private:
  static bool agrees(std::optional<bool>& known, bool now) {
    if (!known) known = now;
    return *known == now;
  }

  std::optional<bool> capitals_;
  std::optional<bool> dot_capitals_;
  std::optional<bool> marks_;
  std::optional<bool> sign_;
};

bool is_mark(char c) {
  return c == '-' || c == '_' || c == '~';
}

std::optional<std::string> decode_index(std::string_view text) {
  if (text.empty()) return std::nullopt;
  std::string out;
  Spelling spelling;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_alnum(c) || (is_mark(c) && spelling.leaves_marks(true))) {
      out += c;
      continue;
    }
    if (c != '%') return std::nullopt;
    // 1.2.8 writes a byte above 0x7f sign-extended, "%ffffffc3"; 0xff itself never occurs in UTF-8.
    const auto rest = text.substr(i + 1);
    const bool is_sign_extended =
        rest.substr(0, 6) == "ffffff" && hex_byte(rest.substr(6 > rest.size() ? rest.size() : 6)) >= 0x80;
    const auto digits = is_sign_extended ? rest.substr(6, 2) : rest.substr(0, 2);
    const int byte = hex_byte(digits);
    if (byte < 0) return std::nullopt;
    const char decoded = static_cast<char>(byte);
    if (is_alnum(decoded) || (is_mark(decoded) && !spelling.leaves_marks(false))) return std::nullopt;
    if (byte >= 0x80 && !spelling.extends_sign(is_sign_extended)) return std::nullopt;
    for (const char digit : digits) {
      if (digit <= '9') continue;
      const bool is_capital = digit < 'a';
      if (!(decoded == '.' ? spelling.has_capital_dots(is_capital) : spelling.has_capitals(is_capital)))
        return std::nullopt;
    }
    out += decoded;
    i += is_sign_extended ? 8 : 2;
  }
  return out;
}

}  // namespace

Result<std::vector<PathSegment>> parse_service_path(std::string_view path) {
  const auto fail = [path] {
    return make_error(ErrorCode::service_error, "Invalid service path specified: " + quote(path));
  };
  if (path.size() > max_path_size) return fail();
  std::vector<PathSegment> segments;
  while (true) {
    // An index never holds a bare dot: it would be %2e.
    const auto dot = path.find('.');
    auto part = path.substr(0, dot);
    PathSegment segment;
    if (const auto bracket = part.find('['); bracket != std::string_view::npos) {
      if (part.back() != ']' || segments.empty()) return fail();
      segment.index = decode_index(part.substr(bracket + 1, part.size() - bracket - 2));
      if (!segment.index) return fail();
      part = part.substr(0, bracket);
    }
    if (!is_name(part)) return fail();
    segment.name = part;
    segments.push_back(std::move(segment));
    if (dot == std::string_view::npos) return segments;
    path.remove_prefix(dot + 1);
  }
}

std::string encode_path_index(std::string_view index) {
  return escape_bytes(index, lower_hex_digits, is_alnum);
}

std::string child_path(std::string_view parent, std::string_view member, std::optional<std::string_view> index) {
  std::string path(parent);
  path += '.';
  path += member;
  if (index) path += '[' + encode_path_index(*index) + ']';
  return path;
}

std::string canonical_path(std::string_view path) {
  const auto segments = parse_service_path(path);
  if (!segments) return std::string(path);
  std::string canonical = segments->front().name;
  for (std::size_t i = 1; i < segments->size(); ++i)
    canonical = child_path(canonical, (*segments)[i].name, (*segments)[i].index);
  return canonical;
}

std::string_view first_segments(std::string_view path, std::size_t count) {
  std::size_t end = 0;
  for (; count > 0 && end != std::string_view::npos; --count) end = path.find('.', end == 0 ? 0 : end + 1);
  return path.substr(0, end);
}

bool is_within(std::string_view path, std::string_view ancestor) {
  return path.substr(0, ancestor.size()) == ancestor &&
         (path.size() == ancestor.size() || path[ancestor.size()] == '.');
}

}  // namespace rr
