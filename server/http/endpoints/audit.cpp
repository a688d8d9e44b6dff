#include "server/http/endpoints/audit.hpp"

#include "core/session/url.hpp"
#include "core/support/whole_number.hpp"
#include "server/access/audit_tail.hpp"
#include "server/http/endpoints/gateway_request.hpp"
#include "server/http/response_writer.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

namespace {

constexpr std::size_t most_records = 1000;
constexpr std::size_t longest_audit_pattern = 256;
/// What was done just now is told too, unless the disk is slower.
constexpr std::chrono::milliseconds flush_patience{200};

struct AuditQuestion {
  AuditFilter filter = {};
  std::size_t limit = 100;
};

/// Errors   invalid_argument.
rr::Result<AuditQuestion> read_question(std::string_view query) {
  AuditQuestion out;
  for (const auto& [name, into] : {std::pair("user", &out.filter.user), std::pair("device", &out.filter.device)}) {
    *into = rr::query_value(query, name).value_or("");
    if (into->size() > longest_audit_pattern)
      return bad_request(std::string(name) + " has " + std::to_string(into->size()) + " bytes, expected at most " +
                         std::to_string(longest_audit_pattern));
  }
  if (const auto text = rr::query_value(query, "limit")) {
    out.limit = rr::whole_number<std::size_t>(*text).value_or(0);
    if (out.limit < 1 || out.limit > most_records)
      return bad_request("limit is " + rr::quote(*text) + ", expected a whole number from 1 to " +
                         std::to_string(most_records));
  }
  return out;
}

std::string audit_json(bool is_enabled, const AuditTail& tail) {
  std::string out = is_enabled ? R"({"enabled":true,"records":[)" : R"({"enabled":false,"records":[)";
  for (const auto& record : tail.records) out.append(out.back() == '[' ? "" : ",").append(record);
  return out.append(tail.is_all ? "],\"all\":true}\n" : "],\"all\":false}\n");
}

Response audit_response(bool is_enabled, const AuditTail& tail) {
  auto response = json_response(200, audit_json(is_enabled, tail));
  response.set("Cache-Control", "no-store");
  return response;
}

rr::awaitable<void> answer_audit(GatewayState& gateway, ResponseWriter& writer, AuditQuestion question) {
  auto& log = gateway.access().audit();
  const auto config = gateway.access().state().config.audit;
  const auto read = [&] {
    log.flush(flush_patience);
    return read_audit_tail(config, question.filter, question.limit);
  };
  const auto tail = co_await gateway.workers().run(read);
  Response response;
  if (tail)
    response = audit_response(true, *tail);
  else
    response = error_answer(tail.error());
  co_await writer.send(response);
}

}  // namespace

Handler audit_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (auto refusal = refuse_who_may_not_admin(gateway, request)) return std::move(*refusal);
    const auto question = read_question(request.query());
    if (!question) return error_answer(question.error());
    if (!gateway.access().audit().is_used()) return audit_response(false, {});
    Response response;
    response.answer_later = [&gateway, question = *question](ResponseWriter& writer) {
      return answer_audit(gateway, writer, question);
    };
    return response;
  };
}

}  // namespace rrgate
