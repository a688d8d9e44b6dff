// What an Authorization header shows. Layer: server/access. Source: RFC 9110 section 11.4, RFC 7617.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/support/error.hpp"

namespace rrgate {

/// What follows "Basic " or "Bearer "; nullopt: another scheme, or no header. Borrows `header`.
std::optional<std::string_view> credentials_of(std::string_view header, std::string_view scheme);

struct BasicCredentials {
  std::string username;
  std::string password;
};

/// nullopt: another scheme, or no header.
/// Errors   authentication_error: they are no base64, or have no colon. Such a client is not taken for nobody.
rr::Result<std::optional<BasicCredentials>> basic_credentials(std::string_view header);

}  // namespace rrgate
