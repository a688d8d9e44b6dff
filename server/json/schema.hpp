// JSON Schema of declared types, as value_to_json() writes them. Layer: server/json.
// Source: service definitions spec section 5.12, "JSON Schema / OpenAPI".
#pragma once

#include "core/types/type_registry.hpp"
#include "server/json/json.hpp"

namespace rr {

/// The schema of a type (JSON Schema 2020-12, as OpenAPI 3.1 takes it). Named types are references to
/// "#/components/schemas/" and their qualified name. Each schema tells its exact type as "x-rr-type".
OrderedJson type_schema(const TypeDefinition& type);

/// The schemas of all named types and enums of `types`, by qualified name.
OrderedJson named_type_schemas(const TypeRegistry& types);

}  // namespace rr
