#include "server/http/endpoints/routes.hpp"

#include "server/http/endpoints/access.hpp"
#include "server/http/endpoints/dashboard.hpp"
#include "server/http/endpoints/devices.hpp"
#include "server/http/endpoints/discovery.hpp"
#include "server/http/endpoints/documentation.hpp"
#include "server/http/endpoints/gateway_document.hpp"
#include "server/http/endpoints/health.hpp"
#include "server/http/endpoints/metrics.hpp"
#include "server/http/endpoints/objects.hpp"

namespace rrgate {

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
      {options, "/api/v1/devices/*", objects_endpoint(gateway)},
      {get, "/api/v1/discovery", discovery_endpoint(gateway)},
      {get, "/api/v1/access", who_endpoint(gateway)},
      {post, "/api/v1/tickets", tickets_endpoint(gateway)},
      {post, "/api/v1/access/requests", ask_endpoint(gateway)},
      {get, "/api/v1/access/requests", requests_endpoint(gateway)},
      {post, "/api/v1/access/requests/*", request_endpoint(gateway)},
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
