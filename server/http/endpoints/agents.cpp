#include "server/http/endpoints/agents.hpp"

#include <algorithm>
#include <chrono>

#include "server/http/endpoints/gateway_request.hpp"
#include "server/http/endpoints/leases.hpp"
#include "server/log/log.hpp"
#include "server/state/gateway_state.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

namespace {

using std::chrono::minutes;

std::int64_t seconds_until(Approvals::Time end) {
  return std::max<std::int64_t>(0, std::chrono::ceil<std::chrono::seconds>(end - Approvals::Clock::now()).count());
}

double seconds_from(std::chrono::steady_clock::time_point begin, std::chrono::steady_clock::time_point now) {
  return static_cast<double>(std::chrono::floor<std::chrono::milliseconds>(now - begin).count()) / 1e3;
}

rr::OrderedJson described(const Approval& approval) {
  const auto& command = approval.command;
  return {{"id", approval.id},
          {"user", command.who.name},
          {"client", command.who.client},
          {"device", command.device},
          {"path", command.path},
          {"member", command.member},
          {"verb", std::string(to_string(command.verb))},
          {"values", rr::OrderedJson::parse(command.values)},
          {"why", command.why},
          {"expires_in", seconds_until(approval.ends)}};
}

rr::OrderedJson described(const AgentCommand& command, std::chrono::steady_clock::time_point now) {
  constexpr std::string_view states[] = {"running", "done", "failed"};
  return {{"ago", seconds_from(command.at, now)},
          {"tool", command.tool},
          {"device", command.device},
          {"path", command.path},
          {"values", command.values},
          {"state", std::string(states[static_cast<std::size_t>(command.state)])},
          {"detail", command.detail}};
}

rr::OrderedJson described(const AgentSession& session, std::chrono::steady_clock::time_point now) {
  auto commands = rr::OrderedJson::array();
  for (const auto& each : session.last_commands) commands.push_back(described(*each, now));
  return {{"user", session.user},
          {"client", session.client},
          {"program", session.program},
          {"begun_ago", seconds_from(session.begun, now)},
          {"used_ago", seconds_from(session.used, now)},
          {"ended", session.has_ended},
          {"reads", session.reads},
          {"commands", session.commands},
          {"last_commands", std::move(commands)}};
}

/// Of a body. Errors   invalid_argument.
rr::Result<minutes> minutes_of(const rr::Json& body, int least, minutes most, minutes otherwise) {
  const auto found = body.find("minutes");
  if (found == body.end()) return otherwise;
  if (!found->is_number_integer() || *found < least || *found > most.count())
    return bad_request("minutes: expected " + std::to_string(least) + " to " + std::to_string(most.count()));
  return minutes(found->get<int>());
}

/// What somebody with the right to admin decides is recorded, or is refused.
std::optional<Response> refuse_decision(GatewayState& gateway, const Request& request) {
  if (auto refusal = refuse_who_may_not_admin(gateway, request)) return refusal;
  if (const auto recordable = gateway.access().audit().admit(); !recordable)
    return gateway.http_access().refusal(request, recordable.error());
  return std::nullopt;
}

Response answer_approval(GatewayState& gateway, const Request& request, const std::string& id) {
  const auto body = body_of(request);
  if (!body) return error_answer(body.error());
  const auto answer = text_of(*body, "answer");
  if (!answer) return error_answer(answer.error());
  if (*answer != "once" && *answer != "minutes" && *answer != "deny")
    return error_answer(bad_request("answer is " + rr::quote(*answer) + ", expected once, minutes or deny"));
  const auto grant = minutes_of(*body, 1, Approvals::longest_grant, minutes(1));
  if (!grant) return error_answer(grant.error());
  const bool is_for_some_time = *answer == "minutes";
  if (is_for_some_time && !body->contains("minutes")) return error_answer(bad_request("minutes are missing"));
  const bool is_allowed = *answer != "deny";
  const auto answered = gateway.approvals().answer(id, request.identity, is_allowed,
                                                   is_for_some_time ? *grant : minutes(0), Approvals::Clock::now());
  if (!answered) return error_answer(answered.error());
  const auto what = answered->command.what();
  const auto detail = "for " + answered->command.who.name +
                      (is_for_some_time ? ", for " + std::to_string(grant->count()) + " minutes" : std::string());
  gateway.access().record({.event = is_allowed ? "approval_allowed" : "approval_denied",
                           .who = &request.identity,
                           .what = &what,
                           .detail = detail});
  return json_answer(200, {{"state", is_allowed ? "allowed" : "denied"}});
}

/// When the devices have answered, or need not be waited for any longer.
rr::awaitable<void> answer_stop(GatewayState& gateway, ResponseWriter& writer, Approvals::Stopped stopped) {
  auto devices = rr::OrderedJson::array();
  for (const auto& safe : stopped.answers) {
    co_await safe->wait();
    auto& device = devices.emplace_back(rr::OrderedJson{{"device", safe->device()}});
    device.update(stop_to_json(*safe));
  }
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "ended") = stopped.commands;
  rr::add_key(out, "stopped_for") = seconds_until(gateway.approvals().stopped_until());
  rr::add_key(out, "devices") = std::move(devices);
  const auto response = json_answer(200, out);
  co_await writer.send(response);
}

}  // namespace

Handler approvals_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (auto refusal = refuse_who_may_not_admin(gateway, request)) return std::move(*refusal);
    auto list = rr::OrderedJson::array();
    for (const auto& each : gateway.approvals().list(Approvals::Clock::now())) list.push_back(described(each));
    auto out = rr::OrderedJson::object();
    rr::add_key(out, "approvals") = std::move(list);
    rr::add_key(out, "stopped_for") = seconds_until(gateway.approvals().stopped_until());
    auto response = json_answer(200, out);
    response.set("Cache-Control", "no-store");
    return response;
  };
}

Handler agent_sessions_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (auto refusal = refuse_who_may_not_admin(gateway, request)) return std::move(*refusal);
    auto list = rr::OrderedJson::array();
    const auto now = std::chrono::steady_clock::now();
    for (const auto& each : gateway.agent_sessions().list()) list.push_back(described(*each, now));
    auto out = rr::OrderedJson::object();
    rr::add_key(out, "sessions") = std::move(list);
    auto response = json_answer(200, out);
    response.set("Cache-Control", "no-store");
    return response;
  };
}

Handler approval_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view rest) {
    if (auto refusal = refuse_decision(gateway, request)) return std::move(*refusal);
    return answer_approval(gateway, request, std::string(rest));
  };
}

Handler stop_agents_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (auto refusal = refuse_who_may_not_admin(gateway, request)) return std::move(*refusal);
    const auto body = body_of(request);
    if (!body) return error_answer(body.error());
    const auto time = minutes_of(*body, 0, Approvals::longest_stop, minutes(10));
    if (!time) return error_answer(time.error());
    const auto now = Approvals::Clock::now();
    const auto stopped = gateway.approvals().stop(*time, now);
    const auto left = std::chrono::ceil<minutes>(gateway.approvals().stopped_until() - now).count();
    log(LogLevel::warning, "agents stopped", {{"user", request.identity.name}, {"minutes", left}});
    const auto detail = std::to_string(stopped.commands) + " commands ended, for " + std::to_string(left) + " minutes";
    gateway.access().record({.event = "agents_stopped", .who = &request.identity, .detail = detail});
    Response response;
    response.answer_later = [&gateway, stopped](ResponseWriter& writer) {
      return answer_stop(gateway, writer, stopped);
    };
    return response;
  };
}

}  // namespace rrgate
