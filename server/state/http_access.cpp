#include "server/state/http_access.hpp"

#include "core/session/url.hpp"
#include "core/support/words.hpp"
#include "node/http/foreign_page.hpp"
#include "node/http/upgrade.hpp"
#include "server/http/sign_in_cookie.hpp"
#include "server/json/json.hpp"
#include "server/limits/client_network.hpp"
#include "server/state/agent_login.hpp"
#include "server/state/connection.hpp"

namespace rrgate {

namespace {

rr::Error refused(std::string why) {
  return rr::make_error(rr::ErrorCode::authentication_error, std::move(why));
}

/// Anonymous where no proxy that is trusted says more.
/// Errors   invalid_argument: a header that came twice. One may be the client's, and nobody knows which.
rr::Result<Identity> by_proxy(const Request& request, const Connection& connection, const Config& config) {
  const auto& headers = config.access.identity_headers;
  Identity out;
  if (headers.user.empty() || !config.proxy.trust.trusts(connection.peer.endpoint.address())) return out;
  for (const auto* name : {&headers.user, &headers.roles})
    if (const auto count = name->empty() ? 0 : request.message.count(*name); count > 1)
      return rr::make_error(rr::ErrorCode::invalid_argument,
                            "header " + rr::quote(*name) + " came " + std::to_string(count) +
                                " times, expected it once: the proxy has to take away what clients put there");
  out.name = request.header(headers.user);
  if (out.name.empty()) return out;
  if (!headers.roles.empty())
    for (const auto role : rr::split_words(request.header(headers.roles), ", |\t")) out.roles.emplace_back(role);
  out.proof = Proof::proxy;
  return out;
}

}  // namespace

rr::awaitable<rr::Result<Identity>> HttpAccess::identify(const Request& request, const Connection& connection,
                                                         const Config& config) {
  const auto& client = request.arrival.peer;
  const auto face = request.identity.face;
  const auto proven = [this, &client, face](Identity identity) {
    identity.client = client;
    identity.face = face;
    return access_.with_grants(std::move(identity));
  };
  if (access_.is_open()) co_return access_.anonymous(client, face);
  auto told = by_proxy(request, connection, config);
  if (!told) co_return told.error();
  if (told->is_proven()) co_return proven(std::move(*told));
  std::string header(request.header(http::field::authorization));
  auto from = request.origin();
  auto shown = co_await by_authorization(std::move(header), std::move(from));
  if (!shown || shown->is_proven()) co_return shown;
  if (asks_for_websocket(request))
    if (const auto ticket = rr::query_value(request.query(), "ticket")) {
      auto identity = access_.tickets().redeem(*ticket, std::chrono::system_clock::now());
      if (!identity) co_return refused("the ticket is unknown, was used, or is older than 30 seconds");
      identity->client = client;
      identity->face = face;
      identity = co_await renew(std::move(*identity));
      if (!identity) co_return refused("what the ticket was given for was revoked or has expired");
      co_return std::move(*identity);
    }
  if (is_from_own_page(request))
    if (auto found = access_.sign_ins().find(sign_in_cookie(request), std::chrono::system_clock::now())) {
      found->client = client;
      found->face = face;
      auto renewed = co_await renew(std::move(*found));
      if (renewed) co_return std::move(*renewed);
    }
  if (connection.identity.proof == Proof::certificate)
    if (auto certified = access_.renew(connection.identity)) {
      certified->client = client;
      certified->face = face;
      co_return std::move(*certified);
    }
  co_return access_.anonymous(client, face);
}

rr::awaitable<std::optional<Identity>> HttpAccess::renew(Identity who) {
  const auto& jwt = access_.state().jwt;
  if (who.proof == Proof::oidc && jwt && !jwt->knows(who.credential)) co_await issuer_keys_.look_anew();
  co_return access_.renew(who);
}

rr::awaitable<rr::Result<Identity>> HttpAccess::by_authorization(std::string header, ClientOrigin from) {
  const auto nobody = access_.anonymous(from.client, from.face);
  const auto bearer = credentials_of(header, "Bearer");
  if (bearer && access_.state().jwt && access_.state().jwt->misses_key_of(*bearer)) co_await issuer_keys_.look_anew();
  const auto& state = access_.state();
  if (bearer && (state.tokens || state.jwt)) {
    auto identity = by_token(*bearer);
    if (!identity) {
      access_.record_refusal(
          {.event = "login_failed", .who = &nobody, .detail = identity.error().message, .outcome = Outcome::refused});
      co_return identity.error();
    }
    identity->client = from.client;
    identity->face = from.face;
    co_return access_.with_grants(std::move(*identity));
  }
  if (!state.users) co_return nobody;
  auto basic = basic_credentials(header);
  if (!basic) co_return basic.error();
  if (!*basic) co_return nobody;
  co_return co_await by_password(std::move(**basic), std::move(from));
}

rr::Result<Identity> HttpAccess::by_token(std::string_view token) const {
  const auto now = std::chrono::system_clock::now();
  const auto& state = access_.state();
  if (state.jwt && (looks_like_jwt(token) || !state.tokens)) return state.jwt->verify(token, now);
  return state.tokens->verify(token, now);
}

rr::awaitable<rr::Result<Identity>> HttpAccess::by_password(BasicCredentials credentials, ClientOrigin from) {
  rr::LoginAttempt attempt;
  attempt.username = std::move(credentials.username);
  attempt.credentials.items.emplace_back("password", rr::Value(std::string_view(credentials.password)));
  const auto client = from.client;
  const auto face = from.face;
  const auto user = co_await logins_.judge(std::move(attempt), std::move(from), Logins::Of::request);
  if (!user) co_return user.error();
  co_return access_.logged_in(*user, client, face);
}

Response HttpAccess::refusal(const Request& request, const rr::Error& error) const {
  const auto& state = access_.state();
  const bool has_challenge = state.users || state.tokens || state.jwt;
  const bool helps = error.code == rr::ErrorCode::authentication_error || !request.identity.is_proven();
  unsigned status = has_challenge && helps ? 401 : 403;
  if (error.code == rr::ErrorCode::out_of_system_resource) status = 503;
  if (error.code == rr::ErrorCode::invalid_argument) status = 400;
  auto problem = rr::OrderedJson::object();
  const auto name = std::string(error_code_name(error.code));
  rr::add_key(problem, "type") = "about:blank";
  rr::add_key(problem, "title") = name;
  rr::add_key(problem, "status") = status;
  rr::add_key(problem, "detail") = error.message;
  rr::add_key(problem, "error") = {{"name", error.qualified_name()}, {"message", error.message}};
  auto response = text_response(status, "application/problem+json", rr::write_json(problem) + "\n");
  response.set("Cache-Control", "no-store");
  // Clients of agents look at the first alone.
  if (status == 401 && (state.tokens || state.jwt)) {
    std::string challenge = "Bearer realm=\"rrgate\"";
    if (request.path() == mcp_path && state.config.jwt.discovers && !origin_of(request).empty())
      challenge += ", resource_metadata=\"" + origin_of(request) + std::string(mcp_metadata_path) + "\"";
    response.set("WWW-Authenticate", std::move(challenge));
  }
  if (status == 401 && state.users && request.header("X-Requested-With").empty())
    response.set("WWW-Authenticate", "Basic realm=\"rrgate\", charset=\"UTF-8\"");
  if (status == 503) response.set("Retry-After", "2");
  return response;
}

Response HttpAccess::refuse_too_much(const Identity& who, const AccessRequest* what, const std::string& of) {
  const auto why = "too many requests " + of;
  access_.record_too_much(who, what, why);
  auto response = problem_response(429, why + "; try again in a second");
  response.set("Retry-After", "1");
  return response;
}

rr::awaitable<HttpAccess::Admitted> HttpAccess::admit(Request& request, const Connection& connection,
                                                      const Config& config,
                                                      std::function<bool(const Identity&)> passes) {
  Admitted out;
  const auto network = network_name(request.arrival.address);
  const auto& of_client = config.rates.client;
  out.client = clients_.enter(network, of_client.per_second, of_client.at_once, std::chrono::steady_clock::now());
  if (!out.client) request.too_much = "from " + network;
  if (!out.client && !passes) {
    request.identity.client = request.arrival.peer;
    out.refusal = refuse_too_much(request.identity, nullptr, request.too_much);
    co_return out;
  }
  const auto& of_user = config.rates.user;
  auto identity = co_await identify(request, connection, config);
  if (!identity) {
    out.refusal = refusal(request, identity.error());
    co_return out;
  }
  request.identity = std::move(*identity);
  if (request.identity.is_proven()) {
    out.user = users_.enter(request.identity.subject().key(), of_user.per_second, of_user.at_once,
                            std::chrono::steady_clock::now());
    if (!out.user && request.too_much.empty()) request.too_much = "of " + rr::quote(request.identity.name);
  }
  if (!request.too_much.empty() && !(passes && passes(request.identity)))
    out.refusal = refuse_too_much(request.identity, nullptr, request.too_much);
  co_return out;
}

std::string HttpAccess::renewed_cookie(const Request& request) const {
  if (request.identity.sign_in.empty()) return {};
  const auto next = access_.sign_ins().extend(sign_in_cookie(request), std::chrono::system_clock::now());
  return next ? format_sign_in_cookie(request.arrival, *next) : std::string();
}

std::optional<RateGate::Pass> HttpAccess::enter_device(const std::string& device, const Rates& rates) {
  return devices_.enter(device, rates.device.per_second, rates.device.at_once, std::chrono::steady_clock::now());
}

namespace {

std::string to_text(const RateLimit& limit) {
  std::string out;
  if (limit.per_second > 0) out = std::to_string(limit.per_second) + " requests a second";
  if (limit.at_once > 0) out += (out.empty() ? "" : " or ") + std::to_string(limit.at_once) + " at once";
  return out;
}

}  // namespace

rr::Result<std::shared_ptr<const HttpAccess::Passes>> HttpAccess::enter(const std::string& network, const Subject& user,
                                                                        const std::string& device, const Rates& rates) {
  if (!rates.is_bound()) return std::shared_ptr<const Passes>();
  const auto now = std::chrono::steady_clock::now();
  const auto refused = [](const RateLimit& limit, const std::string& what) {
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "asked for more than " + to_text(limit) + " " + what + "; try again in a second");
  };
  auto out = std::make_shared<Passes>();
  out->client = clients_.enter(network, rates.client.per_second, rates.client.at_once, now);
  if (!out->client) return refused(rates.client, "from " + network);
  if (!user.is_nobody()) {
    out->user = users_.enter(user.key(), rates.user.per_second, rates.user.at_once, now);
    if (!out->user) return refused(rates.user, "of " + rr::quote(user.name));
  }
  if (!device.empty()) {
    out->device = enter_device(device, rates);
    if (!out->device) return refused(rates.device, "to device " + rr::quote(device));
  }
  return std::shared_ptr<const Passes>(std::move(out));
}

}  // namespace rrgate
