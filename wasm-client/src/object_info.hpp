// What an object's type offers, for TypeScript to build members from. Layer: wasm-client/src.
#pragma once

#include "core/types/type_registry.hpp"
#include "wasm-client/src/js_writer.hpp"

namespace rr {

/// [{name, kind, type, parameters: [{name, type}], modifiers: [text], documentation}]
JsValue make_js_members(const EntityDefinition& entity);

/// {name, documentation, constants: [{name, type, text, documentation}], enums: [{name, values: [{name, value,
/// documentation}], documentation}], exceptions: [{name, documentation}], types: [{name, kind, constants, members,
/// implements: [qualified name], documentation}]}; `text` as it stands in the definition.
JsValue make_js_definition(const ServiceDefinition& definition);

}  // namespace rr
