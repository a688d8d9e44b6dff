// rrgate init: a gateway's folder to begin with, safe to reach from other machines. Layer: server/cli.
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"
#include "node/tls/digest.hpp"
#include "server/access/access_text.hpp"
#include "server/access/base64url.hpp"
#include "server/cli/cert.hpp"
#include "server/cli/command.hpp"
#include "server/cli/first_login.hpp"
#include "server/config/config.hpp"

namespace rrgate {

namespace fs = std::filesystem;

namespace {

/// Where the package's service reads and writes.
constexpr std::string_view service_folder = "/etc/rrgate";
constexpr std::string_view service_log_folder = "/var/log/rrgate";

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

/// With it sign-ins outlive the gateway's restart.
constexpr const char* ticket_key_name = "tickets.key";
constexpr const char* tls_folder_name = "tls";
constexpr std::size_t ticket_key_bytes = 48;

nlohmann::ordered_json make_config(const fs::path& folder, const std::string& certificate) {
  auto config = nlohmann::ordered_json::object();
  config["listen"] = {"0.0.0.0:8443"};
  config["devices"] = nlohmann::ordered_json::array();
  config["tls"]["certificates"] = {{{"cert", "tls/" + certificate + ".pem"}, {"key", "tls/" + certificate + ".key"}}};
  auto& access = config["access"];
  access["users_file"] = "users";
  access["ticket_key_file"] = ticket_key_name;
  if (folder == service_folder) access["audit_file"] = std::string(service_log_folder) + "/audit.jsonl";
  access["rules"] = {
      {{"roles", {"viewer", "operator"}}, {"may", {"read", "subscribe"}}},
      {{"roles", {"operator"}}, {"may", {"write", "call", "lock", "record"}}},
      {{"roles", {"admin"}}, {"may", {"read", "write", "call", "subscribe", "lock", "record", "metrics", "admin"}}},
  };
  return config;
}

std::vector<fs::path> files_beside(const fs::path& folder) {
  return {folder / "users", folder / ticket_key_name, folder / tls_folder_name};
}

/// Takes away what a run made that fails: the next run would refuse to write beside it.
class TakeBack {
 public:
  explicit TakeBack(std::vector<fs::path> paths) : paths_(std::move(paths)) {}
  TakeBack(const TakeBack&) = delete;
  TakeBack& operator=(const TakeBack&) = delete;
  ~TakeBack() {
    std::error_code error;
    for (const auto& path : paths_) fs::remove_all(path, error);
  }
  void keep_all() { paths_.clear(); }

 private:
  std::vector<fs::path> paths_;
};

struct InitOptions {
  std::string folder{service_folder};
  std::string user = "admin";
};

int init(const InitOptions& options) {
  const fs::path folder = options.folder;
  const auto& user = options.user;
  if (const auto checked = check_name("user name", user); !checked) return usage_error("init", checked.error().message);

  const auto file = folder / "gateway.json";
  if (const auto reason = reason_to_keep(file); !reason.empty())
    return report_failure("init", file.string() + ": " + reason + "; nothing was written");
  for (const auto& each : files_beside(folder)) {
    std::error_code error;
    if (fs::exists(each, error))
      return report_failure("init", each.string() + ": is there already; nothing was written");
  }
  TakeBack made(files_beside(folder));

  const auto names = names_of_machine();
  const auto tls_folder = folder / tls_folder_name;
  if (make_authorities({.folder = tls_folder, .days = 3650}) != exit_ok) return exit_failed;
  if (make_web_certificate({{.folder = tls_folder}, names}) != exit_ok) return exit_failed;

  const auto password = write_first_user(folder / "users", user);
  if (!password) return report_failure("init", password.error().message);
  const auto key = encode_base64url(rr::random_bytes(ticket_key_bytes));
  if (const auto done = rr::write_secret(folder / ticket_key_name, key, false, rr::SecretReaders::folder_group); !done)
    return report_failure("init", done.error().message);
  const auto config = make_config(folder, names.front()).dump(2) + "\n";
  if (const auto done = rr::write_secret(file, config, true, rr::SecretReaders::folder_group); !done)
    return report_failure("init", done.error().message);
  made.keep_all();

  std::cout << file.string() << "\n\nuser " << user << ", password " << *password << " (shown this once; rrgate passwd "
            << (folder / "users").string() << " " << user << " sets another)\nhttps://" << names.front()
            << ":8443/ once it runs; browsers believe it with " << (tls_folder / "web-ca.pem").string()
            << "\nNext: put your devices into " << file.string() << ", then "
            << (folder == service_folder ? "systemctl enable --now rrgate" : "rrgate serve --config " + file.string())
            << "\n";
  return exit_ok;
}

}  // namespace

void add_init(Commands& commands) {
  const auto [app, options] = commands.add("init", "Write a first configuration, with TLS and a user", init);
  app.add_option("FOLDER", options.folder, "Folder of the configuration")
      ->capture_default_str()
      ->option_text("[/etc/rrgate]");
  app.add_option("--user", options.user, "Name of the first user")->capture_default_str()->option_text("NAME [admin]");
}

}  // namespace rrgate
