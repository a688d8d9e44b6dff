// rrgate passwd: users and their passwords, in the file that "users_file" names. Layer: server/cli.
#include <termios.h>
#include <unistd.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/support/words.hpp"
#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"
#include "node/service/password_file.hpp"
#include "server/access/access_text.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_password_size = 1024;  // as logins take it

/// Nothing is shown of what is typed while this is there.
class NoEcho {
 public:
  NoEcho() {
    if (::tcgetattr(STDIN_FILENO, &before_) != 0) return;
    auto silent = before_;
    silent.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    is_silent_ = ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &silent) == 0;
  }
  NoEcho(const NoEcho&) = delete;
  NoEcho& operator=(const NoEcho&) = delete;
  ~NoEcho() {
    if (is_silent_) ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
  }

 private:
  termios before_{};
  bool is_silent_ = false;
};

std::optional<std::string> ask(const char* prompt) {
  const NoEcho silence;
  std::cerr << prompt << std::flush;
  std::string line;
  const bool has_line = static_cast<bool>(std::getline(std::cin, line));
  std::cerr << "\n";
  return has_line ? std::optional(line) : std::nullopt;
}

/// From the terminal, twice; else the first line of the standard input.
rr::Result<std::string> read_password(const std::string& name) {
  std::optional<std::string> password;
  if (::isatty(STDIN_FILENO)) {
    password = ask(("Password of " + rr::quote(name) + ": ").c_str());
    if (password && ask("The same again: ") != password)
      return rr::make_error(rr::ErrorCode::invalid_argument, "the two passwords differ; nothing was changed");
  } else {
    std::string line;
    if (std::getline(std::cin, line)) password = line;
  }
  if (!password || password->empty() || password->size() > max_password_size)
    return rr::make_error(rr::ErrorCode::invalid_argument,
                          "expected a password of 1 to 1024 bytes; nothing was changed");
  return std::move(*password);
}

rr::Result<std::string> make_line(const std::string& name, std::string_view before,
                                  const std::optional<std::string>& roles) {
  // Roles and nodes stay as they are where nothing is said of them.
  const auto fields = rr::split_words(before);
  std::string privileges(fields.size() > 2 ? fields[2] : "_");
  if (roles) {
    const auto parsed = parse_roles(*roles);
    if (!parsed) return parsed.error();
    privileges = format_roles(*parsed);
  }
  const auto password = read_password(name);
  if (!password) return password.error();
  const auto hash = rr::PasswordHash::make_scrypt(*password);
  if (!hash) return hash.error();
  std::string line = name;
  line.append(" ").append(hash->text()).append(" ").append(privileges);
  if (fields.size() > 3) line.append(" ").append(fields[3]);
  return line;
}

/// Empty where there is no file.
rr::Result<std::string> read_users(const std::string& file) {
  std::error_code error;
  auto text = read_text_file(file);
  if (!text && std::filesystem::exists(file, error))
    return rr::make_error(rr::ErrorCode::io_error, file + ": can't be read");
  if (!text) return std::string();
  if (const auto users = rr::PasswordFileAuthenticator::from_text(*text, {.accepts_md5 = true}); !users)
    return rr::make_error(users.error().code, file + ": " + users.error().message);
  return std::move(*text);
}

struct PasswordOptions {
  std::string file;
  std::string name;
  std::optional<std::string> roles;
  bool deletes = false;
  bool is_json = false;
};

int set_password(const PasswordOptions& options) {
  const auto& [file, name, roles, deletes, is_json] = options;
  if (auto checked = check_name("user name", name); !checked) return usage_error("passwd", checked.error().message);

  auto text = read_users(file);
  if (!text) return report_failure("passwd", text.error().message);
  const std::string before(find_line(*text, name));
  if (deletes && before.empty()) return report_failure("passwd", file + " has no user " + rr::quote(name));
  std::string line;
  if (!deletes) {
    auto made = make_line(name, before, roles);
    if (!made) return report_failure("passwd", made.error().message);
    line = std::move(*made);
    text = read_users(file);  // whoever typed took his time
    if (!text) return report_failure("passwd", text.error().message);
    if (find_line(*text, name) != before)
      return report_failure("passwd",
                            file + ": user " + rr::quote(name) + " was changed meanwhile; nothing was changed");
  }
  if (auto done = rr::write_secret(file, with_line(*text, name, line), true, rr::SecretReaders::folder_group); !done)
    return report_failure("passwd", done.error().message);
  const std::string change = deletes ? "deleted" : before.empty() ? "added" : "changed";
  if (is_json)
    print_json_line({{"file", file}, {"user", name}, {"change", change}});
  else
    std::cout << file << ": user " << rr::quote(name) << " is " << change << "\n";
  return exit_ok;
}

}  // namespace

void add_passwd(Commands& commands) {
  const auto [app, options] = commands.add("passwd", "Set a user's password and roles", set_password);
  app.add_option("FILE", options.file, "The file of the option \"users_file\"")->required()->option_text(" ");
  app.add_option("NAME", options.name, "The user")->required()->option_text(" ");
  auto* deletes = app.add_flag("--delete", options.deletes, "Delete the user");
  app.add_option("--roles", options.roles, "Roles, or _ for none; default: unchanged")
      ->option_text("A,B")
      ->excludes(deletes);
  app.add_flag("--json", options.is_json, "Print what was changed as one line of JSON");
}

}  // namespace rrgate
