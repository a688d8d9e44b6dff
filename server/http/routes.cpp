#include "server/http/routes.hpp"

#include "server/http/endpoints/access.hpp"
#include "server/http/endpoints/dashboard.hpp"
#include "server/http/endpoints/devices.hpp"
#include "server/http/endpoints/discovery.hpp"
#include "server/http/endpoints/gateway_document.hpp"
#include "server/http/endpoints/health.hpp"
#include "server/http/endpoints/metrics.hpp"
#include "server/http/endpoints/objects.hpp"

namespace rrgate {

Router make_routes(Gateway& gateway) {
  Router router;
  router.add(http::verb::get, "/healthz", health_endpoint());
  router.add(http::verb::get, "/readyz", ready_endpoint(gateway));
  router.add(http::verb::get, "/metrics", metrics_endpoint(gateway));
  router.add(http::verb::get, "/api/v1/openapi.json", gateway_document_endpoint(gateway));
  router.add(http::verb::get, "/api/v1/devices", devices_endpoint(gateway));
  for (const auto method : {http::verb::get, http::verb::put, http::verb::post, http::verb::options})
    router.add(method, "/api/v1/devices/*", objects_endpoint(gateway));
  router.add(http::verb::get, "/api/v1/discovery", discovery_endpoint(gateway));
  router.add(http::verb::get, "/api/v1/access", who_endpoint(gateway));
  router.add(http::verb::post, "/api/v1/tickets", tickets_endpoint(gateway));
  router.add(http::verb::post, "/api/v1/access/requests", ask_endpoint(gateway));
  router.add(http::verb::get, "/api/v1/access/requests", requests_endpoint(gateway));
  router.add(http::verb::post, "/api/v1/access/requests/*", request_endpoint(gateway));
  router.add(http::verb::get, "/api/*", no_such_api_endpoint());
  router.add(http::verb::get, "/devices/*", device_endpoint(gateway));
  router.add(http::verb::get, "/*", dashboard_endpoint(gateway));
  return router;
}

}  // namespace rrgate
