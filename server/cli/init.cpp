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

/// Why the folder's configuration is somebody's already; empty: there is none, or it says no more than where to listen.
std::string reason_to_keep(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  const auto text = read_text_file(file.string());
  const auto read = parse_config(text.value_or(""));
  if (!text || !read.findings.empty()) return "is there already, and can't be read";
  auto plain = parse_config(R"({"listen": ["127.0.0.1:8080"], "devices": []})").config;
  plain.listen = read.config.listen;
  if (read.config != plain) return "is there already, and says more than where to listen";
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
  config["tls"]["required"] = true;
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

/// One path for a folder that is named in several ways, as "." and "/etc/rrgate/".
fs::path full_path(const fs::path& folder) {
  std::error_code error;
  auto full = fs::absolute(folder, error).lexically_normal();
  return full.has_filename() ? full : full.parent_path();
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
  bool is_json = false;
};

/// What a run has made.
struct Made {
  fs::path folder;
  CertificateFiles authorities;
  CertificateFiles certificate;  ///< of the web server
  std::vector<std::string> names;
  std::string user;
  std::string password;

  fs::path config() const { return folder / "gateway.json"; }
  fs::path users() const { return folder / "users"; }
  std::string url() const { return "https://" + names.front() + ":8443/"; }
  fs::path web_ca() const { return folder / tls_folder_name / "web-ca.pem"; }
};

void print_json(const Made& made) {
  auto files = nlohmann::ordered_json::array();
  for (const auto* each : {&made.authorities, &made.certificate})
    for (const auto& file : *each) files.push_back(file.string());
  for (const auto& file : {made.users(), made.folder / ticket_key_name, made.config()}) files.push_back(file.string());
  print_json_line({{"config", made.config().string()},
                   {"files", files},
                   {"user", made.user},
                   {"password", made.password},
                   {"names", made.names},
                   {"url", made.url()},
                   {"web_ca", made.web_ca().string()}});
}

void print_text(const Made& made) {
  print_authorities(made.authorities);
  print_web_certificate(made.certificate);
  const auto file = made.config().string();
  std::cout << file << "\n\nuser " << made.user << ", password " << made.password << " (shown this once; rrgate passwd "
            << made.users().string() << " " << made.user << " sets another)\n"
            << made.url() << " once it runs; browsers believe it with " << made.web_ca().string()
            << "\nNext: put your devices into " << file << ", then "
            << (made.folder == service_folder ? "systemctl enable --now rrgate" : "rrgate serve --config " + file)
            << "\n";
}

int init(const InitOptions& options) {
  const auto folder = full_path(options.folder);
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
  TakeBack unfinished(files_beside(folder));

  const auto names = names_of_machine();
  const auto tls_folder = folder / tls_folder_name;
  const auto authorities = make_authorities({.folder = tls_folder, .days = 3650});
  if (!authorities) return report_failure("init", authorities.error().message);
  const auto certificate = make_web_certificate({{.folder = tls_folder}, names});
  if (!certificate) return report_failure("init", certificate.error().message);

  const auto password = write_first_user(folder / "users", user);
  if (!password) return report_failure("init", password.error().message);
  const auto key = encode_base64url(rr::random_bytes(ticket_key_bytes));
  if (const auto done = rr::write_secret(folder / ticket_key_name, key, false, rr::SecretReaders::folder_group); !done)
    return report_failure("init", done.error().message);
  const auto config = make_config(folder, names.front()).dump(2) + "\n";
  if (const auto done = rr::write_secret(file, config, true, rr::SecretReaders::folder_group); !done)
    return report_failure("init", done.error().message);
  unfinished.keep_all();

  const Made made{folder, *authorities, *certificate, names, user, *password};
  options.is_json ? print_json(made) : print_text(made);
  return exit_ok;
}

}  // namespace

void add_init(Commands& commands) {
  const auto [app, options] = commands.add("init", "Write a first configuration, with TLS and a user", init);
  app.add_option("FOLDER", options.folder, "Folder of the configuration")
      ->capture_default_str()
      ->option_text("[/etc/rrgate]");
  app.add_option("--user", options.user, "Name of the first user")->capture_default_str()->option_text("NAME [admin]");
  app.add_flag("--json", options.is_json, "Print what was made, with the password, as one line of JSON");
}

}  // namespace rrgate
