// Requests that people send to the gateway itself, and what it answers. Layer: server/http/endpoints.
#pragma once

#include <optional>
#include <string>

#include "server/http/request.hpp"
#include "server/json/json.hpp"

namespace rrgate {

class GatewayState;

/// The body as an object; an empty one is {}. JSON alone: a page of another origin can't send that unasked.
/// Errors   invalid_argument, data_serialization_error.
rr::Result<rr::Json> body_of(const Request& request);
/// Empty where it is not there. Errors   invalid_argument: no text.
rr::Result<std::string> text_of(const rr::Json& body, const char* key);

Response json_answer(unsigned status, const rr::OrderedJson& json);
Response error_answer(const rr::Error& error);
/// invalid_argument.
rr::Error bad_request(std::string what);
/// nullopt: he has the right to admin.
std::optional<Response> refuse_who_may_not_admin(GatewayState& gateway, const Request& request);

}  // namespace rrgate
