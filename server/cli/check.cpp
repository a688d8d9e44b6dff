// rrgate check: whether service definitions are good. Layer: server/cli.
#include "server/cli/definition_options.hpp"

namespace rrgate {

namespace {

struct CheckDefinitionsOptions : DefinitionOptions {
  bool is_json = false;
};

int check(const CheckDefinitionsOptions& options) {
  const auto set = DefinitionSet::from_files(options.files, options.folders, options.mode());
  if (options.is_json) {
    for (const auto& diagnostic : set.diagnostics()) print_json_diagnostic(diagnostic);
    return set.is_good() ? exit_ok : exit_failed;
  }
  if (!report_diagnostics(set)) return exit_failed;
  for (const auto* definition : set.requested())
    std::cout << definition->file << ": good; " << definition->name << "\n";
  return exit_ok;
}

}  // namespace

void add_check(Commands& commands) {
  const auto [app, options] = commands.add("check", "Check service definitions", check);
  add_files(app, options);
  add_folders(app, options);
  add_compat(app, options);
  app.add_flag("--json", options.is_json, "Print each error and warning as one line of JSON");
}

}  // namespace rrgate
