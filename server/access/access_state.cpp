#include "server/access/access_state.hpp"

#include <utility>

#include "node/platform/file_look.hpp"
#include "node/platform/text_file.hpp"
#include "node/tls/tls_context.hpp"

namespace rrgate {

namespace {

rr::Result<std::string> read_file(std::string_view what, const std::string& path) {
  auto text = read_text_file(path);
  if (!text)
    return rr::make_error(rr::ErrorCode::io_error, std::string(what) + " " + rr::quote(path, 200) + ": can't be read");
  return std::move(*text);
}

rr::Error in_file(std::string_view what, const std::string& path, const rr::Error& error) {
  return rr::make_error(error.code, std::string(what) + " " + rr::quote(path, 200) + ": " + error.message);
}

rr::Result<JwtVerifier> load_jwt(const JwtConfig& config) {
  if (config.discovers) {
    if (const auto trusted = rr::make_web_client_tls({config.ca, {}, {}}); !trusted && !config.ca.empty())
      return rr::make_error(rr::ErrorCode::invalid_configuration, "CA of the issuer: " + trusted.error().message);
    return JwtVerifier::without_keys(config.claims);
  }
  const bool has_keys = !config.jwks_file.empty();
  const auto& path = has_keys ? config.jwks_file : config.secret_file;
  const std::string_view what = has_keys ? "JSON Web Key Set" : "secret";
  const auto text = read_file(what, path);
  if (!text) return text.error();
  auto made = has_keys ? JwtVerifier::from_jwks(*text, config.claims) : JwtVerifier::from_secret(*text, config.claims);
  if (!made) return in_file(what, path, made.error());
  return made;
}

}  // namespace

std::map<std::string, std::string> look_at_files(const AccessConfig& config) {
  std::map<std::string, std::string> out;
  for (const auto* file : {&config.users_file, &config.tokens_file, &config.jwt.jwks_file, &config.jwt.secret_file,
                           &config.ticket_key_file})
    if (!file->empty()) out[*file] = rr::file_look(*file);
  for (const auto* files : {&config.clients.crl, &config.jwt.ca})
    for (const auto& file : *files) out[file] = rr::file_look(file);
  return out;
}

rr::Result<AccessStatePtr> load_access(const AccessConfig& config) {
  auto out = std::make_shared<AccessState>();
  out->config = config;
  out->looks = look_at_files(config);
  out->rules = AccessRules(config.rules, config.has_users());
  if (!config.users_file.empty()) {
    const auto text = read_file("users file", config.users_file);
    if (!text) return text.error();
    auto users = rr::PasswordFileAuthenticator::from_text(*text);
    if (!users) return in_file("users file", config.users_file, users.error());
    out->users = std::move(*users);
  }
  if (!config.tokens_file.empty()) {
    const auto text = read_file("tokens file", config.tokens_file);
    if (!text) return text.error();
    auto tokens = ApiTokens::from_text(*text);
    if (!tokens) return in_file("tokens file", config.tokens_file, tokens.error());
    out->tokens = std::move(*tokens);
  }
  if (config.jwt.is_used()) {
    auto jwt = load_jwt(config.jwt);
    if (!jwt) return jwt.error();
    out->jwt = std::move(*jwt);
  }
  auto revoked = rr::Revocations::from_files(config.clients.crl);
  if (!revoked) return revoked.error();
  out->revoked = std::move(*revoked);
  if (!config.ticket_key_file.empty()) {
    const auto text = read_file("ticket key", config.ticket_key_file);
    if (!text) return text.error();
    if (text->size() < min_ticket_key)
      return rr::make_error(rr::ErrorCode::invalid_configuration,
                            "ticket key " + rr::quote(config.ticket_key_file, 200) + ": has " +
                                std::to_string(text->size()) + " bytes, expected at least 32");
    out->ticket_key.assign(text->begin(), text->end());
  }
  return AccessStatePtr(std::move(out));
}

}  // namespace rrgate
