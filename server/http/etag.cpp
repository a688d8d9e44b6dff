#include "server/http/etag.hpp"

#include <cstdint>
#include <cstdio>

namespace rrgate {

/// FNV-1a: an ETag must differ when the content does, not resist an attacker.
std::string make_etag(std::string_view content, std::string_view suffix) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  char text[32];
  std::snprintf(text, sizeof(text), "\"%016llx", static_cast<unsigned long long>(hash));
  return std::string(text) + std::string(suffix) + "\"";
}

Response with_etag(Response response, const Request& request) {
  const auto etag = make_etag(*response.body);
  response.set("ETag", etag).set("Cache-Control", "no-cache");
  if (!has_token(request.header(http::field::if_none_match), etag)) return response;
  response.status = 304;
  response.body = nullptr;
  return response;
}

}  // namespace rrgate
