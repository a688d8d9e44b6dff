// What a JSON request asks of a member and is over with its answer; what all requests to members have in common.
// Layer: server/socket. See docs/http-api.md.
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/endpoints/object_request.hpp"
#include "server/socket/json_request.hpp"

namespace rrgate {

using TargetPtr = std::shared_ptr<Target>;
using JsonRequestPtr = std::shared_ptr<const JsonRequest>;

/// What a target is called in errors: "arm.torque", "arm".
std::string name_of(const Target& target);

// All throw   rr::Exception.

/// The target's member. Throws   invalid_operation: the path leads to something else.
const rr::MemberDefinition& expect_member(const Target& target, std::string_view operation,
                                          std::initializer_list<rr::MemberKind> kinds);
/// The target is an object. `message`  of the error where it is not.
void expect_object(const Target& target, const std::string& message);
/// Throws   read_only_member, write_only_member: the member has the direction `never`.
void expect_direction(const rr::MemberDefinition& member, rr::MemberDirection never);

/// How values are read and written for a socket: on a worker those that are large and apart, as is_apart() says.
struct JsonMaking {
  Workers& workers;
  rr::JsonForm form;
};

// These borrow for the wait.

/// The request's "value", as one of `type`. `name`  of errors.
rr::awaitable<rr::Value> value_of(const JsonRequest& request, const Target& target, const rr::TypeDefinition& type,
                                  const std::string& name, JsonMaking how);
/// The request's "args", for the target's function.
rr::awaitable<std::vector<rr::Value>> arguments_of(const JsonRequest& request, const Target& target, JsonMaking how);

using JsonAnswer = rr::awaitable<rr::OrderedJson>;
JsonAnswer describe_target(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer get_value(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer set_value(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer call_function(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer get_shape(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer read_memory(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer write_memory(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer lock_object(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer unlock_object(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer lease_object(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer renew_lease(JsonRequestPtr request, TargetPtr target, JsonMaking how);
JsonAnswer release_lease(JsonRequestPtr request, TargetPtr target, JsonMaking how);

}  // namespace rrgate
