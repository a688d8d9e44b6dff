// rrgate serve: the gateway as a service. Layer: server/cli.
#include "server/cli/command.hpp"
#include "server/cli/findings.hpp"
#include "server/cli/run_gateway.hpp"

namespace rrgate {

int run_serve(Arguments arguments) {
  constexpr std::string_view options[] = {"--config"};
  const auto parsed = parse_arguments(arguments, {options});
  if (!parsed.error.empty()) return usage_error("serve", parsed.error);
  if (!parsed.operands.empty()) return usage_error("serve", "unexpected " + rr::quote(parsed.operands.front()));
  const auto file = parsed.options.find("--config");
  if (file == parsed.options.end()) return usage_error("serve", "missing --config FILE");
  auto config = load_config(file->second);
  if (!report_findings(file->second, config)) return exit_usage;
  return run_gateway(
      std::move(config.config), [](auto&, auto&, const auto&) {}, file->second);
}

}  // namespace rrgate
