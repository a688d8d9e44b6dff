#include "server/http/endpoints/gateway_document.hpp"

#include "server/gateway/gateway.hpp"
#include "server/http/endpoints/device_documents.hpp"

namespace rrgate {

namespace {

constexpr const char* document = R"({
  "openapi": "3.1.0",
  "info": {
    "title": "rrgate",
    "version": "1",
    "description": "A gateway to Robot Raconteur devices. What a device offers is told by its own document."
  },
  "paths": {
    "/healthz": {"get": {"operationId": "healthz", "summary": "The process answers.", "responses": {
      "200": {"description": "it does", "content": {"application/json": {"schema": {
        "type": "object", "properties": {"status": {"const": "ok"}}, "required": ["status"]}}}}}}},
    "/readyz": {"get": {"operationId": "readyz", "summary": "Whether it takes clients.", "responses": {
      "200": {"description": "it does", "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Readiness"}}}},
      "503": {"description": "it is stopping", "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Readiness"}}}}}}},
    "/metrics": {"get": {"operationId": "metrics", "summary": "Counters for Prometheus.", "responses": {
      "200": {"description": "text exposition format", "content": {"text/plain": {"schema": {"type": "string"}}}}}}},
    "/api/v1/openapi.json": {"get": {"operationId": "openapi", "summary": "This document.", "responses": {
      "200": {"description": "OpenAPI 3.1", "content": {"application/json": {"schema": {"type": "object"}}}},
      "304": {"description": "it is the one of If-None-Match"}}}},
    "/api/v1/devices": {"get": {"operationId": "devices", "summary": "All devices.", "responses": {
      "200": {"description": "as they are now", "content": {"application/json": {"schema": {
        "type": "object", "properties": {"devices": {"type": "array", "items": {"$ref": "#/components/schemas/Device"}}},
        "required": ["devices"]}}}}}}},
    "/api/v1/devices/{device}": {
      "parameters": [{"$ref": "#/components/parameters/device"}],
      "get": {"operationId": "device", "summary": "One device.", "responses": {
        "200": {"description": "as it is now", "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Device"}}}},
        "default": {"$ref": "#/components/responses/Problem"}}}},
    "/api/v1/devices/{device}/{document}": {
      "parameters": [{"$ref": "#/components/parameters/device"},
        {"name": "document", "in": "path", "required": true, "schema": {
          "enum": ["openapi.json", "asyncapi.json", "thing-description.json", "types.d.ts"]}}],
      "get": {"operationId": "device_document", "summary": "What the device offers.", "responses": {
        "200": {"description": "told from its service definitions", "content": {
          "application/json": {"schema": {"type": "object"}},
          "application/td+json": {"schema": {"type": "object"}},
          "application/typescript": {"schema": {"type": "string"}}}},
        "304": {"description": "it is the one of If-None-Match"},
        "default": {"$ref": "#/components/responses/Problem"}}}},
    "/api/v1/discovery": {"get": {"operationId": "discovery", "summary": "Nodes that the gateway hears of.", "responses": {
      "200": {"description": "as they are now", "content": {"application/json": {"schema": {
        "type": "object",
        "properties": {"enabled": {"type": "boolean"}, "nodes": {"type": "array", "items": {"$ref": "#/components/schemas/Node"}}},
        "required": ["enabled", "nodes"]}}}}}}}
  },
  "components": {
    "parameters": {"device": {"name": "device", "in": "path", "required": true, "schema": {"type": "string", "minLength": 1}}},
    "responses": {"Problem": {"description": "What went wrong: RFC 9457.", "content": {"application/problem+json": {"schema": {
      "type": "object",
      "properties": {"type": {"type": "string"}, "title": {"type": "string"}, "status": {"type": "integer"}, "detail": {"type": "string"}},
      "required": ["title", "status", "detail"]}}}}},
    "schemas": {
      "Readiness": {"type": "object",
        "properties": {"status": {"enum": ["ready", "stopping"]}, "devices": {"type": "integer"}, "devices_online": {"type": "integer"}},
        "required": ["status", "devices", "devices_online"]},
      "Service": {"type": "object", "properties": {"name": {"type": "string"}, "type": {"type": "string"}}, "required": ["name", "type"]},
      "Device": {"type": "object",
        "properties": {
          "name": {"type": "string"}, "url": {"type": "string"}, "websocket_url": {"type": ["string", "null"]},
          "found": {"type": "boolean"}, "node_id": {"type": ["string", "null"]}, "node_name": {"type": ["string", "null"]},
          "state": {"enum": ["connecting", "online", "offline"]}, "last_error": {"type": ["string", "null"]},
          "services": {"type": "array", "items": {"$ref": "#/components/schemas/Service"}}, "clients": {"type": "integer"}},
        "required": ["name", "url", "state", "services", "clients"]},
      "Node": {"type": "object",
        "properties": {
          "node_id": {"type": "string"}, "node_name": {"type": "string"},
          "urls": {"type": "array", "items": {"type": "object",
            "properties": {"url": {"type": "string"}, "age": {"type": "integer"}}, "required": ["url", "age"]}},
          "age": {"type": "integer"}, "services": {"type": ["array", "null"], "items": {"$ref": "#/components/schemas/Service"}},
          "allowed": {"type": "boolean"}, "device": {"type": ["string", "null"]}},
        "required": ["node_id", "node_name", "urls", "allowed", "device"]}
    }
  }
})";

}  // namespace

Handler gateway_document_endpoint(Gateway& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    auto out = rr::OrderedJson::parse(document);
    const auto& prefix = request.arrival.prefix;
    out["servers"] = rr::OrderedJson::array({{{"url", prefix.empty() ? "/" : prefix}}});
    auto& tags = out["tags"] = rr::OrderedJson::array();
    for (const auto& device : gateway.devices().all()) {
      const auto& name = device->config().name;
      const auto url = prefix + "/api/v1/devices/" + rr::percent_encode(name) + "/openapi.json";
      tags.push_back({{"name", name}, {"externalDocs", {{"url", url}}}});
      out["components"]["parameters"]["device"]["examples"][name]["value"] = name;
    }
    return with_etag(json_response(200, rr::write_json(out) + "\n"), request);
  };
}

}  // namespace rrgate
