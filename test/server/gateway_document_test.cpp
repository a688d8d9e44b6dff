// The gateway's OpenAPI document says what its routes answer: all of that, and nothing else.
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <set>

#include "server/gateway/gateway.hpp"
#include "server/gateway/routes.hpp"
#include "server/http/endpoints/access.hpp"
#include "server/http/endpoints/device_resources.hpp"
#include "server/json/json.hpp"

using namespace rrgate;

namespace {

using Operations = std::set<std::string>;  ///< "get /api/v1/devices"

std::string operation(http::verb method, const std::string& path) {
  auto name = std::string(http::to_string(method).data(), http::to_string(method).size());
  for (auto& c : name) c = static_cast<char>(std::tolower(c));
  return name + " " + path;
}

/// What a pattern with "*" stands for; each other is its own path.
std::vector<std::string> paths_of(const Route& route) {
  const std::string device = "/api/v1/devices/{device}";
  const std::string request = "/api/v1/access/requests/{request}/";
  std::vector<std::string> out;
  if (route.pattern == "/api/v1/devices/*") {
    // To write and to call is for what is below a service: told by the document of the device.
    if (route.method != http::verb::get) return out;
    out = {device, device + "/{definition}.robdef", device + "/{service}"};
    for (const auto name : device_resources) out.push_back(device + "/" + std::string(name));
  } else if (route.pattern == "/api/v1/access/requests/*") {
    for (const auto action : request_actions) out.push_back(request + std::string(action));
  } else if (route.pattern == "/api/v1/agents/approvals/*") {
    out = {"/api/v1/agents/approvals/{approval}"};
  } else if (route.pattern == "/api/v1/recordings/*") {
    const std::string recording = "/api/v1/recordings/{recording}";
    out = {recording + (route.method == http::verb::post ? "/stop" : "")};
    if (route.method != http::verb::get) out.push_back(recording + "/play");
  } else if (route.pattern == "/devices/*") {
    out = {"/devices/{device}"};
  } else if (route.pattern != "/api/*" && route.pattern != "/*" && !route.pattern.starts_with("/docs")) {
    // Nothing there; the files of the page, and of the documentation.
    out = {route.pattern};
  }
  return out;
}

/// But OPTIONS, which browsers ask by themselves.
Operations answered(Gateway& gateway) {
  Operations out;
  for (const auto& route : list_routes(gateway))
    if (route.method != http::verb::options)
      for (const auto& path : paths_of(route)) out.insert(operation(route.method, path));
  return out;
}

rr::Json document_of(Gateway& gateway) {
  Request request;
  request.message.method(http::verb::get);
  request.message.target("/api/v1/openapi.json");
  const auto response = gateway.router().answer(request);
  REQUIRE(response.status == 200);
  return rr::Json::parse(*response.body);
}

Operations told(const rr::Json& document) {
  Operations out;
  for (const auto& [path, item] : document["paths"].items())
    for (const auto& [method, unused] : item.items())
      if (method != "parameters") out.insert(method + " " + path);
  return out;
}

}  // namespace

TEST_CASE("the gateway's document tells every route, and none that isn't there") {
  boost::asio::io_context io;
  Gateway gateway(io, Config{});
  CHECK(told(document_of(gateway)) == answered(gateway));
}

TEST_CASE("whatever the gateway's document refers to is in it") {
  boost::asio::io_context io;
  Gateway gateway(io, Config{});
  const auto document = document_of(gateway);
  std::set<std::string> used;
  const std::function<void(const rr::Json&)> visit = [&](const rr::Json& json) {
    if (json.is_object() && json.contains("$ref")) used.insert(json["$ref"].get<std::string>().substr(1));
    if (json.is_structured())
      for (const auto& each : json) visit(each);
  };
  visit(document);
  Operations there;
  for (const auto kind : {"schemas", "responses", "parameters", "headers"})
    for (const auto& [name, unused] : document["components"][kind].items())
      there.insert(std::string("/components/") + kind + "/" + name);
  CHECK(used == there);
  for (const auto& [path, item] : document["paths"].items()) {
    for (const auto& [method, details] : item.items()) {
      if (method == "parameters") continue;
      INFO(method << " " << path);
      const bool is_open = path == "/healthz" || path == "/readyz" || path.starts_with("/.well-known/");
      CHECK(details["responses"].contains("401") != is_open);
      CHECK(details["responses"].contains("429") != is_open);
    }
  }
}
