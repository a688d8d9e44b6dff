// What a device offers over HTTP, told from its service definitions. Layer: server/http/endpoints.
#pragma once

#include <string>
#include <vector>

#include "core/types/type_registry.hpp"
#include "server/http/request.hpp"
#include "server/json/json.hpp"

namespace rrgate {

/// A service as its session knows it.
struct DescribedService {
  std::string name;
  std::string root_type;  ///< qualified
  const rr::TypeRegistry* types;
};

/// Whether one document can describe them all: a definition that others have, too, is the same there.
bool fits_beside(const DescribedService& service, const std::vector<DescribedService>& others);

/// "openapi.json", "asyncapi.json", "thing-description.json" or "types.d.ts". `base` is the path of the device,
/// "/api/v1/devices/NAME". `services` fit beside each other. `unavailable` are those that do not, or could not be
/// asked. A status of 503: there are no types.d.ts of these definitions.
Response device_document(std::string_view document, std::string_view device, const std::string& base,
                         const std::vector<DescribedService>& services, const std::vector<std::string>& unavailable);

}  // namespace rrgate
