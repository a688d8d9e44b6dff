// rrgate check-config: whether `rrgate serve` would take a file. Layer: server/cli.
#include "node/tls/client_certificates.hpp"
#include "server/access/access.hpp"
#include "server/cli/command.hpp"
#include "server/cli/findings.hpp"
#include "server/cli/service_rights.hpp"
#include "server/config/cautions.hpp"

namespace rrgate {

int run_check_config(Arguments arguments) {
  constexpr std::string_view options[] = {"--as-service"};
  const auto parsed = parse_arguments(arguments, {options});
  if (!parsed.error.empty()) return usage_error("check-config", parsed.error);
  if (parsed.operands.size() != 1) return usage_error("check-config", "expected one FILE");
  const auto& file = parsed.operands.front();
  const auto config = load_config(file);
  if (!report_findings(file, config)) return exit_usage;
  if (const auto& certificates = config.config.tls.certificates; !certificates.empty())
    if (const auto tls = rr::make_web_tls(certificates, config.config.access.clients); !tls) {
      std::cerr << short_name(file) << ": /tls/certificates: " << tls.error().message << "\n";
      return exit_usage;
    }
  if (const auto access = load_access(config.config.access); !access) {
    std::cerr << short_name(file) << ": /access: " << access.error().message << "\n";
    return exit_usage;
  }
  if (const auto user = parsed.options.find("--as-service"); user != parsed.options.end()) {
    const auto missing = find_missing_rights(user->second, file, config.config);
    if (!missing) return report_failure("check-config", missing.error().message);
    for (const auto& sentence : *missing) std::cerr << short_name(file) << ": " << sentence << "\n";
    if (!missing->empty()) return exit_usage;
  }
  for (const auto& caution : find_cautions(config.config))
    std::cerr << format_finding(short_name(file), {caution.path, "warning: " + caution.text}) << "\n";
  std::cout << short_name(file) << ": good; " << config.config.devices.size() << " devices\n";
  return exit_ok;
}

}  // namespace rrgate
