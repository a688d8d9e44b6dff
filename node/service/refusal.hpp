// How the service API refuses what a device does wrong: with an exception that names the member. Layer: node/service.
#pragma once

#include <stdexcept>
#include <string>

#include "core/types/pack.hpp"

namespace rr {

[[noreturn]] inline void refuse(const std::string& what) {
  throw std::invalid_argument(what);
}

/// Refuses a value that cannot be sent, found out by packing it: a device learns of a wrong value where it sets it,
/// also while no client is connected.
inline void check_value(const std::string& where, const Value& value, const TypeDefinition& type,
                        const TypeRegistry& types) {
  Message scratch;
  scratch.begin_entry(EntryType::null, {}, {});
  if (auto packed = pack(scratch, "value", value, type, types); !packed) refuse(where + ": " + packed.error().message);
}

}  // namespace rr
