#include "core/session/known_definitions.hpp"

#include "core/support/hex.hpp"
#include "core/support/sha256.hpp"

namespace rr {

std::string make_definitions_tag(const std::vector<std::string_view>& texts) {
  std::string content;
  for (const auto text : texts) content.append(std::to_string(text.size())).append(":").append(text);
  const auto hash = sha256(as_bytes(content));
  std::string tag;
  for (std::size_t i = 0; i < hash.size() / 2; ++i) tag += hex_text(hash[i], 2);
  return tag;
}

}  // namespace rr
