#include "server/http/endpoints/device_resources.hpp"

#include <algorithm>

#include "node/tls/digest.hpp"
#include "server/http/endpoints/device_documents.hpp"
#include "server/http/endpoints/devices.hpp"
#include "server/http/etag.hpp"

namespace rrgate {

namespace {

constexpr std::string_view definition_suffix = ".robdef";

bool is_definition(std::string_view name) {
  return name.size() > definition_suffix.size() && name.ends_with(definition_suffix);
}

/// As device_document(), which takes a tenth of a second for a robot: made anew when what it is made of is another.
Response find_document(GatewayState& gateway, const std::string& document, const std::string& device,
                       const std::string& base, const std::vector<DescribedService>& services,
                       const std::vector<std::string>& unavailable) {
  std::string made_of;
  const auto add = [&made_of](std::string_view part) { made_of.append(part).push_back('\0'); };
  for (const auto* part : {&document, &device, &base}) add(*part);
  for (const auto& service : services) {
    add(service.name);
    add(service.root_type);
    for (const auto& definition : service.types->definitions()) add(definition->text);
  }
  for (const auto& service : unavailable) add(service);
  const auto digest = rr::sha256(rr::Bytes(made_of.begin(), made_of.end()));
  auto& known = gateway.documents().at(std::string(digest.begin(), digest.end()));
  if (!known.body) known = device_document(document, device, base, services, unavailable);
  return known;
}

/// A document about the device, or one of its definitions: from sessions with all its services. `login`  of each.
rr::awaitable<void> serve_document(const ObjectRequest& request, Device& device, std::string name, SessionKey login) {
  auto& gateway = request.gateway();
  auto& writer = request.writer();
  std::vector<std::shared_ptr<const rr::TypeRegistry>> kept;
  std::vector<DescribedService> services;
  std::vector<std::string> unavailable;
  std::vector<std::string> names;
  if (const auto& identity = device.identity())
    for (const auto& service : identity->services)
      if (gateway.access().sees(request.request().identity, device.config().name, service.name))
        names.push_back(service.name);
  const auto device_name = device.config().name;  // a found device may be lost meanwhile
  for (const auto& service : names) {
    auto* still_there = gateway.devices().find(device_name);
    if (!still_there) break;
    auto key = login;
    key.service = service;
    auto from = writer.request().origin();
    auto asked = still_there->shared_from_this();
    const auto client = co_await open_session(gateway, std::move(asked), std::move(key), std::move(from));
    const auto* root = client ? (*client)->upstream()->object_type(service) : nullptr;
    const auto types = client ? (*client)->upstream()->types() : nullptr;
    const DescribedService described{service, root ? root->qualified_name : "", types.get()};
    if (root && (is_definition(name) || fits_beside(described, services))) {
      kept.push_back(types);
      services.push_back(described);
    } else {
      unavailable.push_back(service);
    }
  }
  Response response;
  if (services.empty()) {
    response = problem_response(503, "device " + rr::quote(device_name) + " has no service that answers");
    response.set("Retry-After", "2");
  } else if (is_definition(name)) {
    const auto wanted = name.substr(0, name.size() - definition_suffix.size());
    response = problem_response(404, "the device has no definition " + rr::quote(wanted));
    for (const auto& service : services)
      if (const auto* definition = service.types->find_service(wanted))
        response = with_etag(text_response(200, "text/plain; charset=utf-8", definition->text), writer.request());
  } else {
    const auto base = writer.request().arrival.prefix + "/api/v1/devices/" + rr::percent_encode(device_name);
    response = find_document(gateway, name, device_name, base, services, unavailable);
    if (response.status == 200) response = with_etag(std::move(response), writer.request());
  }
  co_await writer.send(response);
}

}  // namespace

bool is_device_resource(std::string_view name) {
  return is_definition(name) ||
         std::find(device_resources.begin(), device_resources.end(), name) != device_resources.end();
}

rr::awaitable<void> serve_device_resource(const ObjectRequest& request, Device& device, std::string name) {
  if (name == "subscriptions") {
    const auto response = request.is_read() ? list_subscriptions(request.gateway(), request.request().identity, device)
                                            : request.method_response("GET, HEAD");
    co_await request.writer().send(response);
    co_return;
  }
  auto login = session_key(request.gateway(), request.request(), {});
  if (login && request.is_read()) {
    co_await serve_document(request, device, std::move(name), std::move(*login));
    co_return;
  }
  const auto response = login ? request.method_response("GET, HEAD") : request.error_response(login.error(), nullptr);
  co_await request.writer().send(response);
}

}  // namespace rrgate
