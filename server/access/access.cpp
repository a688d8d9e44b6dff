#include "server/access/access.hpp"

#include <algorithm>
#include <utility>

#include "core/support/glob.hpp"
#include "core/support/hex.hpp"
#include "node/platform/folders.hpp"
#include "node/tls/digest.hpp"
#include "server/access/access_text.hpp"
#include "server/access/base64url.hpp"
#include "server/limits/client_network.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace {

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

/// With the NodeIDs, where the gateway may write: beside its key a service may not. Gateways of one key and one user
/// share it. Errors   invalid_configuration: there is no such folder.
rr::Result<std::string> file_of_ended_sign_ins(const rr::Bytes& key) {
  const auto folder = rr::user_state_folder();
  if (!folder) return folder.error();
  const auto name = rr::hex_text(rr::hmac_sha256(key, rr::as_bytes("signed out"))).substr(0, 16);
  return (*folder / "rrgate" / ("signed-out." + name)).string();
}

/// So that it holds behind a restart, which cookies outlive where their key is that of a file.
rr::Result<> keep_signed_out(const SignIns& sign_ins, const rr::Bytes& ticket_key, const Identity& who,
                             SignIns::Time now) {
  if (ticket_key.empty()) return {};
  if (const auto file = file_of_ended_sign_ins(ticket_key); !file) return file.error();
  return sign_ins.keep_ended(who, now);
}

/// What goes into the audit log though it was allowed.
bool is_recorded(Verb verb) {
  return verb == Verb::write || verb == Verb::call || verb == Verb::lock || verb == Verb::subscribe ||
         verb == Verb::record || verb == Verb::serve;
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

Access::Access(const AccessConfig& config) : Access(config, rr::random_bytes(min_ticket_key)) {}

Access::Access(const AccessConfig& config, const rr::Bytes& key)
    : audit_(std::make_shared<AuditLog>()), users_(std::make_shared<Users>()), tickets_(key), sign_ins_(key) {
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
  const bool is_other = next->config.audit.file != state_->config.audit.file || !audit_->is_used();
  if (auto opened = audit_->open(next->config.audit); !opened) return opened;
  if (is_other && audit_->is_used()) {
    const auto state = audit_->state();
    log(state.found.empty() ? LogLevel::info : LogLevel::warning, "audit log",
        {{"file", next->config.audit.file},
         {"record", state.chain.seq},
         {"hash", state.chain.hash},
         {"found", state.found}});
  }
  if (std::exchange(is_loaded_, true)) record_changes(*next);
  take(std::move(next));
  seen_ = state_->looks;
  return {};
}

void Access::record_tokens(const AccessState& before, const AccessState& now) {
  const ApiTokens none;
  const auto& old = (before.tokens ? *before.tokens : none).by_hash();
  const auto& current = (now.tokens ? *now.tokens : none).by_hash();
  const auto tell = [this](std::string_view event, const ApiTokens::Entry& of) {
    const auto until = of.last_day ? ", until " + format_day(*of.last_day) : std::string();
    const auto detail = of.name + ": roles " + format_roles(of.roles) + until;
    record({.event = event, .detail = detail});
  };
  // The hash is the token: a name may be that of several, and of another one tomorrow.
  const auto is_in = [](const ApiTokens::Entries& entries, const auto& token) {
    const auto found = entries.find(token.first);
    return found != entries.end() && found->second.name == token.second.name;
  };
  for (const auto& token : old)
    if (!is_in(current, token)) tell("token_revoked", token.second);
  for (const auto& token : current)
    if (!is_in(old, token))
      tell("token_made", token.second);
    else if (old.find(token.first)->second != token.second)
      tell("token_changed", token.second);
}

void Access::record_users(const AccessState& before, const AccessState& now) {
  using UserFile = rr::PasswordFileAuthenticator;
  const auto tell = [this](std::string_view event, const std::string& name, const UserFile::Entry& of,
                           bool is_other = false) {
    const auto detail = name + ": roles " + format_roles(of.privileges) + (is_other ? ", another password" : "");
    record({.event = event, .detail = detail});
  };
  const auto find = [](const AccessState& state, const std::string& name) {
    return state.users ? state.users->find(name) : std::nullopt;
  };
  if (before.users)
    for (const auto& name : before.users->names())
      if (!find(now, name)) tell("user_removed", name, *find(before, name));
  if (!now.users) return;
  for (const auto& name : now.users->names()) {
    const auto is = *find(now, name);
    const auto was = find(before, name);
    if (!was)
      tell("user_added", name, is);
    else if (was->hash != is.hash || was->privileges != is.privileges)
      tell("user_changed", name, is, was->hash != is.hash);
  }
}

void Access::record_changes(const AccessState& next) {
  record_users(*state_, next);
  record_tokens(*state_, next);
}

void Access::take(AccessStatePtr next) {
  if (next->ticket_key != state_->ticket_key) {
    const auto key = next->ticket_key.empty() ? rr::random_bytes(min_ticket_key) : next->ticket_key;
    tickets_ = Tickets(key);
    std::string file;
    if (!next->ticket_key.empty())
      if (auto found = file_of_ended_sign_ins(key)) file = std::move(*found);
    sign_ins_ = SignIns(key, std::move(file), std::chrono::system_clock::now());
  }
  state_ = std::move(next);
  users_->set(state_->users);
  if (!issuer_keys_.empty()) (void)take_issuer_keys(std::exchange(issuer_, {}), std::exchange(issuer_keys_, {}));
}

rr::Result<> Access::take_issuer_keys(const std::string& issuer, std::string key_set) {
  const auto& jwt = state_->config.jwt;
  if (!jwt.discovers || jwt.claims.issuer != issuer) return {};  // the configuration has changed meanwhile
  if (issuer == issuer_ && key_set == issuer_keys_) return {};
  auto made = JwtVerifier::from_published(key_set, jwt.claims);
  if (!made) return made.error();
  auto next = std::make_shared<AccessState>(*state_);
  next->jwt = std::move(*made);
  state_ = std::move(next);
  issuer_ = issuer;
  issuer_keys_ = std::move(key_set);
  return {};
}

void Access::reload(bool is_forced) {
  auto looks = look_at_files(state_->config);
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
  record_changes(**loaded);
  take(std::move(*loaded));
  if (has_files) log(LogLevel::info, "users and rights read anew", {{"files", seen_.size()}});
}

bool Access::sign_out(const Identity& who) {
  const auto now = std::chrono::system_clock::now();
  if (!sign_ins_.end(who, now)) return false;
  if (auto kept = keep_signed_out(sign_ins_, state_->ticket_key, who, now); !kept)
    log(LogLevel::warning, "signing out can't be kept: after a restart a copied cookie is good again",
        {{"error", kept.error().message}});
  state_ = std::make_shared<const AccessState>(*state_);  // so that everybody is judged anew
  record({.event = "signed_out", .who = &who});
  return true;
}

rr::Result<> Access::check(const Identity& who, const AccessRequest& what) {
  auto checked = state_->rules.check(who, what);
  if (checked && is_recorded(what.verb) && !what.is_vital) return audit_->admit();
  if (!checked) record_refusal({.event = "refused", .who = &who, .what = &what, .outcome = Outcome::refused});
  return checked;
}

AuditEntryPtr Access::begin(const Identity& who, const AccessRequest& what, std::string_view trace,
                            std::string_view event) {
  if (!audit_->is_used() || !is_recorded(what.verb)) return nullptr;
  return std::make_shared<AuditEntry>(audit_, who, what, event.empty() ? to_string(what.verb) : event, trace);
}

rr::Result<AuditEntryPtr> Access::check_and_begin(const Identity& who, const AccessRequest& what,
                                                  std::string_view trace, std::string_view event) {
  if (auto checked = check(who, what); !checked) return checked.error();
  return begin(who, what, trace, event);
}

rr::Result<> Access::check_whole_device(const Identity& who, std::string_view device) {
  auto checked = state_->rules.check_whole_device(who, device);
  if (checked) return audit_->admit();
  const AccessRequest what{.device = device, .verb = Verb::call};
  record_refusal({.event = "refused",
                  .who = &who,
                  .what = &what,
                  .detail = "not every right on the whole device",
                  .outcome = Outcome::refused});
  return checked;
}

std::shared_ptr<const rr::Authenticator> Access::authenticator() const {
  return state_->users ? users_ : nullptr;
}

Identity Access::anonymous(std::string client, Face face) const {
  Identity out;
  out.client = std::move(client);
  out.face = face;
  if (!state_->config.anonymous_role.empty()) out.roles.push_back(state_->config.anonymous_role);
  return out;
}

Identity Access::logged_in(const rr::AuthenticatedUser& user, std::string client, Face face) const {
  Identity out;
  out.name = user.name;
  out.roles = user.privileges;
  out.proof = Proof::password;
  if (const auto* credential = user.properties.find(judged_here))
    out.credential = credential->to_text().value();  // as judge_login() has put it there
  out.client = std::move(client);
  out.face = face;
  return with_grants(std::move(out));
}

Identity Access::in_session(const Identity& shown, const rr::AuthenticatedUser* user) const {
  if (!user) return shown;
  if (subject_of(*user).kind == Subject::Kind::user) return logged_in(*user, shown.client, shown.face);
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
  if (now >= who.ends || sign_ins_.has_ended(who.sign_in)) return std::nullopt;
  auto out = who;
  out.roles = who.proven_roles;
  switch (who.proof) {
    case Proof::none:
      out = anonymous(who.client, who.face);
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
    case Proof::oidc:
      if (!state_->jwt || !state_->jwt->knows(who.credential)) return std::nullopt;
      break;
    case Proof::certificate:
      if (state_->config.clients.ca.empty() || state_->revoked.has_any_of(who.credential)) return std::nullopt;
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

void Access::record_too_much(const Identity& who, const AccessRequest* what, std::string_view why) {
  if (too_much_.note(network_name_of(who.client), std::chrono::steady_clock::now()))
    record({.event = "refused", .who = &who, .what = what, .detail = why, .outcome = Outcome::refused});
}

void Access::tend_audit(bool is_forced) {
  const auto tell = [&](RefusalDigest& digest, const std::string& why) {
    for (const auto& [network, count] : digest.take(std::chrono::steady_clock::now(), is_forced)) {
      Identity clients;
      clients.client = network.empty() ? "other networks" : network;
      const auto detail = std::to_string(count) + " more within a minute" + why;
      record({.event = "refusals", .who = &clients, .detail = detail, .outcome = Outcome::refused});
    }
  };
  tell(refusals_, "");
  tell(too_much_, ", asked for too often");
  const auto state = audit_->state();
  const bool is_failing = !state.failure.empty();
  if (is_failing == std::exchange(is_failing_, is_failing)) return;
  if (is_failing)
    log(LogLevel::error, "audit log can't be written",
        {{"error", state.failure},
         {"waiting", state.waiting},
         {"fail_closed", state_->config.audit.fails_closed ? 1 : 0}});
  else
    log(LogLevel::info, "audit log can be written again", {{"lost", state.lost}, {"refused", state.refused}});
}

Access::~Access() {
  tend_audit(true);
  if (!audit_->is_used()) return;
  (void)audit_->flush(std::chrono::seconds(1));
  const auto state = audit_->state();
  log(LogLevel::info, "audit log ends",
      {{"record", state.chain.seq}, {"hash", state.chain.hash}, {"lost", state.lost}});
}

}  // namespace rrgate
