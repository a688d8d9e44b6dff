#include "server/rr/shared_access.hpp"

#include "core/session/service/service_index.hpp"

namespace rrgate {

namespace {

Verb verb_of(rr::EntryType type) {
  switch (type) {
    case rr::EntryType::property_set_req:
    case rr::EntryType::memory_write:
    case rr::EntryType::wire_poke_out_value_req:
    case rr::EntryType::wire_packet:
    case rr::EntryType::pipe_packet:
      return Verb::write;
    case rr::EntryType::function_call_req:
    case rr::EntryType::generator_next_req:
      return Verb::call;
    case rr::EntryType::event_req:
    case rr::EntryType::callback_call_req:
    case rr::EntryType::pipe_connect_req:
    case rr::EntryType::pipe_disconnect_req:
    case rr::EntryType::wire_connect_req:
    case rr::EntryType::wire_disconnect_req:
      return Verb::subscribe;
    case rr::EntryType::client_session_op_req:
      return Verb::lock;
    default:
      return Verb::read;
  }
}

/// Of these there may be thousands a second: they are held to the rules, but their beginning alone is recorded. Nor is
/// what the device does by itself.
bool is_part_of_stream(rr::EntryType type) {
  return type == rr::EntryType::wire_packet || type == rr::EntryType::pipe_packet || type == rr::EntryType::event_req ||
         type == rr::EntryType::callback_call_req || type == rr::EntryType::generator_next_req;
}

}  // namespace

std::function<rr::Result<>(const rr::MemberAccess&)> make_admission(Access& access, const SharedNode& node,
                                                                    Identity who) {
  return [&access, &node, who = std::move(who)](const rr::MemberAccess& wanted) -> rr::Result<> {
    if (access.is_open()) return {};
    const auto service = wanted.path.substr(0, wanted.path.find('.'));
    if (service == rr::service_index_name) return {};  // as for nodes: what there is, is no secret
    const auto device = node.device_of(service);
    const auto asker = access.in_session(who, wanted.user);
    // What makes the device look for an object, which may be on the way to another.
    if (wanted.type == rr::EntryType::object_type_name && access.sees(asker, device, service)) return {};
    AccessRequest request;
    request.device = device;
    request.service = service;
    request.path = wanted.path;
    if (wanted.member) request.member = wanted.member->name;
    request.verb = verb_of(wanted.type);
    if (is_part_of_stream(wanted.type)) return access.state().rules.check(asker, request);
    return access.check(asker, request);
  };
}

}  // namespace rrgate
