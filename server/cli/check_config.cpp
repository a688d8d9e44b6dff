// rrgate check-config: whether `rrgate serve` would take a file. Layer: server/cli.
#include "node/tls/client_certificates.hpp"
#include "server/access/access.hpp"
#include "server/cli/command.hpp"
#include "server/cli/findings.hpp"
#include "server/cli/service_rights.hpp"
#include "server/config/cautions.hpp"

namespace rrgate {

namespace {

struct CheckOptions {
  std::string file;
  std::optional<std::string> service_user;
};

int check_config(const CheckOptions& options) {
  const auto& file = options.file;
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
  if (options.service_user) {
    const auto missing = find_missing_rights(*options.service_user, file, config.config);
    if (!missing) return report_failure("check-config", missing.error().message);
    for (const auto& sentence : missing->needed) std::cerr << short_name(file) << ": " << sentence << "\n";
    for (const auto& sentence : missing->optional) std::cerr << short_name(file) << ": warning: " << sentence << "\n";
    if (!missing->needed.empty()) return exit_usage;
  }
  for (const auto& caution : find_cautions(config.config))
    std::cerr << format_finding(short_name(file), {caution.path, "warning: " + caution.text}) << "\n";
  std::cout << short_name(file) << ": good; " << config.config.devices.size() << " devices\n";
  return exit_ok;
}

}  // namespace

void add_check_config(Commands& commands) {
  const auto [app, options] = commands.add("check-config", "Check a configuration", check_config);
  app.add_option("FILE", options.file, "Configuration")->required()->option_text(" ");
  app.add_option("--as-service", options.service_user, "Also report files that this user can't read or write")
      ->option_text("USER");
}

}  // namespace rrgate
