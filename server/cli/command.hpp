// Subcommands and their options. Layer: server/cli. Each subcommand is one file and one row in main.cpp.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace rrgate {

/// Exit codes: done; failed while running; not understood (arguments or configuration).
enum ExitCode { exit_ok = 0, exit_failed = 1, exit_usage = 2 };

using Arguments = std::span<const std::string_view>;

struct Command {
  std::string_view name;
  std::string_view usage;    ///< "serve --config FILE"
  std::string_view summary;  ///< one line for --help
  int (*run)(Arguments arguments);
};

/// Runs the command that the arguments name, or answers --help and --version.
int run_command_line(std::span<const Command> commands, Arguments arguments);

/// What a subcommand takes beside operands.
struct KnownOptions {
  std::span<const std::string_view> options = {};   ///< "--name VALUE" or "--name=VALUE", once
  std::span<const std::string_view> flags = {};     ///< "--name" alone
  std::span<const std::string_view> repeated = {};  ///< as options, any number of times
};

struct ParsedArguments {
  std::map<std::string, std::string, std::less<>> options;
  std::set<std::string, std::less<>> flags;
  std::vector<std::string> repeated;  ///< the values of all repeated options, in order
  std::vector<std::string> operands;
  std::string error;  ///< not empty: what wasn't understood
};
ParsedArguments parse_arguments(Arguments arguments, const KnownOptions& known);

/// A whole number of an option; `absent` without it. nullopt: it is none, or above `largest`.
std::optional<std::uint64_t> number_option(const ParsedArguments& parsed, std::string_view name, std::uint64_t absent,
                                           std::uint64_t largest);

/// Prints "rrgate NAME: what" and how to get help to stderr; returns exit_usage.
int usage_error(std::string_view command, std::string_view what);
/// Prints "rrgate NAME: what" to stderr; returns exit_failed.
int report_failure(std::string_view command, std::string_view what);

// The subcommands.
int run_serve(Arguments arguments);
int run_check_config(Arguments arguments);
int run_demo(Arguments arguments);
int run_check(Arguments arguments);
int run_fmt(Arguments arguments);
int run_generate(Arguments arguments);
int run_cert(Arguments arguments);
int run_passwd(Arguments arguments);
int run_token(Arguments arguments);
int run_health(Arguments arguments);
int run_init(Arguments arguments);
int run_ls(Arguments arguments);
int run_info(Arguments arguments);
int run_robdef(Arguments arguments);
int run_get(Arguments arguments);
int run_set(Arguments arguments);
int run_call(Arguments arguments);
int run_watch(Arguments arguments);
int run_ping(Arguments arguments);
int run_proxy(Arguments arguments);

}  // namespace rrgate
