#include "core/member/member_table.hpp"

#include <algorithm>
#include <iterator>

namespace rr {

namespace {

constexpr MemberRequest requests[] = {
    {EntryType::property_get_req, MemberKind::property, Access::read},
    {EntryType::property_set_req, MemberKind::property, Access::write},
    {EntryType::function_call_req, MemberKind::function, Access::none},
    {EntryType::generator_next_req, MemberKind::function, Access::none},
    {EntryType::pipe_packet, MemberKind::pipe, Access::write},
    {EntryType::pipe_connect_req, MemberKind::pipe, Access::none},
    {EntryType::pipe_disconnect_req, MemberKind::pipe, Access::none},
    {EntryType::wire_packet, MemberKind::wire, Access::write},
    {EntryType::wire_connect_req, MemberKind::wire, Access::none},
    {EntryType::wire_disconnect_req, MemberKind::wire, Access::none},
    {EntryType::wire_peek_in_value_req, MemberKind::wire, Access::read},
    {EntryType::wire_peek_out_value_req, MemberKind::wire, Access::write},
    {EntryType::wire_poke_out_value_req, MemberKind::wire, Access::write},
    {EntryType::memory_read, MemberKind::memory, Access::read},
    {EntryType::memory_write, MemberKind::memory, Access::write},
    {EntryType::memory_get_param, MemberKind::memory, Access::none},
};

}  // namespace

const MemberRequest* find_member_request(EntryType type) {
  const auto* found =
      std::find_if(std::begin(requests), std::end(requests), [type](const auto& row) { return row.type == type; });
  return found == std::end(requests) ? nullptr : found;
}

Result<> check_direction(EntryType type, const MemberDefinition& member) {
  const auto* request = find_member_request(type);
  const auto access = request ? request->access : Access::none;
  const auto subject = [&] { return std::string(member_kind_name(member.kind)) + " '" + member.name + "'"; };
  if (access == Access::write && member.direction() == MemberDirection::readonly)
    return make_error(ErrorCode::read_only_member, subject() + " is readonly");
  if (access == Access::read && member.direction() == MemberDirection::writeonly)
    return make_error(ErrorCode::write_only_member, subject() + " is writeonly");
  return {};
}

}  // namespace rr
