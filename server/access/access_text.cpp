#include "server/access/access_text.hpp"

#include <algorithm>

#include "core/support/words.hpp"

namespace rrgate {

namespace {

template <class Call>
void for_each_line(std::string_view file, Call call) {
  while (!file.empty()) {
    const auto end = std::min(file.find('\n'), file.size());
    call(file.substr(0, end));
    file.remove_prefix(std::min(end + 1, file.size()));
  }
}

bool is_line_of(std::string_view line, std::string_view name) {
  const auto words = rr::split_words(line);
  return !words.empty() && words.front() == name;
}

}  // namespace

rr::Result<> check_name(std::string_view what, std::string_view name) {
  const auto is_bad = [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == 0x7f || c == ',' || c == ':'; };
  if (name.empty() || name.size() > 128 || name.front() == '#' || name.front() == '_' ||
      std::any_of(name.begin(), name.end(), is_bad))
    return rr::make_error(rr::ErrorCode::invalid_argument,
                          "found " + rr::quote(name) + ", expected a " + std::string(what) +
                              " of 1 to 128 characters without blanks, ',' and ':', no '#' or '_' in front");
  return {};
}

rr::Result<std::vector<std::string>> parse_roles(std::string_view text) {
  std::vector<std::string> out;
  if (text == "_") return out;
  for (const auto role : rr::split_words(text, ",")) {
    if (auto checked = check_name("role", role); !checked) return checked.error();
    out.emplace_back(role);
  }
  return out;
}

std::string format_roles(const std::vector<std::string>& roles) {
  std::string out;
  for (const auto& role : roles) out += (out.empty() ? "" : ",") + role;
  return out.empty() ? "_" : out;
}

std::string_view find_line(std::string_view file, std::string_view name) {
  std::string_view found;
  for_each_line(file, [&](std::string_view line) {
    if (found.empty() && is_line_of(line, name)) found = line;
  });
  return found;
}

std::string with_line(std::string_view file, std::string_view name, std::string_view line) {
  std::string out;
  bool is_there = line.empty();
  const auto add = [&out](std::string_view text) { out.append(text).append("\n"); };
  for_each_line(file, [&](std::string_view old) {
    if (!is_line_of(old, name)) {
      add(old);
    } else if (!is_there) {
      add(line);
      is_there = true;
    }
  });
  if (!is_there) add(line);
  return out;
}

}  // namespace rrgate
