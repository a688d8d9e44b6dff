// rrgate token: API tokens, in the file that "tokens_file" names. Layer: server/cli.
#include <charconv>
#include <iostream>

#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"
#include "server/access/access_text.hpp"
#include "server/access/api_tokens.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

namespace {

/// "_" for ever; empty: not understood.
std::string last_day(const std::string& days) {
  if (days.empty()) return "_";
  int count = 0;
  const auto [end, error] = std::from_chars(days.data(), days.data() + days.size(), count);
  if (error != std::errc() || end != days.data() + days.size() || count < 1 || count > 36500) return {};
  const auto today = std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
  return format_day(today + std::chrono::days(count));
}

}  // namespace

int run_token(Arguments arguments) {
  constexpr std::string_view options[] = {"--roles", "--days"};
  constexpr std::string_view flags[] = {"--delete"};
  const auto parsed = parse_arguments(arguments, {options, flags});
  if (!parsed.error.empty()) return usage_error("token", parsed.error);
  if (parsed.operands.size() != 2) return usage_error("token", "expected FILE and NAME");
  const auto& file = parsed.operands[0];
  const auto& name = parsed.operands[1];
  const bool deletes = parsed.flags.contains("--delete");
  const auto option = [&parsed](const char* key) {
    const auto found = parsed.options.find(key);
    return found == parsed.options.end() ? std::string() : found->second;
  };
  if (deletes && !parsed.options.empty()) return usage_error("token", "--delete takes no other option");
  if (auto checked = check_name("token name", name); !checked) return usage_error("token", checked.error().message);
  const auto roles = parse_roles(option("--roles"));
  if (!roles) return usage_error("token", "--roles: " + roles.error().message);
  const auto until = last_day(option("--days"));
  if (until.empty())
    return usage_error("token", "--days: found " + rr::quote(option("--days")) + ", expected 1 to 36500");

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
  const auto line = deletes ? "" : name + " " + hash_api_token(token) + " " + format_roles(*roles) + " " + until;
  if (auto done = rr::write_secret(file, with_line(text, name, line), true, rr::SecretReaders::folder_group); !done)
    return report_failure("token", done.error().message);
  if (deletes) {
    std::cout << file << ": token " << rr::quote(name) << " is deleted\n";
    return exit_ok;
  }
  std::cerr << file << ": token " << rr::quote(name) << " is added. It is shown this once:\n";
  std::cout << token << "\n";
  return exit_ok;
}

}  // namespace rrgate
