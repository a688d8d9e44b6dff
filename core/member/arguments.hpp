// Parameters of functions, events and callbacks as elements of an entry. Layer: member.
// Source: sessions spec section 2.9.
#pragma once

#include <span>
#include <vector>

#include "core/types/pack.hpp"

namespace rr {

/// Adds one element a parameter, in definition order (a generator parameter is omitted).
/// Errors   invalid_argument for a wrong number of arguments; those of pack().
Result<> write_arguments(Message& message, std::span<const Value> arguments, const MemberDefinition& member,
                         const TypeRegistry& types);

/// Reads the parameters by name; order is free, extra elements are ignored.
/// Errors   message_element_not_found; those of unpack().
Result<std::vector<Value>> read_arguments(const Message& message, const MessageEntry& entry,
                                          const MemberDefinition& member, const TypeRegistry& types);

/// Adds `return`; a void function returns int32 0.
Result<> write_return(Message& message, const Value& value, const MemberDefinition& member, const TypeRegistry& types);

/// Reads `return`; null for void functions, whatever is there.
Result<Value> read_return(const Message& message, const MessageEntry& entry, const MemberDefinition& member,
                          const TypeRegistry& types);

/// Adds / reads `value` of a property.
Result<> write_property(Message& message, const Value& value, const MemberDefinition& member,
                        const TypeRegistry& types);
Result<Value> read_property(const Message& message, const MessageEntry& entry, const MemberDefinition& member,
                            const TypeRegistry& types);

}  // namespace rr
