#include "node/service/password_file.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "core/support/words.hpp"

namespace rr {

namespace {

constexpr std::size_t max_password_size = 1024;

Error refused(std::string why) {
  return {ErrorCode::authentication_error, std::move(why)};
}

}  // namespace

Result<std::shared_ptr<const PasswordFileAuthenticator>> PasswordFileAuthenticator::from_text(
    std::string_view text, PasswordFileOptions options) {
  std::shared_ptr<PasswordFileAuthenticator> file(new PasswordFileAuthenticator);
  file->options_ = options;
  std::size_t number = 0;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    ++number;
    if (auto added = file->add_line(text.substr(0, end)); !added)
      return make_error(ErrorCode::invalid_configuration,
                        "password file, line " + std::to_string(number) + ": " + added.error().message);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return std::shared_ptr<const PasswordFileAuthenticator>(std::move(file));
}

Result<std::shared_ptr<const PasswordFileAuthenticator>> PasswordFileAuthenticator::from_file(
    const std::string& path, PasswordFileOptions options) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf()).good())
    return make_error(ErrorCode::io_error, "password file " + quote(path, 200) + " cannot be read, or is empty");
  auto read = from_text(text.str(), options);
  if (!read) return make_error(read.error().code, quote(path, 200) + ": " + read.error().message);
  return read;
}

Result<> PasswordFileAuthenticator::add_line(std::string_view line) {
  const auto fields = split_words(line);
  if (fields.empty()) return {};
  if (fields.size() < 3 || fields.size() > 4)
    return make_error(ErrorCode::invalid_configuration, "has " + std::to_string(fields.size()) +
                                                            " fields, expected name, hash, privileges or _, and " +
                                                            "maybe NodeIDs");
  auto hash = PasswordHash::parse(fields[1]);
  if (!hash) return hash.error();
  if (hash->scheme() == PasswordScheme::md5 && !options_.accepts_md5)
    return make_error(ErrorCode::invalid_configuration,
                      "user " + quote(fields[0]) + " has an MD5 hash, which must be allowed; use scrypt");
  User user{std::move(*hash), {}, {}};
  if (fields[2] != "_")
    for (const auto privilege : split_words(fields[2], ",")) user.privileges.emplace_back(privilege);
  if (fields.size() == 4)
    for (const auto text : split_words(fields[3], ",")) {
      const auto node = parse_node_id(text);
      if (!node) return node.error();
      user.nodes.push_back(*node);
    }
  users_.emplace(fields[0], std::move(user));
  return {};
}

Result<> PasswordFileAuthenticator::check_node(const LoginAttempt& attempt, const User& user) {
  if (!attempt.verified_node_id || attempt.verified_node_id->is_any())
    return refused("Client identity is not verified");
  if (user.nodes.empty()) return {};
  if (std::find(user.nodes.begin(), user.nodes.end(), *attempt.verified_node_id) == user.nodes.end())
    return refused("User may not log in from this node");
  return {};
}

std::vector<std::string> PasswordFileAuthenticator::names() const {
  std::vector<std::string> out;
  for (const auto& [name, user] : users_) out.push_back(name);
  return out;
}

std::optional<PasswordFileAuthenticator::Entry> PasswordFileAuthenticator::find(std::string_view name) const {
  const auto found = users_.find(name);
  if (found == users_.end()) return std::nullopt;
  return Entry{found->second.hash.text(), found->second.privileges};
}

Result<AuthenticatedUser> PasswordFileAuthenticator::authenticate(const LoginAttempt& attempt) const {
  const auto* credential = attempt.credentials.find("password");
  const auto password = credential ? credential->to_text() : Result<std::string_view>(refused(""));
  if (!password) return refused("Password not supplied in credentials");
  const auto wrong = refused("Invalid username or password");
  if (password->size() > max_password_size || users_.empty()) return wrong;
  const auto found = users_.find(attempt.username);
  // An unknown name takes as long as a wrong password.
  const auto& user = found == users_.end() ? users_.begin()->second : found->second;
  const bool is_right = user.hash.matches(*password);
  if (!is_right || found == users_.end()) return wrong;
  if (options_.requires_verified_client)
    if (auto allowed = check_node(attempt, user); !allowed) return allowed.error();
  return AuthenticatedUser{found->first, user.privileges, {}};
}

}  // namespace rr
