#include "core/session/service_path.hpp"

#include "core/robdef/model/names.hpp"
#include "core/support/hex.hpp"

namespace rr {

namespace {

bool is_alnum(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

std::optional<std::string> decode_index(std::string_view text) {
  if (text.empty()) return std::nullopt;
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_alnum(c) || c == '-' || c == '_' || c == '~') {
      out += c;
      continue;
    }
    if (c != '%') return std::nullopt;
    // 1.2.8 writes a byte above 0x7f sign-extended, "%ffffffc3"; 0xff itself never occurs in UTF-8.
    const auto rest = text.substr(i + 1);
    const bool is_sign_extended =
        rest.substr(0, 6) == "ffffff" && hex_byte(rest.substr(6 > rest.size() ? rest.size() : 6)) >= 0x80;
    const int byte = is_sign_extended ? hex_byte(rest.substr(6)) : hex_byte(rest);
    if (byte < 0) return std::nullopt;
    out += static_cast<char>(byte);
    i += is_sign_extended ? 8 : 2;
  }
  return out;
}

}  // namespace

Result<std::vector<PathSegment>> parse_service_path(std::string_view path) {
  const auto fail = [path] {
    return make_error(ErrorCode::service_error, "Invalid service path specified: " + quote(path));
  };
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

bool is_within(std::string_view path, std::string_view ancestor) {
  return path.substr(0, ancestor.size()) == ancestor &&
         (path.size() == ancestor.size() || path[ancestor.size()] == '.');
}

}  // namespace rr
