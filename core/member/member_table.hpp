// The one table of requests on members: which kind of member each is for, and which way its value goes. Layer: member.
// Source: sessions spec sections 2.1 and 2.7.
#pragma once

#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// Which way a request moves a member's value, seen from the client.
enum class Access : std::uint8_t { none, read, write };

struct MemberRequest {
  EntryType type;
  MemberKind kind;
  Access access;
};

/// The row of a request (or client packet) on a member; nullptr for every other entry type.
const MemberRequest* find_member_request(EntryType type);

/// Whether the member's direction allows what the request does.
/// Errors   read_only_member, write_only_member.
Result<> check_direction(EntryType type, const MemberDefinition& member);

}  // namespace rr
