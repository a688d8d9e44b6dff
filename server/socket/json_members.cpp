#include "server/socket/json_members.hpp"

#include <algorithm>

#include "server/http/endpoints/member_values.hpp"
#include "server/upstream/lease_table.hpp"

namespace rrgate {

std::string name_of(const Target& target) {
  return target.member ? target.path() + "." + target.member->name : target.path();
}

const rr::MemberDefinition& expect_member(const Target& target, std::string_view operation,
                                          std::initializer_list<rr::MemberKind> kinds) {
  const auto* member = target.member;
  if (member && std::find(kinds.begin(), kinds.end(), member->kind) != kinds.end()) return *member;
  refuse(rr::ErrorCode::invalid_operation, rr::quote(name_of(target)) + " is a " +
                                               (member ? std::string(member_kind_name(member->kind)) : "object") +
                                               "; \"" + std::string(operation) + "\" is not for that");
}

void expect_object(const Target& target, const std::string& message) {
  if (target.member) refuse(rr::ErrorCode::invalid_operation, message);
}

void expect_direction(const rr::MemberDefinition& member, rr::MemberDirection never) {
  if (member.direction() != never) return;
  const bool is_read_only = never == rr::MemberDirection::readonly;
  refuse(is_read_only ? rr::ErrorCode::read_only_member : rr::ErrorCode::write_only_member,
         rr::quote(member.name) + (is_read_only ? " can only be read" : " can only be written"));
}

rr::awaitable<rr::Value> value_of(const JsonRequest& request, const Target& target, const rr::TypeDefinition& type,
                                  const std::string& name, JsonMaking how) {
  const auto& json = request.at("value");
  const auto make = [&] { return rr::value_from_json(json, type, target.types(), how.form, name); };
  if (!request.is_large() || !is_apart(type)) co_return value_or_throw(make());
  co_return value_or_throw(co_await how.workers.run(make));
}

rr::awaitable<std::vector<rr::Value>> arguments_of(const JsonRequest& request, const Target& target, JsonMaking how) {
  static const auto none = rr::Json::object();
  const auto* given = request.find("args");
  const auto make = [&] {
    return arguments_from_json(given ? *given : none, *target.member, target.types(), how.form);
  };
  if (!request.is_large() || !is_apart(target.member->parameters)) co_return value_or_throw(make());
  co_return value_or_throw(co_await how.workers.run(make));
}

JsonAnswer describe_target(JsonRequestPtr, TargetPtr target, JsonMaking) {
  expect_object(*target, rr::quote(name_of(*target)) + " is no object");
  co_return describe_object(*target);
}

JsonAnswer get_value(JsonRequestPtr, TargetPtr target, JsonMaking how) {
  const auto& member = expect_member(*target, "get", {rr::MemberKind::property, rr::MemberKind::wire});
  expect_direction(member, rr::MemberDirection::writeonly);
  const auto kind = member.kind == rr::MemberKind::property ? rr::CallKind::property_get : rr::CallKind::peek_in;
  const auto value = co_await target->ask(kind);
  co_return co_await json_of(*target, value, how.form, how.workers);
}

JsonAnswer set_value(JsonRequestPtr request, TargetPtr target, JsonMaking how) {
  const auto& member = expect_member(*target, "set", {rr::MemberKind::property, rr::MemberKind::wire});
  expect_direction(member, rr::MemberDirection::readonly);
  const auto kind = member.kind == rr::MemberKind::property ? rr::CallKind::property_set : rr::CallKind::poke_out;
  auto value = co_await value_of(*request, *target, member.type, member.name, how);
  co_await target->ask(kind, std::move(value));
  co_return nullptr;
}

JsonAnswer call_function(JsonRequestPtr request, TargetPtr target, JsonMaking how) {
  const auto& member = expect_member(*target, "call", {rr::MemberKind::function});
  if (member.is_generator())
    refuse(rr::ErrorCode::invalid_operation, rr::quote(member.name) + " is a generator; use \"open\"");
  auto called = target->request(rr::CallKind::function);
  called.arguments = co_await arguments_of(*request, *target, how);
  const auto value = co_await target->client->ask(std::move(called));
  co_return co_await json_of(*target, value, how.form, how.workers);
}

JsonAnswer get_shape(JsonRequestPtr, TargetPtr target, JsonMaking) {
  expect_member(*target, "shape", {rr::MemberKind::memory});
  const auto sizes = co_await memory_shape(*target);
  co_return rr::OrderedJson(sizes);
}

JsonAnswer read_memory(JsonRequestPtr request, TargetPtr target, JsonMaking how) {
  const auto& member = expect_member(*target, "read", {rr::MemberKind::memory});
  expect_direction(member, rr::MemberDirection::writeonly);
  const auto sizes = co_await memory_shape(*target);
  const auto offset = request->numbers("offset", sizes.size());
  const auto count = request->numbers("count", sizes.size());
  const auto items = co_await read_items(*target, sizes, offset, count);
  co_return co_await json_of(*target, items, how.form, how.workers);
}

JsonAnswer write_memory(JsonRequestPtr request, TargetPtr target, JsonMaking how) {
  const auto& member = expect_member(*target, "write", {rr::MemberKind::memory});
  expect_direction(member, rr::MemberDirection::readonly);
  const auto sizes = co_await memory_shape(*target);
  const auto offset = request->numbers("offset", sizes.size());
  const auto count = request->numbers("count", sizes.size());
  auto items = co_await value_of(*request, *target, member.type, member.name, how);
  co_await write_items(*target, sizes, offset, count, std::move(items));
  co_return nullptr;
}

JsonAnswer lock_object(JsonRequestPtr request, TargetPtr target, JsonMaking) {
  expect_object(*target, "objects are locked, not their members");
  const auto kind = request->text("kind", "client");
  if (kind != "client" && kind != "user")
    refuse(rr::ErrorCode::invalid_argument, "\"kind\" is " + rr::quote(kind) + ", expected \"client\" or \"user\"");
  const auto command = kind == "user" ? rr::LockCommand::lock_for_user : rr::LockCommand::lock_for_client;
  auto path = target->path();
  co_await target->client->lock(command, std::move(path));
  co_return nullptr;
}

JsonAnswer unlock_object(JsonRequestPtr, TargetPtr target, JsonMaking) {
  auto path = target->path();
  co_await target->client->lock(rr::LockCommand::unlock, std::move(path));
  co_return nullptr;
}

JsonAnswer lease_object(JsonRequestPtr request, TargetPtr target, JsonMaking) {
  expect_object(*target, "leases are of objects, not of their members");
  const auto& deadman = request->at("deadman");
  if (!deadman.is_number_unsigned() || deadman.get<std::uint64_t>() > std::uint64_t(longest_deadman.count()))
    refuse(rr::ErrorCode::invalid_argument,
           "\"deadman\" is the milliseconds without renewal until the lease ends, at most " +
               std::to_string(longest_deadman.count()));
  const auto* takeover = request->find("takeover");
  if (takeover && !takeover->is_boolean()) refuse(rr::ErrorCode::invalid_argument, "\"takeover\" is true or false");
  const bool takes_over = takeover && takeover->get<bool>();
  const auto command = takes_over ? rr::LockCommand::take_lease : rr::LockCommand::acquire_lease;
  auto path = target->path();
  co_await target->client->lock(command, std::move(path), std::chrono::milliseconds(deadman.get<std::int64_t>()));
  co_return nullptr;
}

JsonAnswer renew_lease(JsonRequestPtr, TargetPtr target, JsonMaking) {
  auto path = target->path();
  co_await target->client->lock(rr::LockCommand::renew_lease, std::move(path));
  co_return nullptr;
}

JsonAnswer release_lease(JsonRequestPtr, TargetPtr target, JsonMaking) {
  auto path = target->path();
  co_await target->client->lock(rr::LockCommand::release_lease, std::move(path));
  co_return nullptr;
}

}  // namespace rrgate
