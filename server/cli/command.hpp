// The program's commands. Layer: server/cli. Each is one file that adds itself, and one row in command_line.cpp.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace rrgate {

/// Exit codes: done; failed while running; not understood (arguments or configuration); of `audit`, a file that can't
/// be read, which says nothing of its chain.
enum ExitCode { exit_ok = 0, exit_failed = 1, exit_usage = 2, exit_unreadable = 3 };
/// The end of a command's help, unless it has codes of its own.
inline constexpr const char* exit_codes = "Exit codes: 0 done; 1 failed; 2 wrong options or arguments";

/// A command before the program runs it: its options, bound to `values`.
template <class Options>
struct NewCommand {
  CLI::App& app;
  Options& values;
};

class Commands {
 public:
  Commands();

  /// A command that calls `action` with its options as the command line gives them. `below`  the command that it is a
  /// part of, as "ca" is of "cert".
  template <class Options>
  NewCommand<Options> add(const std::string& name, const std::string& summary, int (*action)(const Options&),
                          CLI::App* below = nullptr) {
    auto* app = add_app(name, summary, below ? *below : app_);
    const auto values = std::make_shared<Options>();
    app->callback([this, values, action] { chosen_ = [values, action] { return action(*values); }; });
    return {*app, *values};
  }
  /// A command that has commands.
  CLI::App& add_group(const std::string& name, const std::string& summary);

  /// Commands that are added from now on stand under it in the help.
  void set_heading(const std::string& heading) { heading_ = heading; }

  /// `words`  what follows the program's name. Returns an exit code.
  int run(std::vector<std::string> words);
  const CLI::App& app() const { return app_; }

 private:
  CLI::App* add_app(const std::string& name, const std::string& summary, CLI::App& below);

  CLI::App app_;
  std::string heading_ = "Commands";
  std::function<int()> chosen_;
};

/// All commands of rrgate.
int run_command_line(std::vector<std::string> words);

/// One line on standard output, at once: whoever reads a pipe sees each as it comes.
void print_json_line(const nlohmann::ordered_json& json);

/// Prints "rrgate NAME: what" and how to get help to stderr; returns exit_usage.
int usage_error(std::string_view command, std::string_view what);
/// Prints "rrgate NAME: what" to stderr; returns exit_failed.
int report_failure(std::string_view command, std::string_view what);

void add_serve(Commands& commands);
void add_demo(Commands& commands);
void add_proxy(Commands& commands);
void add_init(Commands& commands);
void add_check_config(Commands& commands);
void add_health(Commands& commands);
void add_passwd(Commands& commands);
void add_token(Commands& commands);
void add_audit(Commands& commands);
void add_cert(Commands& commands);
void add_ls(Commands& commands);
void add_info(Commands& commands);
void add_robdef(Commands& commands);
void add_get(Commands& commands);
void add_set(Commands& commands);
void add_call(Commands& commands);
void add_watch(Commands& commands);
void add_record(Commands& commands);
void add_replay(Commands& commands);
void add_export(Commands& commands);
void add_mcp(Commands& commands);
void add_ping(Commands& commands);
void add_bench(Commands& commands);
void add_top(Commands& commands);
void add_check(Commands& commands);
void add_fmt(Commands& commands);
void add_generate(Commands& commands);
void add_completion(Commands& commands);

}  // namespace rrgate
