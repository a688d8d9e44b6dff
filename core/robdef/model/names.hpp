// Characters, words and names of the definition language. Layer: robdef. Source: service definitions spec section 5.1.
#pragma once

#include <string>
#include <string_view>

#include "core/wire/message.hpp"

namespace rr {

/// No definition in use comes near these; without them a small text becomes gigabytes, or takes minutes.
inline constexpr std::size_t longest_qualified_name = 255;
inline constexpr std::size_t max_dimensions = 64;
inline constexpr std::size_t max_parameters = 1024;  ///< of a member
inline constexpr std::size_t max_members = 8192;     ///< of a type
inline constexpr std::size_t max_imports = 1024;     ///< and as many usings

constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t';
}
constexpr bool is_letter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}
constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
constexpr bool is_word_character(char c) {
  return is_letter(c) || is_digit(c) || c == '_';
}
constexpr bool is_hex_digit(char c) {
  return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}
/// U+0020..U+007E and TAB: all that a line may hold.
constexpr bool is_text_character(char c) {
  return (c >= ' ' && c <= '~') || c == '\t';
}

std::string to_lower(std::string_view text);

/// A letter, then letters, digits and underscores, the last one not an underscore.
bool is_name(std::string_view text);
/// Names joined by dots.
bool is_qualified_name(std::string_view text);
/// Reserved words and reserved prefixes ("get_", "rr", ...; in any case).
bool is_reserved_name(std::string_view name);

struct QualifiedName {
  std::string_view service;  ///< empty where the name is unqualified
  std::string_view name;
};
/// Splits at the last dot.
QualifiedName split_qualified(std::string_view name);

/// Words that begin a statement outside of every block and mean nothing inside one.
bool is_top_level_keyword(std::string_view word);
/// All words that can begin a statement, `end` included.
bool is_statement_keyword(std::string_view word);

/// The type of a built-in type word ("double", "varobject", "void", ...); namedtype_t for every other word.
DataType builtin_type(std::string_view word);
std::string_view builtin_type_word(DataType type);

}  // namespace rr
