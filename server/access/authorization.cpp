#include "server/access/authorization.hpp"

#include <algorithm>

#include "node/http/message.hpp"
#include "node/tls/base64.hpp"

namespace rrgate {

std::optional<std::string_view> credentials_of(std::string_view header, std::string_view scheme) {
  if (header.size() <= scheme.size() || header[scheme.size()] != ' ' ||
      !equals_ignoring_case(header.substr(0, scheme.size()), scheme))
    return std::nullopt;
  header.remove_prefix(scheme.size());
  return header.substr(std::min(header.find_first_not_of(' '), header.size()));
}

rr::Result<std::optional<BasicCredentials>> basic_credentials(std::string_view header) {
  const auto encoded = credentials_of(header, "Basic");
  if (!encoded) return std::optional<BasicCredentials>();
  const auto decoded = rr::decode_base64(*encoded);
  const std::string text = decoded ? std::string(decoded->begin(), decoded->end()) : "";
  const auto colon = text.find(':');
  if (colon == std::string::npos)
    return rr::make_error(rr::ErrorCode::authentication_error, "Basic credentials can't be read");
  return std::optional<BasicCredentials>({text.substr(0, colon), text.substr(colon + 1)});
}

}  // namespace rrgate
