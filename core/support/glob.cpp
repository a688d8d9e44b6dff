#include "core/support/glob.hpp"

namespace rr {

bool glob_matches(std::string_view pattern, std::string_view text) {
  std::size_t at = 0;
  std::size_t in = 0;
  auto star = std::string_view::npos;  // the last '*', and how far the text goes on behind it
  std::size_t resume = 0;
  while (in < text.size()) {
    if (at < pattern.size() && pattern[at] == '*') {
      star = at++;
      resume = in;
    } else if (at < pattern.size() && (pattern[at] == '?' || pattern[at] == text[in])) {
      ++at;
      ++in;
    } else if (star != std::string_view::npos) {
      at = star + 1;
      in = ++resume;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', at) == std::string_view::npos;
}

bool glob_leads_on(std::string_view pattern, std::string_view beginning) {
  for (std::size_t size = 0; size <= pattern.size(); ++size)
    if (glob_matches(pattern.substr(0, size), beginning)) return true;
  return false;
}

}  // namespace rr
