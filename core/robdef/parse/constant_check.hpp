// Whether the value of a constant fits its type. Layer: robdef. Source: service definitions spec section 5.5.2.
#pragma once

#include "core/robdef/model/service_definition.hpp"
#include "core/robdef/parse/statement_reader.hpp"

namespace rr {

/// Where the parts of its statement stand.
struct ConstantPlace {
  std::size_t type_start;
  std::size_t type_end;
  std::size_t value_start;
};

/// Reports what is wrong with it; false where the constant is unusable in the reader's mode.
bool check_constant(StatementReader& reader, const ConstantDefinition& constant, const ConstantPlace& at);

}  // namespace rr
