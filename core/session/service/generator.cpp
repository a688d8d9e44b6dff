// Generator functions of a service session. Layer: session. Source: sessions spec section 2.10.
#include <utility>

#include "core/session/service/service_session.hpp"

namespace rr {

Result<> ServiceSession::open_generator(const Message& message, const MessageEntry& entry, HostedService::Found found,
                                        const MemberDefinition& member) {
  const auto id = generators_.add(entry.service_path, member);
  if (!id) return id.error();
  if (auto added = add_call(message, entry, CallKind::generator_open, std::move(found), member); !added) {
    generators_.remove(*id);
    return added;
  }
  calls_.back().generator = *id;
  std::get<Called>(events_.back()).generator = *id;
  return {};
}

Result<> ServiceSession::step_generator(const Message& message, const MessageEntry& entry, HostedService::Found found,
                                        const MemberDefinition& member, Now now) {
  const auto& types = service_->types();
  const auto index = read_generator_index(message, entry, member);
  if (!index) return index.error();
  const auto step = generator_step(entry);
  Called called;
  if (step == GeneratorStep::next) {
    auto parameter = read_generator_parameter(message, entry, member, types);
    if (!parameter) return parameter.error();
    if (*parameter) called.arguments.push_back(std::move(**parameter));
  }
  if (auto room = check_room_for_call(); !room) return room;
  const auto begun = generators_.begin(entry.service_path, member, *index, step, now);
  if (!begun) return begun.error();
  if (!begun->is_for_application) {
    begin_reply(entry);
    if (auto written = write_generator_return(outgoing_, step, {}, member, types); !written) return written;
    send_outgoing(now);
    return {};
  }
  called.id = ++last_call_id_;
  called.kind = step == GeneratorStep::next    ? CallKind::generator_next
                : step == GeneratorStep::close ? CallKind::generator_close
                                               : CallKind::generator_abort;
  called.object = std::move(found.object);
  called.member = &member;
  called.generator = begun->id;
  calls_.push_back(
      {called.id, entry.type, entry.request_id, std::string(entry.service_path), &member, begun->id, step});
  events_.push(std::move(called));
  return {};
}

/// The reply to a call or a step is begun.
Result<> ServiceSession::write_generator_reply(const OpenCall& call, const Value& value, Now now) {
  if (call.type == EntryType::generator_next_req)
    return write_generator_return(outgoing_, call.step, value, *call.member, service_->types());
  if (!generators_.opened(call.generator, now))
    return make_error(ErrorCode::object_not_found, "the object of generator '" + call.member->name + "' was released");
  write_generator_index(outgoing_, generator_index(call.generator));
  return {};
}

void ServiceSession::finish_generator_call(const OpenCall& call, bool has_failed, Now now) {
  if (call.type == EntryType::function_call_req) {
    if (!has_failed) return;
    generators_.remove(call.generator);
    end_generators({call.generator});
  } else if (generators_.finish(call.generator, call.step, has_failed, now)) {
    end_generators({call.generator});
  }
}

void ServiceSession::end_generators(const std::vector<GeneratorId>& ended) {
  if (is_gone_) return;  // ClientGone is the last event
  for (const auto id : ended) events_.push(GeneratorEnded{id});
}

}  // namespace rr
