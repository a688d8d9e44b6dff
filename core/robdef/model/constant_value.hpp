// The values of constants: from their source text, typed. Layer: robdef.
// Source: service definitions spec section 5.5.2.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/robdef/model/diagnostic.hpp"
#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// A field of a struct constant: refers to the constant `constant` of the same scope.
struct ConstantField {
  std::string name;
  std::string constant;
  bool operator==(const ConstantField&) const = default;
};

struct ConstantValue {
  /// Numbers: one for a scalar, else the elements of the array. `single` values are exact in double.
  /// Strings: UTF-8, may hold NUL.
  std::variant<std::vector<std::int64_t>, std::vector<std::uint64_t>, std::vector<double>, std::string,
               std::vector<ConstantField>>
      data;
  bool is_array = false;

  bool operator==(const ConstantValue&) const = default;
};

/// `text`   the value as in ConstantDefinition::value_text.
/// Errors   ErrorCode::service_definition_error with what was found and expected. compat wraps negative unsigned
///          numbers, drops unpaired surrogates and does not count array elements, as the reference does.
Result<ConstantValue> parse_constant_value(const TypeDefinition& type, std::string_view text, RobdefMode mode);

/// What is wrong with a value, and where in its text.
struct ConstantIssue {
  bool is_relaxed = false;  ///< compat lets it through
  std::string code = {};
  std::string message = {};
  std::size_t from = 0;
  std::size_t to = 0;
};

/// For the parser: the value and every finding. The value is usable where no issue is fatal in the caller's mode.
ConstantValue read_constant_value(const TypeDefinition& type, std::string_view text,
                                  std::vector<ConstantIssue>& issues);

}  // namespace rr
