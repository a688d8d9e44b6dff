// rrgate init: a gateway's folder to begin with, safe to reach from other machines. Layer: server/cli.
#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"
#include "node/service/password_hash.hpp"
#include "node/tls/digest.hpp"
#include "server/access/access_text.hpp"
#include "server/cli/command.hpp"
#include "server/config/config.hpp"

namespace rrgate {

namespace fs = std::filesystem;

namespace {

/// Where the package's service reads and writes.
constexpr std::string_view service_folder = "/etc/rrgate";
constexpr std::string_view service_log_folder = "/var/log/rrgate";

/// The names and addresses by which browsers may reach this machine, its own name first.
std::vector<std::string> names_of_machine() {
  std::vector<std::string> out;
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) == 0 && name[0] != 0) out.emplace_back(name.data());
  for (const auto* each : {"localhost", "127.0.0.1"})
    if (std::find(out.begin(), out.end(), each) == out.end()) out.emplace_back(each);
  ifaddrs* found = nullptr;
  if (::getifaddrs(&found) != 0) return out;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(found, &::freeifaddrs);
  for (const auto* each = found; each; each = each->ifa_next) {
    if (!each->ifa_addr || each->ifa_addr->sa_family != AF_INET || (each->ifa_flags & IFF_LOOPBACK) != 0) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto& address = reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr;
    if (::inet_ntop(AF_INET, &address, text.data(), text.size()) &&
        std::count(out.begin(), out.end(), text.data()) == 0)
      out.emplace_back(text.data());
  }
  return out;
}

/// 20 letters and digits that are not taken for one another: about 99 bits.
std::string make_password() {
  constexpr std::string_view letters = "abcdefghijkmnpqrstuvwxyz23456789";  // 32 of them, so that all are as likely
  std::string out;
  for (const auto byte : rr::random_bytes(20)) out += letters[byte % letters.size()];
  return out;
}

/// Why the folder's configuration is somebody's already; empty: there is none, or it names neither devices nor users.
std::string reason_to_keep(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  const auto text = read_text_file(file.string());
  const auto read = parse_config(text.value_or(""));
  if (!text || !read.findings.empty()) return "is there already, and can't be read";
  if (!read.config.devices.empty() || !read.config.access.users_file.empty())
    return "is there already, with devices or users of its own";
  return {};
}

nlohmann::ordered_json make_config(const fs::path& folder, const std::string& certificate) {
  auto config = nlohmann::ordered_json::object();
  config["listen"] = {"0.0.0.0:8443"};
  config["devices"] = nlohmann::ordered_json::array();
  config["tls"]["certificates"] = {{{"cert", "tls/" + certificate + ".pem"}, {"key", "tls/" + certificate + ".key"}}};
  auto& access = config["access"];
  access["users_file"] = "users";
  if (folder == service_folder) access["audit_file"] = std::string(service_log_folder) + "/audit.jsonl";
  access["rules"] = {
      {{"roles", {"viewer", "operator"}}, {"may", {"read", "subscribe"}}},
      {{"roles", {"operator"}}, {"may", {"write", "call", "lock"}}},
      {{"roles", {"admin"}}, {"may", {"read", "write", "call", "subscribe", "lock", "metrics", "admin"}}},
  };
  return config;
}

}  // namespace

int run_init(Arguments arguments) {
  constexpr std::string_view options[] = {"--user"};
  const auto parsed = parse_arguments(arguments, {options});
  if (!parsed.error.empty()) return usage_error("init", parsed.error);
  if (parsed.operands.size() > 1) return usage_error("init", "expected one FOLDER, or none");
  const fs::path folder = parsed.operands.empty() ? service_folder : parsed.operands[0];
  const auto named = parsed.options.find("--user");
  const auto user = named == parsed.options.end() ? std::string("admin") : named->second;
  if (const auto checked = check_name("user name", user); !checked) return usage_error("init", checked.error().message);

  const auto file = folder / "gateway.json";
  if (const auto reason = reason_to_keep(file); !reason.empty())
    return report_failure("init", file.string() + ": " + reason + "; nothing was written");
  for (const auto* each : {"users", "tls"}) {
    std::error_code error;
    if (fs::exists(folder / each, error))
      return report_failure("init", (folder / each).string() + ": is there already; nothing was written");
  }

  const auto names = names_of_machine();
  const auto tls = (folder / "tls").string();
  if (const std::array<std::string_view, 2> ca{"ca", tls}; run_cert(ca) != exit_ok) return exit_failed;
  std::vector<std::string_view> web{"web", tls};
  web.insert(web.end(), names.begin(), names.end());
  if (run_cert(web) != exit_ok) return exit_failed;

  const auto password = make_password();
  const auto hash = rr::PasswordHash::make_scrypt(password);
  if (!hash) return report_failure("init", hash.error().message);
  const auto users = user + " " + hash->text() + " admin\n";
  const auto config = make_config(folder, names.front()).dump(2) + "\n";
  for (const auto& [path, text] : {std::pair{folder / "users", users}, std::pair{file, config}})
    if (const auto done = rr::write_secret(path, text, path == file, rr::SecretReaders::folder_group); !done)
      return report_failure("init", done.error().message);

  std::cout << file.string() << "\n\nuser " << user << ", password " << password << " (shown this once; rrgate passwd "
            << (folder / "users").string() << " " << user << " sets another)\nhttps://" << names.front()
            << ":8443/ once it runs; browsers believe it with " << (folder / "tls" / "web-ca.pem").string()
            << "\nNext: put your devices into " << file.string() << ", then "
            << (folder == service_folder ? "systemctl enable --now rrgate" : "rrgate serve --config " + file.string())
            << "\n";
  return exit_ok;
}

}  // namespace rrgate
