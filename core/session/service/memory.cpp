// Memories of a service session. Layer: session. Source: sessions spec section 2.14.
#include <utility>

#include "core/session/service/service_session.hpp"
#include "core/types/multidim.hpp"

namespace rr {

Result<> ServiceSession::answer_memory(const Message& message, const MessageEntry& entry, HostedService::Found found,
                                       const MemberDefinition& member, Now now) {
  Called called;
  OpenCall call{0, entry.type, entry.request_id, std::string(entry.service_path), &member};
  if (entry.type == EntryType::memory_get_param) {
    const auto* parameter = message.elements_of(entry).find("parameter");
    if (!parameter || parameter->type != DataType::string_t)
      return make_error(parameter ? ErrorCode::data_type_mismatch : ErrorCode::message_element_not_found,
                        "memory '" + member.name + "': text element 'parameter' not found");
    if (parameter->text() == memory_parameter::limit) {
      begin_reply(entry);
      outgoing_.add_scalar("return", DataType::uint32_t, options_.max_memory_transfer);
      send_outgoing(now);
      return {};
    }
    const bool has_dims = is_multidim(member.type);
    call.wants_dim_count = has_dims && parameter->text() == memory_parameter::dim_count;
    if (!call.wants_dim_count &&
        parameter->text() != (has_dims ? memory_parameter::dimensions : memory_parameter::length))
      return make_error(ErrorCode::invalid_operation,
                        "memory '" + member.name + "': Unknown parameter " + quote(parameter->text()));
    called.kind = CallKind::memory_dimensions;
  } else {
    auto range = read_memory_range(message, entry, member);
    if (!range) return range.error();
    if (auto fits = check_memory_size(*range, member); !fits) return fits;
    called.kind = CallKind::memory_read;
    if (entry.type == EntryType::memory_write) {
      called.kind = CallKind::memory_write;
      auto data = read_memory_data(message, entry, range->count, member, service_->types());
      if (!data) return data.error();
      called.arguments.push_back(std::move(*data));
    }
    call.range = std::make_unique<const MemoryRange>(*range);
    called.range = std::move(*range);
  }
  if (auto room = check_room_for_call(); !room) return room;
  called.id = call.id = ++last_call_id_;
  called.object = std::move(found.object);
  called.member = &member;
  calls_.push_back(std::move(call));
  events_.push(std::move(called));
  return {};
}

/// No message holds more: refused before an application reserves memory for it.
Result<> ServiceSession::check_memory_size(const MemoryRange& range, const MemberDefinition& member) const {
  const auto items = product_of(std::span<const std::uint64_t>(range.count));
  const std::uint64_t limit = options_.connection.max_message_size;
  const auto* entity = member.type.name.empty() ? nullptr : service_->types().find_entity(member.type.qualified_name);
  // What a pod takes at least is not known exactly: its fields may be empty.
  const auto each = entity && entity->kind == EntityKind::pod ? 1 : memory_item_size(member, service_->types());
  if (items && *items <= limit / each) return {};
  return make_error(items ? ErrorCode::buffer_limit_violation : ErrorCode::out_of_range,
                    "memory '" + member.name + "': " + (items ? std::to_string(*items) : "too many") +
                        " items at once, a message holds at most " + std::to_string(limit) + " bytes");
}

/// The reply is begun.
Result<> ServiceSession::write_memory_reply(const OpenCall& call, const Value& value) {
  if (call.type == EntryType::memory_get_param) {
    const auto shape = value.to_items<std::uint64_t>();
    const bool is_right = shape && !shape->empty() && (is_multidim(call.member->type) || shape->size() == 1);
    if (!is_right)
      return make_error(ErrorCode::internal_error, "memory '" + call.member->name + "': the service says " +
                                                       value.type_text() + " for its dimensions");
    const std::uint64_t dim_count = shape->size();
    write_memory_shape(outgoing_, call.wants_dim_count ? std::span(&dim_count, 1) : *shape);
    return {};
  }
  write_memory_range(outgoing_, *call.range);
  if (call.type == EntryType::memory_write) return {};
  return write_memory_data(outgoing_, value, call.range->count, *call.member, service_->types());
}

}  // namespace rr
