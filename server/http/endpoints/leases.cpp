#include "server/http/endpoints/leases.hpp"

#include <boost/asio/post.hpp>

#include "core/support/random.hpp"
#include "core/support/whole_number.hpp"
#include "server/http/endpoints/refusal.hpp"
#include "server/state/http_access.hpp"
#include "server/upstream/lease_table.hpp"

namespace rrgate {

namespace {

/// More leases than that are nobody's wish: each is a client of a device.
constexpr std::size_t max_lease_holders = 256;

milliseconds read_deadman(const ObjectRequest& request) {
  const auto text = request.option("deadman").value_or("");
  const auto number = rr::whole_number<std::int64_t>(text);
  if (!number) refuse(rr::ErrorCode::invalid_argument, "deadman is " + rr::quote(text) + ", expected milliseconds");
  return milliseconds(*number);
}

/// The key of a client that holds the lease.
rr::awaitable<std::string> acquire(const ObjectRequest& request, const Target& target, rr::LockCommand command) {
  auto& gateway = request.gateway();
  const auto deadman = read_deadman(request);
  if (gateway.lease_holders().size() >= max_lease_holders)
    refuse(rr::ErrorCode::out_of_system_resource, "too many leases are held by HTTP already");
  auto asker = target.client;
  auto who = request.request().identity;
  auto path = target.path();
  const auto holder = co_await hold_lease(gateway, std::move(asker), std::move(who), std::move(path), command, deadman,
                                          LeaseNeeds::right_to_lock);
  auto key = rr::format_node_id(rr::random_node_id(), rr::NodeIdFormat::dashes);
  gateway.lease_holders().emplace(key, GatewayState::LeaseHolder{holder, std::string(request.request().path())});
  holder->on_lease_ended([&gateway, key, executor = holder->upstream()->device().executor()](const auto&, const auto&) {
    boost::asio::post(executor, [&gateway, key] { gateway.lease_holders().erase(key); });  // not within its own call
  });
  co_return key;
}

}  // namespace

rr::awaitable<std::shared_ptr<ValueClient>> hold_lease(GatewayState& gateway, std::shared_ptr<ValueClient> asker,
                                                       Identity who, std::string path, rr::LockCommand command,
                                                       milliseconds deadman, LeaseNeeds needs) {
  const UpstreamClient& shared = *asker;
  const auto user = who.is_proven() ? who.subject() : shared.lock_user();
  const auto holder = value_or_throw(gateway.clients().make_another(asker->upstream(), user));
  holder->set_standing(std::make_shared<Standing>(gateway.access(), std::move(who)),
                       needs == LeaseNeeds::right_to_lock);
  co_await holder->lock(command, std::move(path), deadman);
  co_return holder;
}

rr::OrderedJson stop_to_json(const SafeAnswer& safe) {
  auto out = rr::OrderedJson::object();
  const auto& result = safe.result();
  rr::add_key(out, !result ? "sent" : *result ? "stopped" : "refused") = safe.path();
  if (!result) rr::add_key(out, "unanswered") = unanswered_stop;
  if (result && !*result) out.update(rr::error_to_json(result->error(), {}));
  return out;
}

bool takes_lease(const Request& request) {
  const auto what = rr::query_value(request.query(), "lease");
  return what == "acquire" || what == "take";
}

std::optional<std::string_view> lease_event(const ObjectRequest& request, const Target& target) {
  const auto what = target.member ? std::nullopt : request.option("lease");
  if (!what) return "";
  if (*what == "acquire" || *what == "take") return "lease";
  return std::nullopt;
}

bool releases_own_lease(const ObjectRequest& request, const Target& target) {
  return !target.member && request.method() == http::verb::post && request.option("lease") == "release" &&
         target.client->has_lock(target.path());
}

bool shows_own_lease(GatewayState& gateway, const Request& request) {
  const auto holder = gateway.lease_holders().find(request.header(lease_header));
  return holder != gateway.lease_holders().end() && holder->second.url_path == request.path() &&
         rr::query_value(request.query(), "lease") == "release";
}

rr::awaitable<Response> answer_lease(const ObjectRequest& request, const Target& target) {
  if (request.method() != http::verb::post) co_return request.method_response("POST");
  const auto what = request.option("lease").value_or("");
  if (what == "acquire" || what == "take") {
    const auto command = what == "take" ? rr::LockCommand::take_lease : rr::LockCommand::acquire_lease;
    auto json = rr::OrderedJson::object();
    rr::add_key(json, "lease") = co_await acquire(request, target, command);
    co_return co_await request.value_response(json);
  }
  if (what != "renew" && what != "release")
    refuse(rr::ErrorCode::invalid_argument,
           "lease is " + rr::quote(what) + ", expected acquire, take, renew or release");
  auto path = target.path();
  const auto command = what == "renew" ? rr::LockCommand::renew_lease : rr::LockCommand::release_lease;
  co_await target.client->lock(command, path);
  const auto safe = what == "release" ? target.client->safe_answer() : nullptr;
  if (safe) co_await safe->wait();
  if (!safe || (safe->result() && *safe->result())) co_return request.written_response();
  if (safe->result()) throw rr::Exception(safe->result()->error());
  auto told = stop_to_json(*safe);
  auto response = co_await request.value_response(std::move(told));
  response.status = 202;
  co_return response;
}

}  // namespace rrgate
