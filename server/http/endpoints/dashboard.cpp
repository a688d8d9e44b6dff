#include "server/http/endpoints/dashboard.hpp"

#include "server/http/static_files.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

Handler dashboard_endpoint(GatewayState& gateway) {
  auto files = std::make_shared<StaticFiles>(gateway.config().web_root);
  return [files](const Request& request, std::string_view path) { return files->answer(request, path); };
}

}  // namespace rrgate
