#include "core/types/field_path.hpp"

#include <algorithm>
#include <vector>

namespace rr {

namespace {

/// Names of definitions are word characters; the key of a received element may be anything.
bool is_word(std::string_view name) {
  return std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

std::string path_text(const FieldPath& path) {
  constexpr std::size_t longest = 240;  // bytes; a hostile value nests 128 levels of long keys
  std::vector<const FieldPath*> steps;
  for (const auto* step = &path; step; step = step->parent) steps.push_back(step);
  std::string text;
  for (auto at = steps.rbegin(); at != steps.rend(); ++at) {
    const auto& step = **at;
    switch (step.step) {
      case FieldPath::Step::field:
        if (!text.empty()) text += '.';
        text += is_word(step.name) ? std::string(step.name) : quote(step.name, 40);
        break;
      case FieldPath::Step::index:
        text += '[' + std::to_string(step.number) + ']';
        break;
      case FieldPath::Step::key:
        text += '[' + quote(step.name, 40) + ']';
        break;
    }
  }
  if (text.size() > longest) text = text.substr(0, longest / 2) + " ... " + text.substr(text.size() - longest / 2);
  return text;
}

Error value_error(ErrorCode code, std::string_view verb, const FieldPath& path, std::string_view text) {
  std::string_view type_name;
  for (const auto* step = &path; step && type_name.empty(); step = step->parent) type_name = step->type_name;
  std::string message(verb);
  message += " '" + path_text(path) + "'";
  if (!type_name.empty()) message += " (" + std::string(type_name) + ")";
  message += ": ";
  message += text;
  return make_error(code, std::move(message));
}

}  // namespace rr
