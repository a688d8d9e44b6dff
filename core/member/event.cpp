#include "core/member/event.hpp"

#include "core/member/arguments.hpp"

namespace rr {

Result<SharedMessage*> EventPacket::message(const TypeRegistry& types) {
  return message_.pack([&](Message& message) {
    message.begin_entry(EntryType::event_req, path_, member_.name);
    return write_arguments(message, arguments_, member_, types);
  });
}

}  // namespace rr
