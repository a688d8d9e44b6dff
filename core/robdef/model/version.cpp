// Versions: numbers compared one by one, printed without trailing zeros. Layer: robdef. Source: service definitions
// spec section 5.2.
#include <limits>

#include "core/robdef/model/names.hpp"
#include "core/robdef/model/service_definition.hpp"

namespace rr {

namespace {

Error version_error(std::string_view text) {
  return make_error(ErrorCode::service_definition_error,
                    "version: found " + quote(text) + ", expected two to four numbers joined by dots, such as 0.10");
}

}  // namespace

Result<Version> parse_version(std::string_view text) {
  std::uint32_t parts[4] = {0, 0, 0, 0};
  std::size_t count = 0;
  std::size_t position = 0;
  while (count < 4) {
    const auto start = position;
    std::uint64_t value = 0;
    for (; position < text.size() && is_digit(text[position]); ++position) {
      value = value * 10 + static_cast<std::uint64_t>(text[position] - '0');
      if (value > std::numeric_limits<std::uint32_t>::max()) return version_error(text);
    }
    if (position == start) return version_error(text);
    parts[count++] = static_cast<std::uint32_t>(value);
    if (position == text.size()) break;
    if (text[position] != '.') return version_error(text);
    ++position;
  }
  if (position != text.size() || count < 2 || text.back() == '.') return version_error(text);
  return Version{parts[0], parts[1], parts[2], parts[3]};
}

std::string format_version(const Version& version) {
  std::string out = std::to_string(version.major) + '.' + std::to_string(version.minor);
  if (version.patch != 0 || version.tweak != 0) out += '.' + std::to_string(version.patch);
  if (version.tweak != 0) out += '.' + std::to_string(version.tweak);
  return out;
}

}  // namespace rr
