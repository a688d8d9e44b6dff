// /api/v1/openapi.json: what the gateway itself answers. Layer: server/http/endpoints.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

/// OpenAPI 3.1: gateway_openapi.json. The devices that the asker may use are tags, whose externalDocs are documents of
/// their own: they change when devices do.
Handler gateway_document_endpoint(GatewayState& gateway);

}  // namespace rrgate
