#include "server/config/cautions.hpp"

namespace rrgate {

std::vector<Finding> find_cautions(const Config& config) {
  std::vector<Finding> out;
  const auto& access = config.access;
  if (access.jwt.is_used() && access.jwt.claims.issuer.empty())
    out.push_back({"/access/jwt/issuer", "missing: a token of any issuer that uses these keys is taken"});
  if (access.jwt.is_used() && access.jwt.claims.audience.empty())
    out.push_back({"/access/jwt/audience", "missing: a token that was made for another service is taken"});
  for (std::size_t i = 0; i < config.devices.size(); ++i) {
    const auto& url = config.devices[i].url;
    if (url.scheme.starts_with("rrs+") && !url.node_id)
      out.push_back({"/devices/" + std::to_string(i) + "/url",
                     "names no nodeid: whoever has a certificate of a node may pretend to be this device"});
  }
  if (!config.proxy.trust.proxies.empty() && access.rules.empty())
    out.push_back({"/access/rules",
                   std::string("missing: ") +
                       (access.has_users() ? "whoever proves who he is" : "everybody whom a proxy lets through") +
                       " may do everything"});
  if (!config.tls.certificates.empty() && access.has_users() && !config.tls.is_required)
    out.push_back({"/tls/required", "false: a password or a token that is sent in clear is taken"});
  return out;
}

}  // namespace rrgate
