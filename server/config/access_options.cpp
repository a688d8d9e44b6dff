#include "server/config/access_options.hpp"

#include <algorithm>
#include <boost/asio/ip/address.hpp>

#include "server/access/access_text.hpp"

namespace rrgate {

namespace {

std::string check_role(const std::string& role) {
  if (role == "*") return {};
  const auto checked = check_name("role", role);
  return checked ? std::string() : checked.error().message;
}

auto read_role(std::vector<std::string>& roles) {
  return [&roles](const std::string& text) {
    roles.push_back(text);
    return check_role(text);
  };
}

/// An empty pattern fits the empty text: as a member, that is the object itself.
auto read_pattern(std::vector<std::string>& patterns) {
  return [&patterns](const std::string& text) -> std::string {
    patterns.push_back(text);
    return {};
  };
}

bool is_header_name(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  });
}

void read_jwt(ObjectReader& in, JwtConfig& jwt) {
  in.text("jwks_file", jwt.jwks_file);
  in.text("secret_file", jwt.secret_file);
  in.text("issuer", jwt.claims.issuer);
  in.text("audience", jwt.claims.audience);
  in.text("user_claim", jwt.claims.user_claim);
  in.text("roles_claim", jwt.claims.roles_claim);
  in.flag("discover", jwt.discovers);
  in.files("ca", jwt.ca);
  if (!jwt.jwks_file.empty() + !jwt.secret_file.empty() + jwt.discovers != 1)
    in.finding("jwks_file", "expected either jwks_file, secret_file or discover: what tokens are checked with");
  if (jwt.discovers && !jwt.claims.issuer.starts_with("https://"))
    in.finding("issuer", wrong_text(jwt.claims.issuer, "the https:// URL where its keys are found"));
  if (!jwt.ca.empty() && !jwt.discovers) in.finding("ca", "nothing is fetched; expected discover beside it");
}

void read_identity_headers(ObjectReader& in, IdentityHeaders& headers) {
  in.text("user", headers.user);
  in.text("roles", headers.roles);
  for (const auto& [key, name] : {std::pair("user", &headers.user), std::pair("roles", &headers.roles)})
    if (!is_header_name(*name)) in.finding(key, wrong_text(*name, "the name of a header"));
  if (headers.user.empty()) in.finding("user", "missing; expected the name of a header");
}

void read_grant(ObjectReader& in, RoleGrant& grant) {
  in.texts("users", true, read_pattern(grant.users));
  in.texts("roles", true, read_role(grant.roles));
}

void read_agent(ObjectReader& in, AgentTerms& terms) {
  in.ranges("limits", [&](const std::string& place, double least, double most) {
    terms.limits[place] = {least, most};
  });
  std::string approval = "ask";
  in.choice("approval", approval, {"ask", "none"});
  terms.needs_approval = approval == "ask";
  in.flag("lease", terms.needs_lease);
  auto hold = static_cast<std::size_t>(terms.hold.count());
  in.size("hold_seconds", hold, {0, 50});
  terms.hold = std::chrono::seconds(hold);
}

void read_rule(ObjectReader& in, AccessRule& rule) {
  in.texts("roles", true, read_role(rule.roles));
  in.texts("devices", false, read_pattern(rule.devices));
  in.texts("services", false, read_pattern(rule.services));
  in.texts("paths", false, read_pattern(rule.paths));
  in.texts("members", false, read_pattern(rule.members));
  in.texts("may", true, [&](const std::string& text) -> std::string {
    const auto verb = parse_verb(text);
    if (!verb) return wrong_text(text, "one of: read, write, call, subscribe, lock, record, serve, metrics, admin");
    rule.may.push_back(*verb);
    return {};
  });
  const auto gives = [&rule](auto&& is_one) { return std::any_of(rule.may.begin(), rule.may.end(), is_one); };
  const bool is_within_device = !rule.services.empty() || !rule.paths.empty() || !rule.members.empty();
  if ((is_within_device || !rule.devices.empty()) && gives([](Verb verb) { return verb > Verb::serve; }))
    in.finding("may",
               "metrics and admin are of the gateway as a whole; expected them in a rule that names no devices, "
               "services, paths or members");
  if (is_within_device && gives([](Verb verb) { return verb == Verb::serve; }))
    in.finding("may",
               "serve is of a device as a whole; expected it in a rule that names no services, paths or members");
  in.object("agent", [&](ObjectReader& part) { read_agent(part, rule.agent.emplace()); });
  if (rule.agent && gives([](Verb verb) { return verb >= Verb::lock && verb != Verb::record; }))
    in.finding("may", "expected read, write, call, subscribe and record alone in a rule with \"agent\"");
}

bool is_loopback(const std::string& host) {
  if (host == "localhost") return true;
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  return !error && address.is_loopback();
}

}  // namespace

void read_access(ObjectReader& in, AccessConfig& access) {
  in.text("users_file", access.users_file);
  in.text("tokens_file", access.tokens_file);
  in.object("jwt", [&](ObjectReader& part) { read_jwt(part, access.jwt); });
  in.text("ticket_key_file", access.ticket_key_file);
  in.files("client_ca", access.clients.ca);
  in.files("client_crl", access.clients.crl);
  in.object("identity_headers", [&](ObjectReader& part) { read_identity_headers(part, access.identity_headers); });
  in.text("anonymous_role", access.anonymous_role);
  if (!access.anonymous_role.empty())
    if (auto checked = check_name("role", access.anonymous_role); !checked)
      in.finding("anonymous_role", checked.error().message);
  in.objects("grants", false, [&](ObjectReader& item) { read_grant(item, access.grants.emplace_back()); });
  in.objects("rules", false, [&](ObjectReader& item) { read_rule(item, access.rules.emplace_back()); });
  std::string audit_file;
  in.text("audit_file", audit_file);
  if (!audit_file.empty() && !access.audit.file.empty())
    in.finding("audit_file", "the file has a name already, in audit.file; expected one of the two");
  if (!audit_file.empty()) access.audit.file = audit_file;
}

void read_audit(ObjectReader& in, AuditConfig& audit) {
  in.text("file", audit.file);
  in.size("max_bytes", audit.max_bytes, {0, 1'000'000'000'000});
  in.size("keep", audit.keep, {1, 10'000});
  in.flag("fsync", audit.syncs);
  in.flag("fail_closed", audit.fails_closed);
}

void check_access(const Config& config, std::vector<Finding>& findings) {
  const auto& access = config.access;
  if (!access.identity_headers.user.empty() && config.proxy.trust.proxies.empty())
    findings.push_back(
        {"/access/identity_headers", "expected trusted_proxies too: the headers are accepted only from these"});
  if (!access.clients.crl.empty() && access.clients.ca.empty())
    findings.push_back({"/access/client_crl", "there is no CA whose certificates it revokes; expected client_ca"});
  if (!access.clients.ca.empty() && config.tls.certificates.empty())
    findings.push_back({"/access/client_ca", "clients show certificates within TLS; expected tls.certificates"});
  if (config.tls.is_required && config.tls.certificates.empty() && config.proxy.trust.proxies.empty())
    findings.push_back(
        {"/tls/required", "no client could connect; expected tls.certificates, or trusted_proxies that serve TLS"});
  if (!access.anonymous_role.empty() && access.rules.empty())
    findings.push_back({"/access/anonymous_role", "there is no rule that gives it anything; expected rules"});
  if (!config.insecure)
    if (const auto sentence = exposure(config.listen, config); !sentence.empty())
      findings.push_back({"/insecure", sentence});
}

void for_each_file(AccessConfig& access, const std::function<void(std::string&)>& locate) {
  for (auto* file : {&access.users_file, &access.tokens_file, &access.jwt.jwks_file, &access.jwt.secret_file,
                     &access.ticket_key_file, &access.audit.file})
    locate(*file);
  for (auto* files : {&access.clients.ca, &access.clients.crl, &access.jwt.ca})
    for (auto& file : *files) locate(file);
}

std::string exposure(const std::vector<rr::HostPort>& addresses, const Config& config) {
  const bool has_tls = !config.tls.certificates.empty();
  const bool has_users = config.access.has_users();
  if (has_tls && has_users) return {};
  const auto found =
      std::find_if(addresses.begin(), addresses.end(), [](const auto& address) { return !is_loopback(address.host); });
  if (found == addresses.end()) return {};
  const auto what = !has_tls && !has_users ? "without TLS (\"tls\") and without users (\"access\")"
                    : !has_tls             ? "without TLS (\"tls\")"
                                           : "without users (\"access\")";
  return rr::format_host_port(found->host, found->port) + " is reached from other machines " + what +
         "; \"insecure\": true says that this is meant";
}

}  // namespace rrgate
