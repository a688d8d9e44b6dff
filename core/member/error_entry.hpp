// Errors in message entries. Layer: member. Source: messages spec section 10, sessions spec section 2.1.
#pragma once

#include "core/types/pack.hpp"

namespace rr {

/// Makes the last entry of `message` an error: its Error field, and `errorname`, `errorstring`, `errorsubname` and
/// `errorparam`. The texts are copied; the message borrows the parameter's payload. A parameter that cannot be packed
/// is left out.
/// `types`  of the parameter. Without them it has no type that a definition names.
void write_error(Message& message, const Error& error, const TypeRegistry& types);
void write_error(Message& message, const Error& error);

/// The error of an entry whose Error field is set. The code decides; missing texts read as empty, and a parameter that
/// cannot be read is left out.
Error read_error(const Message& message, const MessageEntry& entry, const TypeRegistry& types);

}  // namespace rr
