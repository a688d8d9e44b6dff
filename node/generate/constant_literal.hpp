// Constants of definitions as source text of other languages. Layer: definitions.
// Source: service definitions spec section 5.5.2.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/robdef/model/constant_value.hpp"

namespace rrgate {

/// Of both forms, `constant` and `option constant`; struct constants behind those that they refer to.
std::vector<rr::ConstantDefinition> all_constants(const rr::ServiceDefinition& definition);
std::vector<rr::ConstantDefinition> all_constants(const rr::EntityDefinition& entity);

inline bool is_struct_constant(const rr::ConstantDefinition& item) {
  return item.type.type == rr::DataType::namedtype_t;
}

/// The value of a verified constant.
rr::ConstantValue value_of(const rr::ConstantDefinition& item);

/// Shortest text that reads back as this value: "0.1", "1e+300".
std::string float_literal(double value);
std::string float_literal(float value);
/// In double quotes; UTF-8 as it is, controls escaped as C++ (octal) or TypeScript (\x) read them.
std::string string_literal(std::string_view text, bool for_cpp);

/// An expression. Struct constants are written out whole, up to a bound; `scope` is what their fields refer to.
std::string typescript_constant(const rr::ConstantDefinition& item, std::span<const rr::ConstantDefinition> scope);

/// A constexpr variable, without `constexpr`: "std::int16_t NAME = 5". Of what is not a struct constant.
std::string cpp_constant(const rr::ConstantDefinition& item, std::string_view name);

}  // namespace rrgate
