// Memories of a client session. Layer: session. Source: sessions spec section 2.14.
//
// A transfer is a sequence of requests, one at a time and all under the id of the first: what cancels, times out or
// ends with the session is then the transfer as a whole.
#include <algorithm>
#include <limits>
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/member/member_table.hpp"
#include "core/session/client/client_session.hpp"
#include "core/types/multidim.hpp"

namespace rr {

namespace {

std::string_view shape_parameter(const MemberDefinition& member) {
  return is_multidim(member.type) ? memory_parameter::dimensions : memory_parameter::length;
}

}  // namespace

RequestId ClientSession::get_memory_dimensions(std::string_view path, std::string_view member, Now now) {
  return request_elements(EntryType::memory_get_param, MemberKind::memory, path, member, now,
                          [&](const MemberDefinition& definition) -> Result<> {
                            outgoing_.add_text("parameter", shape_parameter(definition));
                            return {};
                          });
}

RequestId ClientSession::read_memory(std::string_view path, std::string_view member,
                                     std::span<const std::uint64_t> position, std::span<const std::uint64_t> count,
                                     Now now) {
  MemoryTransfer transfer;
  transfer.range = {{position.begin(), position.end()}, {count.begin(), count.end()}};
  return begin_memory(path, member, std::move(transfer), EntryType::memory_read, now);
}

RequestId ClientSession::write_memory(std::string_view path, std::string_view member,
                                      std::span<const std::uint64_t> position, const Value& value, Now now) {
  MemoryTransfer transfer;
  transfer.is_write = true;
  transfer.range.position = {position.begin(), position.end()};
  transfer.data = value;
  return begin_memory(path, member, std::move(transfer), EntryType::memory_write, now);
}

RequestId ClientSession::begin_memory(std::string_view path, std::string_view member, MemoryTransfer transfer,
                                      EntryType access, Now now) {
  const auto id = next_request_id();
  const auto definition = find_member(path, member, MemberKind::memory);
  if (!definition) return fail_request(id, definition.error());
  if (auto allowed = check_direction(access, **definition); !allowed) return fail_request(id, allowed.error());
  if (transfer.is_write) {
    auto count = shape_of(transfer.data, **definition, types_);
    if (!count) return fail_request(id, count.error());
    transfer.range.count = std::move(*count);
  }
  transfer.path = path;
  request_memory(id, **definition, std::make_unique<MemoryTransfer>(std::move(transfer)), now);
  return id;
}

/// Sends the request that the transfer's stage is about.
void ClientSession::request_memory(RequestId id, const MemberDefinition& member,
                                   std::unique_ptr<MemoryTransfer> transfer, Now now) {
  const bool is_data = transfer->stage == MemoryTransfer::Stage::data;
  const auto type = !is_data             ? EntryType::memory_get_param
                    : transfer->is_write ? EntryType::memory_write
                                         : EntryType::memory_read;
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(type, transfer->path, member.name, id);
  Value part;  // borrowed by the message
  if (!is_data) {
    outgoing_.add_text("parameter", transfer->stage == MemoryTransfer::Stage::limit ? memory_parameter::limit
                                                                                    : shape_parameter(member));
  } else {
    write_memory_range(outgoing_, transfer->part);
    if (transfer->is_write) {
      const auto items = *product_of(std::span<const std::uint64_t>(transfer->part.count));
      part = memory_slice(transfer->data, transfer->items_done, items, transfer->part.count, member, types_);
      transfer->items_done += items;
      if (auto written = write_memory_data(outgoing_, part, transfer->part.count, member, types_); !written)
        return emit(Completed{id, written.error()});
    }
  }
  if (auto sent = send_outgoing(now); !sent) return emit(Completed{id, sent.error()});
  add_pending(id, type, &member, {}, now);
  pending_.find(id)->second.memory = std::move(transfer);
}

void ClientSession::handle_memory_reply(const Message& message, const MessageEntry& entry, RequestId id,
                                        Pending pending, Now now) {
  auto& transfer = *pending.memory;
  const auto& member = *pending.member;
  if (entry.error != ErrorCode::none) return emit(Completed{id, read_error(message, entry, types_)});
  if (auto taken = take_memory_reply(message, entry, member, transfer); !taken)
    return emit(Completed{id, taken.error()});
  if (transfer.parts) {
    auto part = transfer.parts->next();
    if (!part)
      return emit(
          Completed{id, transfer.is_write ? Value{} : transfer.collected.take(transfer.range.count, member, types_)});
    transfer.part = std::move(*part);
  }
  request_memory(id, member, std::move(pending.memory), now);
}

/// Takes what the reply says, and sets the stage of the next request.
Result<> ClientSession::take_memory_reply(const Message& message, const MessageEntry& entry,
                                          const MemberDefinition& member, MemoryTransfer& transfer) {
  switch (transfer.stage) {
    case MemoryTransfer::Stage::dimensions: {
      // Not every service checks ranges: a read beyond the end may come back as anything.
      const auto dimensions = read_memory_shape(message, entry, member);
      if (!dimensions) return dimensions.error();
      if (auto fits = check_memory_range(transfer.range, *dimensions, member); !fits) return fits;
      const auto& count = transfer.range.count;
      if (std::any_of(count.begin(), count.end(),
                      [](auto size) { return size > std::numeric_limits<std::uint32_t>::max(); }))
        return make_error(ErrorCode::out_of_range, "memory '" + member.name + "': more items than a value can hold");
      const auto known = memory_limits_.find(PathMemberView{transfer.path, member.name});
      if (known == memory_limits_.end())
        transfer.stage = MemoryTransfer::Stage::limit;
      else
        begin_memory_parts(member, transfer, known->second);
      return {};
    }
    case MemoryTransfer::Stage::limit: {
      const auto limit = read_memory_limit(message, entry, member);
      if (!limit) return limit.error();
      memory_limits_[{transfer.path, member.name}] = *limit;
      begin_memory_parts(member, transfer, *limit);
      return {};
    }
    case MemoryTransfer::Stage::replaced:
      return object_replaced(transfer.path);
    case MemoryTransfer::Stage::data:
      if (transfer.is_write) return {};
      auto data = read_memory_data(message, entry, transfer.part.count, member, types_);
      if (!data) return data.error();
      transfer.collected.add(std::move(*data));
      return {};
  }
  return {};
}

void ClientSession::begin_memory_parts(const MemberDefinition& member, MemoryTransfer& transfer, std::uint32_t limit) {
  const std::uint64_t bytes = std::min(limit, options_.max_memory_transfer);
  transfer.parts.emplace(transfer.range, std::max<std::uint64_t>(1, bytes / memory_item_size(member, types_)));
  transfer.stage = MemoryTransfer::Stage::data;
}

}  // namespace rr
