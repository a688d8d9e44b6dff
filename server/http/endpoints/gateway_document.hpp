// /api/v1/openapi.json: what the gateway itself answers. Layer: server/http.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class Gateway;

/// OpenAPI 3.1: gateway_openapi.json. The devices that the asker may use are tags, whose externalDocs are documents of
/// their own: they change when devices do.
Handler gateway_document_endpoint(Gateway& gateway);

}  // namespace rrgate
