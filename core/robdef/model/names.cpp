#include "core/robdef/model/names.hpp"

#include <algorithm>
#include <array>

namespace rr {

namespace {

constexpr auto reserved_words = std::to_array<std::string_view>({
    "object",   "end",      "option",    "service",   "struct",   "import",   "implements", "field",  "property",
    "function", "event",    "objref",    "pipe",      "callback", "wire",     "memory",     "void",   "int8",
    "uint8",    "int16",    "uint16",    "int32",     "uint32",   "int64",    "uint64",     "single", "double",
    "string",   "varvalue", "varobject", "exception", "using",    "constant", "enum",       "pod",    "namedarray",
    "cdouble",  "csingle",  "bool",      "stdver",    "this",     "self",     "Me",
});

constexpr auto reserved_prefixes = std::to_array<std::string_view>({"get_", "set_", "async_", "rr", "robotraconteur"});

constexpr auto top_level_keywords = std::to_array<std::string_view>(
    {"service", "stdver", "import", "using", "exception", "enum", "struct", "pod", "namedarray", "object"});

constexpr auto body_keywords =
    std::to_array<std::string_view>({"option", "constant", "implements", "field", "property", "function", "event",
                                     "objref", "pipe", "callback", "wire", "memory", "end"});

struct TypeWord {
  std::string_view word;
  DataType type;
};

constexpr auto type_words = std::to_array<TypeWord>({
    {"void", DataType::void_t},
    {"double", DataType::double_t},
    {"single", DataType::single_t},
    {"int8", DataType::int8_t},
    {"uint8", DataType::uint8_t},
    {"int16", DataType::int16_t},
    {"uint16", DataType::uint16_t},
    {"int32", DataType::int32_t},
    {"uint32", DataType::uint32_t},
    {"int64", DataType::int64_t},
    {"uint64", DataType::uint64_t},
    {"string", DataType::string_t},
    {"cdouble", DataType::cdouble_t},
    {"csingle", DataType::csingle_t},
    {"bool", DataType::bool_t},
    {"object", DataType::object_t},
    {"varobject", DataType::varobject_t},
    {"varvalue", DataType::varvalue_t},
});

template <class List>
bool contains(const List& list, std::string_view word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

}  // namespace

std::string to_lower(std::string_view text) {
  std::string lower(text);
  for (auto& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

bool is_name(std::string_view text) {
  return !text.empty() && is_letter(text.front()) && text.back() != '_' &&
         std::all_of(text.begin(), text.end(), is_word_character);
}

bool is_qualified_name(std::string_view text) {
  if (text.size() > longest_qualified_name) return false;
  while (true) {
    const auto dot = text.find('.');
    if (!is_name(text.substr(0, dot))) return false;
    if (dot == std::string_view::npos) return true;
    text.remove_prefix(dot + 1);
  }
}

bool is_reserved_name(std::string_view name) {
  if (contains(reserved_words, name)) return true;
  const auto start = to_lower(name.substr(0, 16));
  return std::any_of(reserved_prefixes.begin(), reserved_prefixes.end(),
                     [&start](std::string_view prefix) { return start.starts_with(prefix); });
}

QualifiedName split_qualified(std::string_view name) {
  const auto dot = name.rfind('.');
  if (dot == std::string_view::npos) return {{}, name};
  return {name.substr(0, dot), name.substr(dot + 1)};
}

bool is_top_level_keyword(std::string_view word) {
  return contains(top_level_keywords, word);
}

bool is_statement_keyword(std::string_view word) {
  return is_top_level_keyword(word) || contains(body_keywords, word);
}

DataType builtin_type(std::string_view word) {
  const auto found =
      std::find_if(type_words.begin(), type_words.end(), [word](const TypeWord& item) { return item.word == word; });
  return found == type_words.end() ? DataType::namedtype_t : found->type;
}

std::string_view builtin_type_word(DataType type) {
  const auto found =
      std::find_if(type_words.begin(), type_words.end(), [type](const TypeWord& item) { return item.type == type; });
  return found == type_words.end() ? std::string_view("structure") : found->word;
}

}  // namespace rr
