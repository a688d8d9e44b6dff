#include "core/member/event.hpp"

#include "core/member/arguments.hpp"

namespace rr {

Result<SharedMessage*> EventPacket::message(const TypeRegistry& types) {
  auto& message = message_.message;
  if (!message.entries.empty()) return &message_;
  message.begin_entry(EntryType::event_req, path_, member_.name);
  if (auto written = write_arguments(message, arguments_, member_, types); !written) {
    message.clear();
    return written.error();
  }
  return &message_;
}

}  // namespace rr
