#include "node/http/foreign_page.hpp"

#include "core/support/error.hpp"
#include "node/http/origin.hpp"
#include "node/http/upgrade.hpp"

namespace rrgate {

namespace {

bool is_own_host(std::string_view authority, const PageRules& rules) {
  return is_host_listed(authority, rules.allowed_hosts) || (rules.tls && rules.tls->has_name(host_name_of(authority)));
}

bool is_page_allowed(const HttpRequest& request, const PageRules& rules) {
  return request.message.count(http::field::origin) == 1 &&
         is_origin_listed(request.header(http::field::origin), rules.allowed_origins);
}

/// As the client named it, before any proxy.
std::string_view host_of(const HttpRequest& request) {
  return request.arrival.host.empty() ? request.header(http::field::host) : std::string_view(request.arrival.host);
}

}  // namespace

std::optional<Response> refuse_unknown_host(const HttpRequest& request, const PageRules& rules) {
  // Browsers say on each upgrade which page it is for.
  if (asks_for_websocket(request) && request.message.count(http::field::origin) == 0) return std::nullopt;
  if (is_page_allowed(request, rules)) return std::nullopt;
  // A page may set the headers of proxies, but never Host.
  for (const auto host : {request.header(http::field::host), host_of(request)})
    if (!host.empty() && !is_own_host(host, rules))
      return problem_response(421,
                              "the name " + rr::quote(host_name_of(host)) +
                                  " is not known here; use the IP address, or add the name to allowed_hosts in the "
                                  "configuration");
  return std::nullopt;
}

std::optional<Response> refuse_foreign_page(const HttpRequest& request, const PageRules& rules) {
  const auto& message = request.message;
  if (is_page_allowed(request, rules)) return std::nullopt;
  if (const auto origins = message.count(http::field::origin); origins != 0) {
    const auto origin = request.header(http::field::origin);
    const auto host = host_of(request);
    if (origins == 1 && is_same_origin(origin, host, request.arrival.is_encrypted) && is_own_host(host, rules))
      return std::nullopt;
    return problem_response(403, "pages of origin " + rr::quote(origin) +
                                     " may not connect; allowed_origins in the configuration lists those that may");
  }
  const auto site = request.header("Sec-Fetch-Site");
  const bool changes_nothing = message.method() == http::verb::get || message.method() == http::verb::head;
  const bool is_link =
      changes_nothing && request.header("Sec-Fetch-Mode") == "navigate" && !request.path().starts_with("/api/");
  if ((site == "cross-site" && !is_link) || (site == "same-site" && !changes_nothing))
    return problem_response(403,
                            "a page of another site asked for this; pages that may are in allowed_origins of the "
                            "configuration, and their <img> and <script> need crossorigin");
  return std::nullopt;
}

}  // namespace rrgate
