// TYPE = BASE [ARRAY] [CONTAINER]. Layer: robdef. Source: service definitions spec sections 5.3, 5.4.
#pragma once

#include "core/robdef/model/service_definition.hpp"
#include "core/robdef/parse/statement_reader.hpp"

namespace rr {

/// Reads a type at the reader's place; a type holds no blanks. False: reported.
bool parse_type(StatementReader& reader, TypeDefinition& out);

}  // namespace rr
