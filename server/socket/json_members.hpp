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

/// The request's "value", as one of `type`. `name`  of errors.
rr::Value value_of(const JsonRequest& request, const Target& target, const rr::TypeDefinition& type,
                   const std::string& name, const rr::JsonForm& form);
/// The request's "args", for the target's function.
std::vector<rr::Value> arguments_of(const JsonRequest& request, const Target& target, const rr::JsonForm& form);

using JsonAnswer = rr::awaitable<rr::OrderedJson>;
JsonAnswer describe_target(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer get_value(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer set_value(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer call_function(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer get_shape(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer read_memory(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer write_memory(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer lock_object(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer unlock_object(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer lease_object(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer renew_lease(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);
JsonAnswer release_lease(JsonRequestPtr request, TargetPtr target, rr::JsonForm form);

}  // namespace rrgate
