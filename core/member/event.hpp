// Event: fired by the service, to all of its clients. Layer: member. Source: sessions spec section 2.9.
#pragma once

#include <span>

#include "core/types/pack.hpp"
#include "core/wire/shared_message.hpp"

namespace rr {

/// An event on its way to all clients of a service; packed and encoded once for them.
class EventPacket {
 public:
  /// `path`, `member` and `arguments` are borrowed.
  EventPacket(std::string_view path, const MemberDefinition& member, std::span<const Value> arguments)
      : path_(path), member_(member), arguments_(arguments) {}

  std::string_view path() const { return path_; }
  const MemberDefinition& member() const { return member_; }
  std::span<const Value> arguments() const { return arguments_; }
  /// Packed by the first call. Errors   those of write_arguments().
  Result<SharedMessage*> message(const TypeRegistry& types);

 private:
  std::string_view path_;
  const MemberDefinition& member_;
  std::span<const Value> arguments_;
  SharedMessage message_;
};

}  // namespace rr
