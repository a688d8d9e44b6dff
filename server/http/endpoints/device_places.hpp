// The members that a device offers over HTTP, and what all documents say of them. Layer: server/http/endpoints.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/http/endpoints/device_documents.hpp"

namespace rrgate {

/// A member and the URL path that leads to it.
struct DocumentedMember {
  const DescribedService* service;
  const rr::MemberDefinition* member;
  std::string path;         ///< "/api/v1/devices/d/Create/axes/{axes}/position"
  std::string object_path;  ///< "Create.axes[{axes}]"
  std::vector<std::string> indices;
  std::string id;  ///< "Create_axes_position", which no other member has
};

struct Places {
  std::vector<DocumentedMember> members;
  bool is_truncated = false;  ///< there are more than the documents tell
};

/// Every member that a path leads to. An object type within itself is listed once; what is behind a varobject is known
/// at run time only.
Places places_of(const std::string& base, const std::vector<DescribedService>& services);
/// The id of the WebSocket of a service, which no member has.
std::string socket_id(const DescribedService& service);
/// Of the named types of all services.
rr::OrderedJson schemas_of(const std::vector<DescribedService>& services);
/// The documents say what they are about as every device of its kind does.
void add_info(rr::OrderedJson& out, std::string_view device);

inline bool can_read(const rr::MemberDefinition& member) {
  return member.direction() != rr::MemberDirection::writeonly;
}
inline bool can_write(const rr::MemberDefinition& member) {
  return member.direction() != rr::MemberDirection::readonly;
}

// The documents.

rr::OrderedJson open_api(std::string_view device, const std::vector<DocumentedMember>& places, rr::OrderedJson schemas,
                         const std::vector<std::string>& unavailable);
rr::OrderedJson async_api(std::string_view device, const std::string& base,
                          const std::vector<DescribedService>& services, const std::vector<DocumentedMember>& places,
                          rr::OrderedJson schemas);
rr::OrderedJson thing_description(std::string_view device, const std::vector<DocumentedMember>& places,
                                  rr::OrderedJson schemas);

}  // namespace rrgate
