// rrgate token: API tokens, in the file that "tokens_file" names. Layer: server/cli.
#include <iostream>
#include <nlohmann/json.hpp>

#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"
#include "server/access/access_text.hpp"
#include "server/access/api_tokens.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

namespace {

struct TokenOptions {
  std::string file;
  std::string name;
  std::string roles;
  int days = 0;
  bool deletes = false;
  bool is_json = false;
};

/// "_" for ever.
std::string last_day(int days) {
  const auto today = std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
  return days == 0 ? "_" : format_day(today + std::chrono::days(days));
}

int make_token(const TokenOptions& options) {
  const auto& [file, name, role_names, days, deletes, is_json] = options;
  if (auto checked = check_name("token name", name); !checked) return usage_error("token", checked.error().message);
  const auto roles = parse_roles(role_names);
  if (!roles) return usage_error("token", "--roles: " + roles.error().message);

  std::error_code error;
  const auto old = read_text_file(file);
  if (!old && std::filesystem::exists(file, error)) return report_failure("token", file + ": can't be read");
  const auto text = old.value_or("");
  if (const auto tokens = ApiTokens::from_text(text); !tokens)
    return report_failure("token", file + ": " + tokens.error().message);
  const bool is_there = !find_line(text, name).empty();
  if (is_there != deletes)
    return report_failure("token", file + (deletes ? " has no token " : " has a token already of the name ") +
                                       rr::quote(name) + (deletes ? "" : "; --delete takes it out"));
  const auto token = make_api_token();
  const auto line =
      deletes ? "" : name + " " + hash_api_token(token) + " " + format_roles(*roles) + " " + last_day(days);
  if (auto done = rr::write_secret(file, with_line(text, name, line), true, rr::SecretReaders::folder_group); !done)
    return report_failure("token", done.error().message);
  if (is_json) {
    nlohmann::ordered_json made{{"file", file}, {"name", name}, {"change", deletes ? "deleted" : "added"}};
    if (!deletes) made["token"] = token;
    print_json_line(made);
    return exit_ok;
  }
  if (deletes) {
    std::cout << file << ": token " << rr::quote(name) << " is deleted\n";
    return exit_ok;
  }
  std::cerr << file << ": token " << rr::quote(name) << " is added. It is shown this once:\n";
  std::cout << token << "\n";
  return exit_ok;
}

}  // namespace

void add_token(Commands& commands) {
  const auto [app, options] = commands.add("token", "Make an API token", make_token);
  app.add_option("FILE", options.file, "The file of the option \"tokens_file\"")->required()->option_text(" ");
  app.add_option("NAME", options.name, "Name of the token")->required()->option_text(" ");
  auto* deletes = app.add_flag("--delete", options.deletes, "Delete the token");
  app.add_option("--roles", options.roles, "Roles")->option_text("A,B")->excludes(deletes);
  app.add_option("--days", options.days, "Days until it expires; default: never")
      ->check(CLI::Range(1, 36500))
      ->option_text("N")
      ->excludes(deletes);
  app.add_flag("--json", options.is_json, "Print what was changed, with the token, as one line of JSON");
}

}  // namespace rrgate
