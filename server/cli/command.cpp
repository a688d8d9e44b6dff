#include "server/cli/command.hpp"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "server/config/version.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

/// "rrgate cert web": the command that the words led to.
std::string path_of(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return app.get_name() + (chosen.empty() ? "" : " " + path_of(*chosen.back()));
}

}  // namespace

Commands::Commands() : app_("A gateway between devices that speak Robot Raconteur and the web.", "rrgate") {
  app_.require_subcommand(0, 1);
  app_.set_version_flag("--version", "rrgate " + std::string(version), "Print the version");
  app_.get_formatter()->label("SUBCOMMAND", "COMMAND");
  app_.get_formatter()->column_width(36);
}

CLI::App& Commands::add_group(const std::string& name, const std::string& summary) {
  return *add_app(name, summary, app_);
}

CLI::App* Commands::add_app(const std::string& name, const std::string& summary, CLI::App& below) {
  auto* app = below.add_subcommand(name, summary)->require_subcommand(0, 1);
  app->footer(exit_codes);
  return app->group(&below == &app_ ? heading_ : "Commands");
}

int Commands::run(std::vector<std::string> words) {
  if (words.empty()) {
    std::cerr << app_.help();
    return exit_usage;
  }
  if (words.front() == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  // Not before: commands would take them over.
  app_.set_help_all_flag("--help-all", "Print the options of all commands");
  app_.footer("\"rrgate COMMAND --help\" shows the options of a command.");
  std::reverse(words.begin(), words.end());  // as CLI11 takes them
  try {
    app_.parse(std::move(words));
    if (!chosen_) throw CLI::RequiredError("a command");
  } catch (const CLI::Success& told) {
    return app_.exit(told);
  } catch (const CLI::ParseError& mistake) {
    const auto path = path_of(app_);
    std::cerr << path << ": " << mistake.what() << "; see " << path << " --help\n";
    return exit_usage;
  }
  const int code = chosen_();
  if (code != exit_ok || std::cout.flush()) return code;
  std::cerr << path_of(app_) << ": standard output can't be written\n";
  return exit_failed;
}

void print_json_line(const nlohmann::ordered_json& json) {
  std::cout << rr::write_json(json) << std::endl;  // also names of files that are no UTF-8
}

int report_failure(std::string_view command, std::string_view what) {
  std::cerr << "rrgate " << command << ": " << what << "\n";
  return exit_failed;
}

int usage_error(std::string_view command, std::string_view what) {
  std::cerr << "rrgate " << command << ": " << what << "; see rrgate " << command << " --help\n";
  return exit_usage;
}

}  // namespace rrgate
