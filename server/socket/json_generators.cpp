// Generators that a client of a JSON WebSocket has opened. Layer: server/socket. See docs/http-api.md.
#include "server/http/endpoints/member_values.hpp"
#include "server/socket/json_operations.hpp"

namespace rrgate {

rr::awaitable<rr::OrderedJson> JsonOperations::open(JsonRequestPtr request, TargetPtr target) {
  const auto& member = expect_member(*target, "open", {rr::MemberKind::function});
  if (!member.is_generator())
    refuse(rr::ErrorCode::invalid_operation, rr::quote(member.name) + " is no generator; use \"call\"");
  auto arguments = co_await arguments_of(*request, *target, making());
  if (is_stopped_) refuse(rr::ErrorCode::operation_cancelled, "the WebSocket has ended");
  const auto reserved = reserve(*request);
  Generator generator{target, target->client->next_generator()};
  auto opening = target->request(rr::CallKind::generator_open);
  opening.generator = generator.id;
  opening.arguments = std::move(arguments);
  std::optional<rr::Error> error;
  try {
    co_await target->client->ask(std::move(opening));
  } catch (const rr::Exception& exception) {
    error = exception.error();
  }
  if (error) {
    drop_open(reserved);
    throw rr::Exception(*error);
  }
  auto* open = find_open(reserved);
  if (!open) {  // nobody will close it
    target->client->drop_generator(generator.id);
    refuse(rr::ErrorCode::operation_cancelled, "it was ended before it was open");
  }
  open->what = std::move(generator);
  co_return nullptr;
}

JsonOperations::Step JsonOperations::generator_of(const JsonRequest& request) {
  const auto found = open_.find(request.at("generator").dump());
  const auto* generator = found == open_.end() ? nullptr : std::get_if<Generator>(&found->second.what);
  if (!generator) refuse(rr::ErrorCode::invalid_argument, "\"generator\" is not the id of one that is open");
  return {*generator, {found->first, found->second.opening.token()}};
}

rr::awaitable<rr::OrderedJson> JsonOperations::next(JsonRequestPtr request, TargetPtr) {
  const auto [generator, reserved] = generator_of(*request);
  const auto target = generator.target;
  value_or_throw(place_.standing->check(access_request(*target, Verb::call), Recorded::never));
  auto step = target->request(rr::CallKind::generator_next);
  step.generator = generator.id;
  if (const auto* taken = target->member->step_parameter()) {
    auto given = co_await value_of(*request, *target, taken->type, taken->name, making());
    step.arguments.push_back(std::move(given));
  }
  rr::Value value;
  std::optional<rr::Error> error;
  try {
    value = co_await target->client->ask(std::move(step));
  } catch (const rr::Exception& exception) {
    error = exception.error();
  }
  auto out = rr::OrderedJson::object();
  if (error) {
    if (!target->client->has_generator(generator.id)) drop_open(reserved);
    if (error->code != rr::ErrorCode::stop_iteration) throw rr::Exception(*error);
    rr::add_key(out, "done") = true;
    co_return out;
  }
  auto json = co_await json_of(*target, value, place_.form, gateway_.workers());
  rr::add_key(out, "value") = std::move(json);
  rr::add_key(out, "done") = false;
  co_return out;
}

rr::awaitable<rr::OrderedJson> JsonOperations::end_generator(JsonRequestPtr request, rr::CallKind how) {
  const auto [generator, reserved] = generator_of(*request);
  const auto target = generator.target;
  drop_open(reserved);
  auto end = target->request(how);
  end.generator = generator.id;
  co_await target->client->ask(std::move(end));
  co_return nullptr;
}

rr::awaitable<rr::OrderedJson> JsonOperations::close(JsonRequestPtr request, TargetPtr) {
  co_return co_await end_generator(std::move(request), rr::CallKind::generator_close);
}

rr::awaitable<rr::OrderedJson> JsonOperations::abort(JsonRequestPtr request, TargetPtr) {
  co_return co_await end_generator(std::move(request), rr::CallKind::generator_abort);
}

}  // namespace rrgate
