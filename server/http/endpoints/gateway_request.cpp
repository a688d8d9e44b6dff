#include "server/http/endpoints/gateway_request.hpp"

#include "server/state/gateway_state.hpp"

namespace rrgate {

Response json_answer(unsigned status, const rr::OrderedJson& json) {
  return json_response(status, rr::write_json(json) + "\n");
}

rr::Error bad_request(std::string what) {
  return rr::make_error(rr::ErrorCode::invalid_argument, std::move(what));
}

Response error_answer(const rr::Error& error) {
  switch (error.code) {
    case rr::ErrorCode::invalid_argument:
    case rr::ErrorCode::data_serialization_error:
      return problem_response(400, error.message);
    case rr::ErrorCode::resource_not_found:
      return problem_response(404, error.message);
    case rr::ErrorCode::invalid_state:
      return problem_response(409, error.message);
    case rr::ErrorCode::permission_denied:
      return problem_response(403, error.message);
    case rr::ErrorCode::out_of_system_resource: {
      auto response = problem_response(429, error.message);
      response.set("Retry-After", "60");
      return response;
    }
    default:
      return problem_response(500, error.message);
  }
}

rr::Result<rr::Json> body_of(const Request& request) {
  const auto& text = request.message.body();
  if (text.empty()) return {boost::system::in_place_value, rr::Json::object()};
  const auto type = request.header(http::field::content_type);
  if (!equals_ignoring_case(type.substr(0, type.find(';')), "application/json"))
    return bad_request("Content-Type is " + rr::quote(type) + ", expected application/json");
  auto json = rr::read_json(text);
  if (json && !json->is_object()) return bad_request("expected an object");
  return json;
}

rr::Result<std::string> text_of(const rr::Json& body, const char* key) {
  const auto found = body.find(key);
  if (found == body.end()) return std::string();
  if (!found->is_string()) return bad_request(std::string(key) + " is no string");
  return found->get<std::string>();
}

std::optional<Response> refuse_who_may_not_admin(GatewayState& gateway, const Request& request) {
  const auto allowed = gateway.access().check(request.identity, {.verb = Verb::admin});
  if (allowed) return std::nullopt;
  gateway.reject(allowed.error());
  return gateway.http_access().refusal(request, allowed.error());
}

}  // namespace rrgate
