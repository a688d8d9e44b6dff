#include "server/access/access.hpp"

#include <algorithm>

#include "core/support/glob.hpp"
#include "node/platform/file_look.hpp"
#include "node/platform/text_file.hpp"
#include "node/tls/digest.hpp"
#include "server/access/base64url.hpp"
#include "server/limits/client_network.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace {

/// How often the log says that the audit log can't be written.
constexpr std::chrono::seconds complaint_period{60};
/// Fewer bytes could be guessed from one ticket.
constexpr std::size_t min_ticket_key = 32;

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
  const bool has_keys = !config.jwks_file.empty();
  const auto& path = has_keys ? config.jwks_file : config.secret_file;
  const std::string_view what = has_keys ? "JSON Web Key Set" : "secret";
  const auto text = read_file(what, path);
  if (!text) return text.error();
  auto made = has_keys ? JwtVerifier::from_jwks(*text, config.claims) : JwtVerifier::from_secret(*text, config.claims);
  if (!made) return in_file(what, path, made.error());
  return made;
}

std::map<std::string, std::string> look(const AccessConfig& config) {
  std::map<std::string, std::string> out;
  for (const auto* file : {&config.users_file, &config.tokens_file, &config.jwt.jwks_file, &config.jwt.secret_file,
                           &config.ticket_key_file})
    if (!file->empty()) out[*file] = rr::file_look(*file);
  return out;
}

/// Users whom the gateway has judged have this property, so that nobody else is taken for one of them: their
/// credential.
constexpr std::string_view judged_here = "rrgate.credential";

/// Changes with the password.
std::string credential_of(const rr::PasswordFileAuthenticator& users, std::string_view name) {
  const auto entry = users.find(name);
  return entry ? encode_base64url(rr::sha256(rr::as_bytes(entry->hash))) : std::string();
}

void add_role(std::vector<std::string>& roles, const std::string& role) {
  if (std::find(roles.begin(), roles.end(), role) == roles.end()) roles.push_back(role);
}

/// What goes into the audit log though it was allowed.
bool is_recorded(Verb verb) {
  return verb == Verb::write || verb == Verb::call || verb == Verb::lock || verb == Verb::admin;
}

}  // namespace

Subject subject_of(const rr::AuthenticatedUser& user) {
  return {user.properties.find(judged_here) ? Subject::Kind::user : Subject::Kind::device_user, user.name};
}

rr::Result<rr::AuthenticatedUser> judge_login(const rr::PasswordFileAuthenticator& users,
                                              const rr::LoginAttempt& attempt) {
  auto user = users.authenticate(attempt);
  if (user) user->properties.items.emplace_back(std::string(judged_here), rr::Value(credential_of(users, user->name)));
  return user;
}

rr::Result<AccessStatePtr> load_access(const AccessConfig& config) {
  auto out = std::make_shared<AccessState>();
  out->config = config;
  out->looks = look(config);
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

/// The users of now, for logins that are judged on other threads.
class Access::Users final : public rr::Authenticator {
 public:
  void set(std::shared_ptr<const rr::PasswordFileAuthenticator> users) {
    const std::lock_guard lock(mutex_);
    users_ = std::move(users);
  }

  rr::Result<rr::AuthenticatedUser> authenticate(const rr::LoginAttempt& attempt) const override {
    std::shared_ptr<const rr::PasswordFileAuthenticator> users;
    {
      const std::lock_guard lock(mutex_);
      users = users_;
    }
    if (!users) return rr::make_error(rr::ErrorCode::authentication_error, "Invalid username or password");
    return judge_login(*users, attempt);
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const rr::PasswordFileAuthenticator> users_;
};

Access::Access(const AccessConfig& config) : audit_(std::make_unique<AuditLog>()), users_(std::make_shared<Users>()) {
  // Until load() has read who may, nobody may who must show it.
  auto empty = std::make_shared<AccessState>();
  empty->config = config;
  empty->rules = AccessRules(config.rules, config.has_users());
  state_ = std::move(empty);
}

rr::Result<> Access::load() {
  auto loaded = load_access(state_->config);
  if (!loaded) return loaded.error();
  return replace(std::move(*loaded));
}

rr::Result<> Access::replace(AccessStatePtr next) {
  if (auto opened = audit_->open(next->config.audit_file); !opened) return opened;
  take(std::move(next));
  seen_ = state_->looks;
  return {};
}

void Access::take(AccessStatePtr next) {
  if (next->ticket_key != state_->ticket_key)
    tickets_ = next->ticket_key.empty() ? Tickets() : Tickets(next->ticket_key);
  state_ = std::move(next);
  users_->set(state_->users);
}

void Access::reload(bool is_forced) {
  auto looks = look(state_->config);
  if (is_forced) {
    if (auto opened = audit_->reopen(); !opened)
      log(LogLevel::error, "audit log can't be opened anew", {{"error", opened.error().message}});
  }
  if (!is_forced && looks == seen_) return;
  const bool has_files = !looks.empty();
  seen_ = std::move(looks);
  auto loaded = load_access(state_->config);
  if (!loaded) {
    log(LogLevel::error, "users and rights can't be used; those from before stay in use",
        {{"error", loaded.error().message}});
    return;
  }
  take(std::move(*loaded));
  if (has_files) log(LogLevel::info, "users and rights read anew", {{"files", seen_.size()}});
}

rr::Result<> Access::check(const Identity& who, const AccessRequest& what) {
  auto checked = state_->rules.check(who, what);
  if (!checked)
    record_refusal({"refused", &who, &what, {}});
  else if (is_recorded(what.verb))
    record({to_string(what.verb), &who, &what, {}});
  return checked;
}

rr::Result<> Access::check_whole_device(const Identity& who, std::string_view device) {
  auto checked = state_->rules.check_whole_device(who, device);
  const AccessRequest what{.device = device, .verb = Verb::call};
  if (checked)
    record({"relay", &who, &what, {}});
  else
    record_refusal({"refused", &who, &what, "not every right on the whole device"});
  return checked;
}

std::shared_ptr<const rr::Authenticator> Access::authenticator() const {
  return state_->users ? users_ : nullptr;
}

Identity Access::anonymous(std::string client) const {
  Identity out;
  out.client = std::move(client);
  if (!state_->config.anonymous_role.empty()) out.roles.push_back(state_->config.anonymous_role);
  return out;
}

Identity Access::logged_in(const rr::AuthenticatedUser& user, std::string client) const {
  Identity out;
  out.name = user.name;
  out.roles = user.privileges;
  out.proof = Proof::password;
  if (const auto* credential = user.properties.find(judged_here))
    out.credential = credential->to_text().value();  // as judge_login() has put it there
  out.client = std::move(client);
  return with_grants(std::move(out));
}

Identity Access::in_session(const Identity& shown, const rr::AuthenticatedUser* user) const {
  if (!user) return shown;
  if (subject_of(*user).kind == Subject::Kind::user) return logged_in(*user, shown.client);
  auto out = shown;
  out.device_user = user->name;
  return out;
}

Identity Access::with_grants(Identity identity) const {
  identity.proven_roles = identity.roles;
  if (identity.subject().kind != Subject::Kind::user) return identity;
  for (const auto& grant : state_->config.grants) {
    const auto is_of = [&](const std::string& pattern) { return rr::glob_matches(pattern, identity.name); };
    if (std::any_of(grant.users.begin(), grant.users.end(), is_of))
      for (const auto& role : grant.roles) add_role(identity.roles, role);
  }
  return identity;
}

std::optional<Identity> Access::renew(const Identity& who) const {
  const auto now = std::chrono::system_clock::now();
  if (now >= who.ends) return std::nullopt;
  auto out = who;
  out.roles = who.proven_roles;
  switch (who.proof) {
    case Proof::none:
      out = anonymous(who.client);
      out.device_user = who.device_user;
      return out;
    case Proof::password: {
      const auto entry = state_->users ? state_->users->find(who.name) : std::nullopt;
      if (!entry || credential_of(*state_->users, who.name) != who.credential) return std::nullopt;
      out.roles = entry->privileges;
      break;
    }
    case Proof::token: {
      const auto token = state_->tokens ? state_->tokens->find(who.credential, now) : std::nullopt;
      if (!token || token->name != who.name) return std::nullopt;
      out.roles = token->roles;
      out.ends = token->ends;
      break;
    }
    case Proof::jwt:
      if (!state_->jwt) return std::nullopt;
      break;
    case Proof::certificate:
      if (state_->config.clients.ca.empty()) return std::nullopt;
      break;
    case Proof::proxy:
      if (state_->config.identity_headers.user.empty()) return std::nullopt;
      break;
  }
  return with_grants(std::move(out));
}

void Access::record_refusal(const AuditEvent& event) {
  if (event.who->is_proven() || refusals_.note(network_name_of(event.who->client), std::chrono::steady_clock::now()))
    record(event);
}

void Access::sum_up_refusals(bool is_forced) {
  for (const auto& [network, count] : refusals_.take(std::chrono::steady_clock::now(), is_forced)) {
    Identity strangers;
    strangers.client = network.empty() ? "other networks" : network;
    record({"refusals", &strangers, nullptr, std::to_string(count) + " more within a minute"});
  }
}

void Access::record(const AuditEvent& event) {
  if (audit_->write(event)) return;
  const auto now = std::chrono::steady_clock::now();
  if (last_complaint_ != std::chrono::steady_clock::time_point() && now - last_complaint_ < complaint_period) return;
  last_complaint_ = now;
  log(LogLevel::error, "audit log can't be written; lines are lost", {{"lost", audit_->lost_lines()}});
}

}  // namespace rrgate
