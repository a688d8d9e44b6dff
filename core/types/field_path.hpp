// Where in a value an error lies: "pose.items[3].q". Layer: types.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/support/error.hpp"

namespace rr {

/// One step of the way to a nested value; lives on the stack of the code that walks there, so that a path costs
/// nothing until an error names it. Also the element's key: a name, or a number.
struct FieldPath {
  enum class Step : std::uint8_t { field, index, key };

  const FieldPath* parent = nullptr;
  Step step = Step::field;
  std::int32_t number = 0;          ///< index: list position, pod position or int32 key
  std::string_view name = {};       ///< field: its name; key: the string key
  std::string_view type_name = {};  ///< field: the qualified type that declares it

  FieldPath field(std::string_view field_name, std::string_view declared_in) const {
    return {this, Step::field, 0, field_name, declared_in};
  }
  FieldPath index(std::int32_t position) const { return {this, Step::index, position, {}, {}}; }
  FieldPath key(std::string_view text) const { return {this, Step::key, 0, text, {}}; }
  bool is_numbered() const { return step == Step::index; }
};

/// "pose.items[3]['k'].q"; a long path is cut in the middle.
std::string path_text(const FieldPath& path);

/// "<verb> '<path>' (<innermost named type>): <text>".
Error value_error(ErrorCode code, std::string_view verb, const FieldPath& path, std::string_view text);

}  // namespace rr
