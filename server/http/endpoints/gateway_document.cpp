#include "server/http/endpoints/gateway_document.hpp"

#include "server/http/endpoints/device_documents.hpp"
#include "server/http/endpoints/gateway_openapi.hpp"
#include "server/http/etag.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

namespace {

/// What every operation may answer before anybody knows that it is meant: no request, or too large or too slow a one,
/// or one for another host.
void tell_unreadable(rr::OrderedJson& paths) {
  for (auto& item : paths)
    for (auto& operation : item) {
      if (!operation.contains("responses")) continue;  // the parameters of a path
      for (const auto* status : {"400", "408", "413", "415", "421", "431", "501"})
        operation["responses"].emplace(status, rr::OrderedJson{{"$ref", "#/components/responses/Unreadable"}});
    }
}

}  // namespace

Handler gateway_document_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    auto out = rr::OrderedJson::parse(gateway_openapi);
    const auto& prefix = request.arrival.prefix;
    out["servers"] = rr::OrderedJson::array({{{"url", prefix.empty() ? "/" : prefix}}});
    tell_unreadable(out["paths"]);
    auto& tags = out["tags"] = rr::OrderedJson::array();
    for (const auto& device : gateway.devices().all()) {
      const auto& name = device->config().name;
      if (!gateway.access().sees(request.identity, name)) continue;
      const auto url = prefix + "/api/v1/devices/" + rr::percent_encode(name) + "/openapi.json";
      tags.push_back({{"name", name}, {"externalDocs", {{"url", url}}}});
      out["components"]["parameters"]["device"]["examples"][name]["value"] = name;
    }
    return with_etag(json_response(200, rr::write_json(out) + "\n"), request);
  };
}

}  // namespace rrgate
