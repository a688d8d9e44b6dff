// JSON Schema of declared types, as value_to_json() writes them. Layer: server/json.
// Source: service definitions spec section 5.12, "JSON Schema / OpenAPI".
#pragma once

#include <optional>
#include <string>

#include "core/types/type_registry.hpp"
#include "server/json/json.hpp"

namespace rr {

/// The schema of a type (JSON Schema 2020-12, as OpenAPI 3.1 takes it). Named types are references to
/// "#/components/schemas/" and their qualified name. Each schema tells its exact type as "x-rr-type".
OrderedJson type_schema(const TypeDefinition& type);
/// The schema of an object with a value for each parameter, by its name; not for the one that each step takes.
OrderedJson arguments_schema(const MemberDefinition& member);

/// Puts what a definition says of a type or a field into its schema.
using NoteDocumentation = void (*)(OrderedJson& schema, const std::string& documentation);

/// The schema of one structure, pod, named array or enum, or of an object. nullopt: no such type.
std::optional<OrderedJson> named_type_schema(const TypeRegistry& types, const std::string& qualified_name,
                                             NoteDocumentation note);

/// The schemas of all named types and enums of `types`, by qualified name, with documentation as "description".
OrderedJson named_type_schemas(const TypeRegistry& types);

}  // namespace rr
