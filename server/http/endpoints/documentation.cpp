#include "server/http/endpoints/documentation.hpp"

#include "server/http/static_files.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

namespace fs = std::filesystem;

fs::path documentation_folder(const fs::path& web_root, const fs::path& program_folder) {
  std::error_code error;
  if (web_root.empty()) return {};
  if (fs::exists(web_root / "docs", error)) return web_root / "docs";
  for (const auto candidate : {"../share/rrgate/docs", "../../../build/docs"})
    if (fs::exists(program_folder / candidate / "index.html", error)) return program_folder / candidate;
  return {};
}

Handler documentation_endpoint(GatewayState& gateway) {
  std::error_code error;
  const auto program = fs::read_symlink("/proc/self/exe", error);
  const auto folder = documentation_folder(gateway.config().web_root, program.parent_path());
  return [folder, files = std::make_shared<StaticFiles>(folder)](const Request& request, std::string_view path) {
    if (folder.empty())
      return problem_response(404, "no documentation here: ./dev docs builds it, and packages have it");
    if (!request.arrival.prefix.empty())
      return problem_response(404, "the documentation is at /docs/ alone, not below " + request.arrival.prefix);
    return files->answer(request, path);
  };
}

Handler to_documentation_endpoint() {
  return [](const Request&, std::string_view) {
    auto response = problem_response(308, "the documentation is at docs/");
    response.set("Location", "docs/");
    return response;
  };
}

}  // namespace rrgate
