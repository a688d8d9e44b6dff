// The documentation, as ./dev docs makes it: files at /docs/. Layer: server/http/endpoints.
#pragma once

#include <filesystem>

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

/// Where the files at /docs/ are. The documentation comes with the dashboard: beside an installed program
/// (../share/rrgate/docs), or where the source tree has it (build/docs). A folder `docs` of an own web_root goes
/// before. Empty: nowhere, as in a gateway without a dashboard.
std::filesystem::path documentation_folder(const std::filesystem::path& web_root,
                                           const std::filesystem::path& program_folder);

/// For "/docs/*". Its pages name one another from the root of the host, so that a gateway below another path has none.
Handler documentation_endpoint(GatewayState& gateway);
/// For "/docs": the '/' is missing.
Handler to_documentation_endpoint();

}  // namespace rrgate
