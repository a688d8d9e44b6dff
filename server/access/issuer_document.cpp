#include "server/access/issuer_document.hpp"

#include "core/session/url.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

constexpr std::string_view https = "https://";

rr::Error no_document(std::string what) {
  return rr::make_error(rr::ErrorCode::connection_error, std::move(what));
}

rr::Result<std::string> text_at(const rr::Json& document, const char* key) {
  const auto found = document.is_object() ? document.find(key) : document.end();
  if (found == document.end() || !found->is_string())
    return no_document("the issuer's document: expected an object with a text " + std::string(key));
  return found->get<std::string>();
}

}  // namespace

rr::Result<std::string> read_issuer_document(std::string_view document, std::string_view issuer) {
  const auto json = rr::read_json(document);
  if (!json) return no_document("the issuer's document: " + json.error().message);
  const auto name = text_at(*json, "issuer");
  if (!name) return name.error();
  if (*name != issuer) return no_document("the document is of the issuer " + rr::quote(*name, 200));
  return text_at(*json, "jwks_uri");
}

rr::Result<HttpsGet> make_https_get(std::string_view url) {
  if (!url.starts_with(https)) return no_document("expected https://");
  const auto rest = url.substr(https.size());
  // The same form, with the same port where none is named.
  const auto parts = rr::parse_url("rr+wss://" + std::string(rest), rr::ServiceInUrl::optional);
  if (!parts) return no_document(parts.error().message);
  const auto authority = rest.substr(0, rest.find_first_of("/?"));
  return HttpsGet{parts->host, parts->port,
                  "GET " + (parts->path.empty() ? "/" : parts->path) +
                      (parts->query.empty() ? "" : "?" + parts->query) +
                      " HTTP/1.1\r\nHost: " + std::string(authority) +
                      "\r\nAccept: application/json\r\nUser-Agent: rrgate\r\nConnection: close\r\n\r\n"};
}

}  // namespace rrgate
