// What is below a device and no service of it: documents, definitions, subscriptions. Layer: server/http/endpoints.
// See docs/http-api.md.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "server/http/endpoints/object_request.hpp"

namespace rrgate {

/// The definitions "NAME.robdef" apart.
inline constexpr std::array<std::string_view, 5> device_resources = {"subscriptions", "openapi.json", "asyncapi.json",
                                                                     "thing-description.json", "types.d.ts"};
/// Whether a name is one of these, or that of a definition.
bool is_device_resource(std::string_view name);

/// Answers a request for one of them. Borrows the request for the wait; the device may be lost meanwhile.
rr::awaitable<void> serve_device_resource(const ObjectRequest& request, Device& device, std::string name);

}  // namespace rrgate
