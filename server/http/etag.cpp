#include "server/http/etag.hpp"

#include <cstdint>
#include <cstdio>

#include "core/support/words.hpp"

namespace rrgate {

/// FNV-1a: an ETag must differ when the content does, not resist an attacker.
std::string make_etag(std::string_view content, std::string_view suffix) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  char text[32];
  std::snprintf(text, sizeof(text), "\"%016llx", static_cast<unsigned long long>(hash));
  return std::string(text) + std::string(suffix) + "\"";
}

bool has_etag(const Request& request, std::string_view etag) {
  const auto list = request.list(http::field::if_none_match);
  for (auto known : rr::split_words(list, ", \t")) {
    if (known.starts_with("W/")) known.remove_prefix(2);
    if (known == etag || known == "*") return true;
  }
  return false;
}

Response with_etag(Response response, const Request& request) {
  const auto etag = make_etag(*response.body);
  response.set("ETag", etag).set("Cache-Control", "no-cache");
  if (!has_etag(request, etag)) return response;
  response.status = 304;
  response.body = nullptr;
  return response;
}

}  // namespace rrgate
