#include "server/http/endpoints/documentation.hpp"

#include "server/http/static_files.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

namespace fs = std::filesystem;

namespace {

/// The pages are built for "/docs/", which their links, scripts and styles have as a text's or an address's beginning.
std::string with_prefix(std::string_view text, std::string_view prefix) {
  constexpr std::string_view base = "/docs/";
  std::string out;
  for (;;) {
    const auto at = text.find(base);
    out += text.substr(0, at);
    if (at == std::string_view::npos) return out;
    if (at > 0 && std::string_view("\"'`(").find(text[at - 1]) != std::string_view::npos) out += prefix;
    out += base;
    text.remove_prefix(at + base.size());
  }
}

Response below_prefix(StaticFiles& files, Request request, std::string_view path) {
  request.message.erase(http::field::accept_encoding);
  auto response = files.answer(request, path);
  const auto type = mime_type(path.empty() || path.ends_with('/') ? ".html" : path);
  const bool has_links =
      type.starts_with("text/html") || type.starts_with("text/javascript") || type.starts_with("text/css");
  response.set("Vary", "Accept-Encoding, X-Forwarded-Prefix");
  if (has_links && response.body && response.status == 200)
    response.body = std::make_shared<const std::string>(with_prefix(*response.body, request.arrival.prefix));
  return response;
}

}  // namespace

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
    return request.arrival.prefix.empty() ? files->answer(request, path) : below_prefix(*files, request, path);
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
