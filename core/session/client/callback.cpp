// Callbacks that the service calls in a client session. Layer: session. Source: sessions spec section 2.9.
#include <utility>

#include "core/member/arguments.hpp"
#include "core/member/error_entry.hpp"
#include "core/session/client/client_session.hpp"

namespace rr {

void ClientSession::handle_callback(const Message& message, const MessageEntry& entry, Now now) {
  if (entry.error != ErrorCode::none) return;  // no request is one
  const auto* type = object_type(entry.service_path);
  if (!type) return answer_error(entry, {ErrorCode::service_error, "Stub not found"}, now);
  const auto* member = type->find_member(entry.member_name);
  if (!member || member->kind != MemberKind::callback)
    return answer_error(
        entry,
        {ErrorCode::member_not_found, "object type " + type->name + " has no callback " + quote(entry.member_name)},
        now);
  if (callbacks_.size() >= options_.max_open_callbacks)
    return answer_error(entry,
                        {ErrorCode::out_of_system_resource,
                         std::to_string(options_.max_open_callbacks) + " callbacks wait for an answer already"},
                        now);
  auto arguments = read_arguments(message, entry, *member, types_);
  if (!arguments) return answer_error(entry, arguments.error(), now);
  const auto id = ++last_callback_id_;
  callbacks_.emplace(id, OpenCallback{entry.request_id, std::string(entry.service_path), member});
  emit(CallbackCalled{id, std::string(entry.service_path), member->name, std::move(*arguments)});
}

void ClientSession::reply_callback(CallbackId id, const Result<Value>& result, Now now) {
  const auto found = callbacks_.extract(id);
  if (!found) return;
  const auto& call = found.mapped();
  const auto begin = [&] {
    connection_.begin_message(outgoing_);
    outgoing_.begin_entry(EntryType::callback_call_ret, call.path, call.member->name, call.request_id);
  };
  begin();
  Result<> sent = result ? write_return(outgoing_, *result, *call.member, types_) : Result<>(result.error());
  if (sent) sent = send_outgoing(now);
  if (sent) return;
  // What cannot be sent becomes an error, so that the service does not wait in vain.
  begin();
  write_error(outgoing_, sent.error(), types_);
  if (auto second = send_outgoing(now); !second) fail(second.error());
}

}  // namespace rr
