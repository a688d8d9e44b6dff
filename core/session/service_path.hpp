// Service paths: "service.member[index].member". Layer: session. Source: sessions spec section 2.5.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/error.hpp"

namespace rr {

struct PathSegment {
  std::string name;
  std::optional<std::string> index = {};  ///< decoded: the number's text, or the string key
  bool operator==(const PathSegment&) const = default;
};

inline constexpr std::size_t max_path_size = 2048;

/// Splits and decodes a path. Paths are opaque for identity: two spellings of one index are two paths. They are few:
/// an index is spelled as one of the known peers does it, "%ffffffc3" included.
/// Errors   service_error "Invalid service path specified", also above max_path_size.
Result<std::vector<PathSegment>> parse_service_path(std::string_view path);

/// Every byte that is not an ASCII letter or digit becomes %xx.
std::string encode_path_index(std::string_view index);

/// `parent.member` or `parent.member[index]`.
std::string child_path(std::string_view parent, std::string_view member,
                       std::optional<std::string_view> index = std::nullopt);

/// The one spelling of a valid path by which locks know its object; of others, themselves.
std::string canonical_path(std::string_view path);

/// As much of `path` as has `count` segments, or all of it.
std::string_view first_segments(std::string_view path, std::size_t count);

/// Whether `path` is `ancestor` or lies below it.
bool is_within(std::string_view path, std::string_view ancestor);

/// A member of an object, as a key of ordered maps; look-ups by PathMemberView allocate nothing.
struct PathMember {
  std::string path;
  std::string member;
};
struct PathMemberView {
  std::string_view path;
  std::string_view member;
};
struct PathMemberLess {
  using is_transparent = void;
  template <class Left, class Right>
  bool operator()(const Left& left, const Right& right) const {
    if (const int order = std::string_view(left.path).compare(right.path); order != 0) return order < 0;
    return std::string_view(left.member) < std::string_view(right.member);
  }
};

}  // namespace rr
