#include "server/http/other_pages.hpp"

namespace rrgate {

namespace {

/// The devices, and the tickets that a page connects to them with.
bool is_for_other_pages(std::string_view path) {
  return path == "/api/v1/tickets" || path == "/api/v1/devices" || path.starts_with("/api/v1/devices/");
}

}  // namespace

std::vector<std::pair<std::string, std::string>> headers_for_page(const Request& request) {
  const auto origin = request.header(http::field::origin);
  if (origin.empty() || !is_for_other_pages(request.path())) return {};
  return {{"Access-Control-Allow-Origin", std::string(origin)},
          {"Access-Control-Expose-Headers", "Content-Range, ETag, Location, Retry-After, traceparent"},
          {"Vary", "Origin"}};
}

Handler preflight_endpoint() {
  return [](const Request&, std::string_view) {
    Response response;
    response.status = 204;
    response.set("Access-Control-Allow-Methods", "GET, HEAD, PUT, POST");
    response.set("Access-Control-Allow-Headers",
                 "Accept, Authorization, Content-Type, Last-Event-ID, Range, Rrgate-Lease, traceparent");
    response.set("Access-Control-Max-Age", "600");
    return response;
  };
}

}  // namespace rrgate
