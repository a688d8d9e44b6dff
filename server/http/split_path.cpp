#include "server/http/split_path.hpp"

#include "core/session/url.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_segments = 64;

}  // namespace

rr::Result<std::vector<std::string>> split_path(std::string_view path) {
  std::vector<std::string> out;
  while (!path.empty()) {
    const auto slash = path.find('/');
    auto segment = rr::percent_decode(path.substr(0, slash));
    if (!segment) return segment.error();
    out.push_back(std::move(*segment));
    if (out.size() > max_segments) return rr::make_error(rr::ErrorCode::object_not_found, "the path is too long");
    path = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
  }
  return out;
}

}  // namespace rrgate
