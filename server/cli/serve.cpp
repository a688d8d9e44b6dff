// rrgate serve: the gateway as a service. Layer: server/cli.
#include <nlohmann/json.hpp>

#include "server/cli/command.hpp"
#include "server/cli/findings.hpp"
#include "server/cli/run_gateway.hpp"

namespace rrgate {

namespace {

struct ServeOptions {
  std::string config;
  bool is_json = false;
};

int serve(const ServeOptions& options) {
  if (options.config.empty()) return usage_error("serve", "FILE is required");
  auto config = load_config(options.config);
  if (!report_findings(options.config, config)) return exit_usage;
  const auto tell = [&options](auto&, auto&, const auto& addresses) {
    if (!options.is_json) return;
    auto listen = nlohmann::ordered_json::array();
    for (const auto& [host, port] : addresses) listen.push_back(rr::format_host_port(host, port));
    print_json_line({{"listen", listen}});
  };
  return run_gateway(std::move(config.config), tell, options.config);
}

}  // namespace

void add_serve(Commands& commands) {
  const auto [app, options] = commands.add("serve", "Run the gateway", serve);
  auto* file = app.add_option("FILE", options.config, "Configuration")->option_text(" ");
  app.add_option("--config", options.config, "The same")->option_text("FILE")->excludes(file);
  app.add_flag("--json", options.is_json, "Print the addresses, once they are open, as one line of JSON");
}

}  // namespace rrgate
