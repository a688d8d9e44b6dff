// Definitions and shorthand for tests of values on the wire.
#pragma once

#include <string>
#include <string_view>

#include "core/types/pack.hpp"
#include "core/types/type_registry.hpp"
#include "core/wire/codec.hpp"

namespace rr::test {

/// A registry of the definitions `test.types` (below) and `experimental.vectors` (golden).
const TypeRegistry& test_types();

/// The type of a field, e.g. field_type("test.types.every", "f3").
const TypeDefinition& field_type(std::string_view entity, std::string_view field);

/// A type made by hand: `DataType` with an array kind.
TypeDefinition type_of(DataType type, ArrayKind array = ArrayKind::none, std::vector<std::int32_t> sizes = {});
/// A struct, pod or named array of test_types(), e.g. "test.types.point".
TypeDefinition named_type(std::string_view qualified_name, ArrayKind array = ArrayKind::none);

/// One PropertyGetRes `svc`/`d1` holding `value` as the element `value`, with the common header of the vectors.
Result<Bytes> pack_message(const Value& value, const TypeDefinition& type, std::uint16_t version);
/// The element `value` of such a message.
Result<Value> unpack_message(ByteSpan bytes, const TypeDefinition& type);

/// pack_message and unpack_message in a row.
Result<Value> round_trip(const Value& value, const TypeDefinition& type, std::uint16_t version = 4);

/// Packs into a message that is thrown away: for what errors say.
Error pack_error(const Value& value, const TypeDefinition& type);

}  // namespace rr::test
