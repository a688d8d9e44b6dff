// rrgate serve: the gateway as a service. Layer: server/cli.
#include "server/cli/command.hpp"
#include "server/cli/findings.hpp"
#include "server/cli/run_gateway.hpp"

namespace rrgate {

namespace {

struct ServeOptions {
  std::string config;
};

int serve(const ServeOptions& options) {
  if (options.config.empty()) return usage_error("serve", "FILE is required");
  auto config = load_config(options.config);
  if (!report_findings(options.config, config)) return exit_usage;
  return run_gateway(
      std::move(config.config), [](auto&, auto&, const auto&) {}, options.config);
}

}  // namespace

void add_serve(Commands& commands) {
  const auto [app, options] = commands.add("serve", "Run the gateway", serve);
  auto* file = app.add_option("FILE", options.config, "Configuration")->option_text(" ");
  app.add_option("--config", options.config, "The same")->option_text("FILE")->excludes(file);
}

}  // namespace rrgate
