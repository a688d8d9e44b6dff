#include "server/http/endpoints/access.hpp"

#include <algorithm>

#include "core/session/url.hpp"
#include "node/http/foreign_page.hpp"
#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"
#include "node/tls/base64.hpp"
#include "server/access/access_text.hpp"
#include "server/access/api_tokens.hpp"
#include "server/http/endpoints/gateway_request.hpp"
#include "server/http/response_writer.hpp"
#include "server/http/sign_in_cookie.hpp"
#include "server/json/json.hpp"
#include "server/limits/client_network.hpp"
#include "server/log/log.hpp"
#include "server/state/gateway_state.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

namespace {

using Json = rr::OrderedJson;
using Clock = std::chrono::system_clock;

/// Writes a new token into the tokens file, and has it read. Returns it.
rr::Result<std::string> add_token(GatewayState& gateway, const std::string& name, const std::vector<std::string>& roles,
                                  std::optional<std::chrono::sys_days> last_day) {
  const auto& file = gateway.access().state().config.tokens_file;
  if (file.empty())
    return rr::make_error(rr::ErrorCode::invalid_state, "the gateway has no tokens_file that a token could go into");
  const auto text = read_text_file(file);
  if (!text) return rr::make_error(rr::ErrorCode::io_error, "the tokens file can't be read");
  if (!find_line(*text, name).empty())
    return rr::make_error(rr::ErrorCode::invalid_state, "there is a token of the name " + rr::quote(name) + " already");
  auto token = make_api_token();
  const auto line =
      name + " " + hash_api_token(token) + " " + format_roles(roles) + " " + (last_day ? format_day(*last_day) : "_");
  if (auto done = rr::write_secret(file, with_line(*text, name, line), true); !done) return done.error();
  gateway.access().reload(false);
  return token;
}

Response approve(GatewayState& gateway, const Request& request, const std::string& id) {
  const auto body = body_of(request);
  if (!body) return error_answer(body.error());
  std::vector<std::string> roles;
  if (const auto found = body->find("roles"); found != body->end()) {
    if (!found->is_array()) return error_answer(bad_request("roles is no array"));
    for (const auto& role : *found) {
      if (!role.is_string()) return error_answer(bad_request("a role is no string"));
      if (auto checked = check_name("role", role.get<std::string>()); !checked) return error_answer(checked.error());
      roles.push_back(role.get<std::string>());
    }
  }
  std::optional<std::chrono::sys_days> last_day;
  if (const auto days = body->find("days"); days != body->end()) {
    if (!days->is_number_integer() || *days < 1 || *days > 36500)
      return error_answer(bad_request("days: expected 1 to 36500"));
    last_day = std::chrono::floor<std::chrono::days>(Clock::now()) + std::chrono::days(days->get<int>());
  }
  auto& requests = gateway.http_access().requests();
  const auto pending = requests.find_pending(id, Clock::now());
  if (!pending) return error_answer(pending.error());
  auto token = add_token(gateway, pending->name, roles, last_day);
  if (!token) return error_answer(token.error());
  requests.decide(id, std::move(*token));
  const auto detail = pending->name + " of " + pending->client + ": roles " + format_roles(roles) + ", until " +
                      (last_day ? format_day(*last_day) : "it is deleted");
  gateway.access().record({.event = "approved", .who = &request.identity, .detail = detail});
  return json_answer(200, {{"state", "approved"}});
}

Response deny(GatewayState& gateway, const Request& request, const std::string& id) {
  auto& requests = gateway.http_access().requests();
  const auto pending = requests.find_pending(id, Clock::now());
  if (!pending) return error_answer(pending.error());
  requests.decide(id, {});
  const auto detail = pending->name + " of " + pending->client;
  gateway.access().record({.event = "denied", .who = &request.identity, .detail = detail});
  return json_answer(200, {{"state", "denied"}});
}

Response claim(GatewayState& gateway, const Request& request, const std::string& id) {
  const auto body = body_of(request);
  if (!body) return error_answer(body.error());
  const auto secret = text_of(*body, "secret");
  if (!secret) return error_answer(secret.error());
  const auto found = gateway.http_access().requests().claim(id, *secret, Clock::now());
  if (!found) return error_answer(found.error());
  Json out{{"state", std::string(to_string(found->state))}};
  if (!found->token.empty()) out["token"] = found->token;
  return json_answer(200, out);
}

/// The header that says the same as the body. Errors   invalid_argument.
rr::Result<std::string> authorization_of(const Request& request) {
  const auto body = body_of(request);
  if (!body) return body.error();
  const auto user = text_of(*body, "user");
  const auto password = text_of(*body, "password");
  const auto token = text_of(*body, "token");
  for (const auto* text : {&user, &password, &token})
    if (!*text) return text->error();
  if (token->empty() == user->empty()) return bad_request("expected either user and password, or token");
  if (!token->empty()) return "Bearer " + *token;
  if (user->find(':') != std::string::npos) return bad_request("a name has no colon");
  return "Basic " + rr::encode_base64(rr::as_bytes(*user + ":" + *password));
}

rr::awaitable<Response> judge_sign_in(GatewayState& gateway, const Request& request) {
  const auto& http_access = gateway.http_access();
  auto who = request.identity;
  if (!request.message.body().empty()) {
    auto header = authorization_of(request);
    if (!header) co_return error_answer(header.error());
    auto from = request.origin();
    auto shown = co_await gateway.http_access().by_authorization(std::move(*header), std::move(from));
    if (!shown) co_return http_access.refusal(request, shown.error());
    who = std::move(*shown);
  }
  if (gateway.access().is_open()) co_return problem_response(409, "everybody may do everything here");
  if (!request.message.body().empty() && !who.is_proven())
    co_return problem_response(
        409, "the gateway takes no such proof: passwords need a users_file, tokens a tokens_file or jwt");
  if (!who.is_proven() || !who.sign_in.empty()) {
    const auto error = rr::make_error(rr::ErrorCode::authentication_error, "a sign-in needs a password or a token");
    co_return http_access.refusal(request, error);
  }
  if (who.proof != Proof::password && who.proof != Proof::token && who.proof != Proof::jwt && who.proof != Proof::oidc)
    co_return problem_response(409, "a certificate or a proxy identifies you in each request already");
  const auto now = Clock::now();
  const auto cookie = gateway.access().sign_ins().begin(who, now);
  if (!cookie) co_return problem_response(409, "you have more roles than a cookie can name");
  // Else a late response to a request of the former user could renew his cookie over this one.
  if (const auto former = gateway.access().sign_ins().find(sign_in_cookie(request), now))
    if (!gateway.access().sign_out(*former))
      co_return problem_response(503, "too many have signed out; try again later");
  gateway.access().record({.event = "signed_in", .who = &who});
  const auto left = std::min(Clock::duration(SignIns::lifetime), who.ends - now);
  auto response = json_answer(201, {{"user", who.name},
                                    {"roles", who.roles},
                                    {"expires_in", std::chrono::duration_cast<std::chrono::seconds>(left).count()}});
  response.set("Set-Cookie", format_sign_in_cookie(request.arrival, *cookie));
  co_return response;
}

rr::awaitable<void> answer_sign_in(GatewayState& gateway, ResponseWriter& writer) {
  constexpr std::size_t largest_body = 16 * 1024;  // a JSON Web Token
  auto response = co_await writer.read_body(largest_body);
  if (!response) response = co_await judge_sign_in(gateway, writer.request());
  co_await writer.send(*response);
}

/// Of the devices that somebody sees, by their names: of how much of each he may do what.
Json rights_to_devices(GatewayState& gateway, const Identity& who) {
  auto out = Json::object();
  const auto& access = gateway.access();
  for (const auto& device : gateway.devices().all()) {
    const auto& name = device->config().name;
    if (!access.sees(who, name)) continue;
    auto& rights = rr::add_key(out, name) = Json::object();
    for (const auto verb : all_verbs) {
      if (!is_device_verb(verb)) continue;
      const auto extent = access.state().rules.extent(who, name, verb);
      if (extent != Extent::none) rr::add_key(rights, to_string(verb)) = std::string(to_string(extent));
    }
  }
  return out;
}

/// Pages of allowed origins show who they are themselves.
std::optional<Response> refuse_other_page(const Request& request) {
  if (request.message.count(http::field::origin) == 0 || is_from_own_page(request)) return std::nullopt;
  return problem_response(403, "signing in and out is for the gateway's own page");
}

}  // namespace

Handler sign_in_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (auto refusal = refuse_other_page(request)) return std::move(*refusal);
    Response response;
    response.answer_later = [&gateway](ResponseWriter& writer) { return answer_sign_in(gateway, writer); };
    return response;
  };
}

Handler sign_out_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (auto refusal = refuse_other_page(request)) return std::move(*refusal);
    auto& access = gateway.access();
    const auto who = access.sign_ins().find(sign_in_cookie(request), Clock::now());
    Response response;
    response.status = 204;
    if (who && !access.sign_out(*who)) response = problem_response(503, "too many have signed out; the cookie is gone");
    response.set("Set-Cookie", format_sign_in_cookie(request.arrival, {}));
    return response;
  };
}

Handler who_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    const auto& who = request.identity;
    const auto& access = gateway.access();
    const auto devices = rr::query_value(request.query(), "devices").value_or("true");
    if (devices != "true" && devices != "false")
      return error_answer(bad_request("devices is " + rr::quote(devices) + ", expected true or false"));
    Json out;
    out["user"] = nullptr;
    if (who.is_proven()) out["user"] = who.name;
    out["roles"] = who.roles;
    out["proof"] = std::string(to_string(who.proof));
    out["login"] = !access.is_open();
    out["requests"] = !access.state().config.tokens_file.empty();
    out["session"] = !who.sign_in.empty();
    out["admin"] = !access.is_open() && access.state().rules.check(who, {.verb = Verb::admin}).has_value();
    out["expires_in"] = nullptr;
    if (who.ends != Identity::never)
      out["expires_in"] =
          std::max<std::int64_t>(0, std::chrono::floor<std::chrono::seconds>(who.ends - Clock::now()).count());
    auto& may = out["may"] = Json::array();
    for (const auto verb : {Verb::metrics, Verb::admin})
      if (access.state().rules.check(who, {.verb = verb})) may.push_back(std::string(to_string(verb)));
    if (devices == "true") out["devices"] = rights_to_devices(gateway, who);
    auto response = json_answer(200, out);
    response.set("Cache-Control", "no-store");
    return response;
  };
}

Handler tickets_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    auto& http_access = gateway.http_access();
    if (!request.identity.is_proven() && !gateway.access().is_open())
      return http_access.refusal(
          request, rr::make_error(rr::ErrorCode::authentication_error, "only an authenticated client gets a ticket"));
    const auto ticket = gateway.access().tickets().issue(request.identity, Clock::now());
    if (!ticket) return problem_response(409, "you have more roles than a ticket can name");
    return json_answer(201, {{"ticket", *ticket}, {"expires_in", Tickets::lifetime.count()}});
  };
}

Handler ask_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (gateway.access().state().config.tokens_file.empty())
      return problem_response(409, "requests for access are not possible: the gateway has no tokens_file");
    const auto body = body_of(request);
    if (!body) return error_answer(body.error());
    const auto name = text_of(*body, "name");
    const auto reason = text_of(*body, "reason");
    if (!name || !reason) return error_answer(name ? reason.error() : name.error());
    const auto asked = gateway.http_access().requests().ask(*name, *reason, request.arrival.peer,
                                                            network_name(request.arrival.address), Clock::now());
    if (!asked) return error_answer(asked.error());
    log(LogLevel::info, "access asked for", {{"name", *name}, {"peer", request.arrival.peer}, {"reason", *reason}});
    gateway.access().record({.event = "asked", .who = &request.identity, .detail = *name});
    const auto lifetime = std::chrono::seconds(AccessRequests::lifetime).count();
    return json_answer(202, {{"id", asked->id}, {"secret", asked->secret}, {"expires_in", lifetime}});
  };
}

Handler requests_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (auto refusal = refuse_who_may_not_admin(gateway, request)) return std::move(*refusal);
    auto list = Json::array();
    for (const auto& each : gateway.http_access().requests().list(Clock::now()))
      list.push_back({{"id", each.id},
                      {"name", each.name},
                      {"reason", each.reason},
                      {"client", each.client},
                      {"state", std::string(to_string(each.state))},
                      {"asked", Clock::to_time_t(each.asked)}});
    Json out;
    out["requests"] = std::move(list);
    return json_answer(200, out);
  };
}

Handler request_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view rest) {
    const auto slash = rest.find('/');
    const std::string id(rest.substr(0, slash));
    const auto what = slash == std::string_view::npos ? std::string_view() : rest.substr(slash + 1);
    if (std::find(request_actions.begin(), request_actions.end(), what) == request_actions.end())
      return problem_response(404, "expected .../requests/ID/approve, deny or claim");
    if (what == "claim") return claim(gateway, request, id);
    if (auto refusal = refuse_who_may_not_admin(gateway, request)) return std::move(*refusal);
    if (const auto recordable = gateway.access().audit().admit(); !recordable)
      return gateway.http_access().refusal(request, recordable.error());
    return what == "approve" ? approve(gateway, request, id) : deny(gateway, request, id);
  };
}

}  // namespace rrgate
