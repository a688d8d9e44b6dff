#include "server/gateway/routes.hpp"

#include "server/http/endpoints/access.hpp"
#include "server/http/endpoints/agents.hpp"
#include "server/http/endpoints/audit.hpp"
#include "server/http/endpoints/dashboard.hpp"
#include "server/http/endpoints/devices.hpp"
#include "server/http/endpoints/discovery.hpp"
#include "server/http/endpoints/documentation.hpp"
#include "server/http/endpoints/gateway_document.hpp"
#include "server/http/endpoints/health.hpp"
#include "server/http/endpoints/metrics.hpp"
#include "server/http/endpoints/objects.hpp"
#include "server/http/endpoints/recordings.hpp"
#include "server/http/other_pages.hpp"
#include "server/http/response_writer.hpp"
#include "server/mcp/mcp_endpoint.hpp"

namespace rrgate {

namespace {

/// Of requests to the gateway itself.
constexpr std::size_t largest_body = 8 * 1024;

rr::awaitable<void> answer_with_body(Handler handler, ResponseWriter& writer, std::string rest) {
  auto response = co_await writer.read_body(largest_body);
  if (!response) response = handler(writer.request(), rest);
  if (response->answer_later)
    co_await response->answer_later(writer);
  else
    co_await writer.send(*response);
}

/// For handlers that look at the body.
Handler with_body(Handler handler) {
  return [handler = std::move(handler)](const Request&, std::string_view rest) {
    Response response;
    response.answer_later = [handler, rest = std::string(rest)](ResponseWriter& writer) {
      return answer_with_body(handler, writer, rest);
    };
    return response;
  };
}

}  // namespace

std::vector<Route> list_routes(GatewayState& gateway) {
  using enum http::verb;
  return {
      {get, "/healthz", health_endpoint()},
      {get, "/readyz", ready_endpoint(gateway)},
      {get, "/metrics", metrics_endpoint(gateway)},
      {get, "/api/v1/openapi.json", gateway_document_endpoint(gateway)},
      {get, "/api/v1/devices", devices_endpoint(gateway)},
      {get, "/api/v1/devices/*", objects_endpoint(gateway)},
      {put, "/api/v1/devices/*", objects_endpoint(gateway)},
      {post, "/api/v1/devices/*", objects_endpoint(gateway)},
      {options, "/api/v1/devices", preflight_endpoint()},
      {options, "/api/v1/devices/*", preflight_endpoint()},
      {get, "/api/v1/discovery", discovery_endpoint(gateway)},
      {get, "/api/v1/recordings", recordings_endpoint(gateway)},
      {post, "/api/v1/recordings", with_body(begin_recording_endpoint(gateway))},
      {get, "/api/v1/recordings/*", recording_endpoint(gateway)},
      {post, "/api/v1/recordings/*", with_body(recording_action_endpoint(gateway))},
      {delete_, "/api/v1/recordings/*", delete_recording_endpoint(gateway)},
      {get, "/api/v1/access", who_endpoint(gateway)},
      {get, "/api/v1/audit", audit_endpoint(gateway)},
      {post, "/api/v1/session", sign_in_endpoint(gateway)},
      {delete_, "/api/v1/session", sign_out_endpoint(gateway)},
      {post, "/api/v1/tickets", tickets_endpoint(gateway)},
      {options, "/api/v1/tickets", preflight_endpoint()},
      {post, "/api/v1/access/requests", with_body(ask_endpoint(gateway))},
      {get, "/api/v1/access/requests", requests_endpoint(gateway)},
      {post, "/api/v1/access/requests/*", with_body(request_endpoint(gateway))},
      {get, "/api/v1/agents/approvals", approvals_endpoint(gateway)},
      {post, "/api/v1/agents/approvals/*", with_body(approval_endpoint(gateway))},
      {get, "/api/v1/agents/sessions", agent_sessions_endpoint(gateway)},
      {post, "/api/v1/agents/stop", with_body(stop_agents_endpoint(gateway))},
      {post, std::string(mcp_path), mcp_endpoint(gateway)},
      {delete_, std::string(mcp_path), end_mcp_endpoint(gateway)},
      {get, std::string(mcp_path), mcp_stream_endpoint(gateway)},
      {get, std::string(mcp_metadata_path), mcp_metadata_endpoint(gateway)},
      {get, "/api/*", no_such_api_endpoint()},
      {get, "/devices/*", device_endpoint(gateway)},
      {get, "/docs", to_documentation_endpoint()},
      {get, "/docs/*", documentation_endpoint(gateway)},
      {get, "/*", dashboard_endpoint(gateway)},
  };
}

Router make_routes(GatewayState& gateway) {
  Router router;
  for (auto& route : list_routes(gateway)) router.add(route.method, std::move(route.pattern), std::move(route.handler));
  return router;
}

}  // namespace rrgate
