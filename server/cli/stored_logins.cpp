#include "server/cli/stored_logins.hpp"

#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <utility>

#include "core/session/url.hpp"
#include "node/platform/text_file.hpp"
#include "server/cli/remote_service.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

/// Empty where the environment tells of no home.
std::filesystem::path logins_file() {
  const char* config = std::getenv("XDG_CONFIG_HOME");  // NOLINT(concurrency-mt-unsafe): there is one thread
  const char* home = std::getenv("HOME");               // NOLINT(concurrency-mt-unsafe)
  if (config && *config) return std::filesystem::path(config) / "rrgate/logins.json";
  if (home && *home) return std::filesystem::path(home) / ".config/rrgate/logins.json";
  return {};
}

/// Scheme, host, port and path, so that "https://h" and "https://h:443/" are one gateway. nullopt: of no gateway.
std::optional<rr::ConnectionUrl> gateway_of(std::string_view url) {
  const auto native = gateway_url(gateway_base(url));
  const auto parsed = rr::parse_url(native, rr::ServiceInUrl::optional);
  if (native.empty() || !parsed) return std::nullopt;
  return *parsed;
}

/// nullopt: not of the form.
std::optional<StoredLogin> read_login(const rr::Json& json) {
  StoredLogin out;
  if (!json.is_object()) return std::nullopt;
  for (const auto& [key, value] : json.items()) {
    auto* const target = key == "token"      ? &out.token
                         : key == "user"     ? &out.user
                         : key == "password" ? &out.password
                                             : nullptr;
    if (!target || !value.is_string() || value.get_ref<const std::string&>().empty()) return std::nullopt;
    *target = value.get<std::string>();
  }
  const bool is_token = json.size() == 1 && !out.token.empty();
  const bool is_password = json.size() == 2 && out.token.empty();
  if (!is_token && !is_password) return std::nullopt;
  return out;
}

/// By gateway, as the file names it.
std::vector<std::pair<std::string, StoredLogin>> read_stored_logins() {
  const auto file = logins_file().string();
  struct stat found {};
  if (file.empty() || ::stat(file.c_str(), &found) != 0) return {};
  if ((found.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw NotUnderstood(file + " holds secrets, and others than its owner may use it; expected: chmod 600 " + file);
  const auto text = read_text_file(file);
  if (!text) throw NotUnderstood(file + ": can't be read");
  const auto json = rr::read_json(*text);
  if (!json) throw NotUnderstood(file + ": not JSON: " + json.error().message);
  if (!json->is_object() || json->size() != 1 || !json->contains("gateways") || !json->at("gateways").is_object())
    throw NotUnderstood(file + R"(: expected {"gateways": {"https://HOST:PORT": {"token": "..."}}})");
  std::vector<std::pair<std::string, StoredLogin>> out;
  for (const auto& [url, login] : json->at("gateways").items()) {
    if (!gateway_of(url))
      throw NotUnderstood(file + ": found gateway " + rr::quote(url) + ", expected http(s)://HOST:PORT");
    const auto read = read_login(login);
    if (!read)
      throw NotUnderstood(file + ": gateway " + rr::quote(url) +
                          R"(: expected {"token": "..."} or {"user": "...", "password": "..."})");
    out.emplace_back(url, *read);
  }
  return out;
}

}  // namespace

StoredLogin find_stored_login(std::string_view gateway) {
  const auto wanted = gateway_of(gateway);
  StoredLogin out;
  for (auto& [url, login] : read_stored_logins())
    if (gateway_of(url) == wanted) out = std::move(login);
  return out;
}

std::vector<std::string> gateways_of_stored_logins() {
  std::vector<std::string> out;
  for (const auto& [url, login] : read_stored_logins()) out.push_back(gateway_base(url));
  return out;
}

}  // namespace rrgate
