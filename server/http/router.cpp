#include "server/http/router.hpp"

#include <algorithm>
#include <optional>

#include "core/support/error.hpp"

namespace rrgate {

namespace {

/// What "*" stands for; nullopt when the path doesn't fit.
std::optional<std::string_view> match(std::string_view pattern, std::string_view path) {
  if (pattern.empty() || pattern.back() != '*')
    return pattern == path ? std::optional(path.substr(path.size())) : std::nullopt;
  const auto prefix = pattern.substr(0, pattern.size() - 1);
  if (path.substr(0, prefix.size()) != prefix) return std::nullopt;
  return path.substr(prefix.size());
}

}  // namespace

void Router::add(http::verb method, std::string pattern, Handler handler) {
  routes_.push_back({method, std::move(pattern), std::move(handler)});
}

Response Router::answer(const Request& request) const {
  const auto method = request.message.method();
  const auto wanted = method == http::verb::head ? http::verb::get : method;
  std::vector<std::string> allowed;
  for (const auto& route : routes_) {
    const auto rest = match(route.pattern, request.path());
    if (!rest) continue;
    if (route.method == wanted) return route.handler(request, *rest);
    const auto name = http::to_string(route.method);
    std::string text(name.data(), name.size());
    if (route.method == http::verb::get) text += ", HEAD";
    if (std::find(allowed.begin(), allowed.end(), text) == allowed.end()) allowed.push_back(std::move(text));
  }
  if (allowed.empty()) return problem_response(404, "nothing is at " + rr::quote(request.path()));
  std::string list;
  for (const auto& name : allowed) list += (list.empty() ? "" : ", ") + name;
  auto response = problem_response(405, "method not supported here; supported: " + list);
  response.set("Allow", list);
  return response;
}

}  // namespace rrgate
