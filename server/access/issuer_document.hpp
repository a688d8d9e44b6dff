// What an issuer of JSON Web Tokens says about itself, and how it is asked. Layer: server/access.
// Source: OpenID Connect Discovery 1.0, section 4.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/support/error.hpp"

namespace rrgate {

/// The URL of the issuer's keys ("jwks_uri"), as the document has it. Errors   connection_error: no such document, or
/// one of another issuer than `issuer`.
rr::Result<std::string> read_issuer_document(std::string_view document, std::string_view issuer);

struct HttpsGet {
  std::string host;
  std::uint16_t port = 0;
  std::string request;  ///< its whole head
};
/// A request for what is at the URL. Errors   connection_error: no URL with https.
rr::Result<HttpsGet> make_https_get(std::string_view url);

}  // namespace rrgate
