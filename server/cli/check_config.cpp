// rrgate check-config: whether `rrgate serve` would take a file. Layer: server/cli.
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "node/tls/client_certificates.hpp"
#include "server/access/access.hpp"
#include "server/cli/command.hpp"
#include "server/cli/findings.hpp"
#include "server/cli/service_rights.hpp"
#include "server/config/cautions.hpp"
#include "server/config/tls_files.hpp"
#include "server/upstream/found_devices.hpp"

namespace rrgate {

namespace {

struct CheckOptions {
  std::string file;
  std::optional<std::string> service_user;
  bool is_json = false;
};

/// What is said of a file. Without errors, `rrgate serve` takes it.
struct CheckedConfig {
  std::vector<Finding> errors;
  std::vector<Finding> warnings;
  std::size_t devices = 0;
};

/// What is wrong with the files that the gateway reads when it starts.
std::vector<Finding> judge_files(const Config& config) {
  std::vector<Finding> wrong;
  const auto expect = [&wrong](std::string path, const auto& loaded) {
    if (!loaded) wrong.push_back({std::move(path), loaded.error().message});
  };
  if (const auto& certificates = config.tls.certificates; !certificates.empty())
    expect("/tls/certificates", rr::make_web_tls(certificates, config.access.clients));
  expect("/access", load_access(config.access));
  for (std::size_t i = 0; i < config.devices.size(); ++i)
    for (const auto& files : {make_device_tls(config.devices[i]), make_device_https(config.devices[i])})
      if (files) expect("/devices/" + std::to_string(i) + "/tls/ca", files->load());
  if (config.discover.is_enabled && !config.discover.tls.ca.empty())
    expect("/discover/tls/ca", FoundDevices::load_tls(config.discover));
  return wrong;
}

/// Errors   those of find_missing_rights().
rr::Result<CheckedConfig> judge(const CheckOptions& options) {
  const auto parsed = options.file == "-" ? parse_config(std::string(std::istreambuf_iterator<char>(std::cin), {}))
                                          : load_config(options.file);
  const auto& config = parsed.config;
  if (!parsed.findings.empty()) return CheckedConfig{parsed.findings};
  if (auto wrong = judge_files(config); !wrong.empty()) return CheckedConfig{std::move(wrong)};
  CheckedConfig out;
  out.devices = config.devices.size();
  if (options.service_user) {
    const auto missing = find_missing_rights(*options.service_user, options.file, config);
    if (!missing) return missing.error();
    for (const auto& sentence : missing->needed) out.errors.push_back({"", sentence});
    for (const auto& sentence : missing->optional) out.warnings.push_back({"", sentence});
  }
  if (out.errors.empty())
    for (auto& caution : find_cautions(config)) out.warnings.push_back(std::move(caution));
  return out;
}

nlohmann::ordered_json to_json(const std::vector<Finding>& findings) {
  auto out = nlohmann::ordered_json::array();
  for (const auto& [path, text] : findings) out.push_back({{"path", path}, {"text", text}});
  return out;
}

int check_config(const CheckOptions& options) {
  if (options.file == "-" && options.service_user)
    return usage_error("check-config", "--as-service takes a file, and no standard input");
  const auto name = short_name(options.file);
  const auto verdict = judge(options);
  if (!verdict) return report_failure("check-config", verdict.error().message);
  const auto& [errors, warnings, devices] = *verdict;
  const bool is_good = errors.empty();
  if (options.is_json) {
    print_json_line({{"file", options.file},
                     {"good", is_good},
                     {"devices", devices},
                     {"errors", to_json(errors)},
                     {"warnings", to_json(warnings)}});
    return is_good ? exit_ok : exit_usage;
  }
  for (const auto& error : errors) std::cerr << format_finding(name, error) << "\n";
  for (const auto& [path, text] : warnings)
    std::cerr << name << ": " << (path.empty() ? "" : path + ": ") << "warning: " << text << "\n";
  if (is_good) std::cout << name << ": good; " << devices << " devices\n";
  return is_good ? exit_ok : exit_usage;
}

}  // namespace

void add_check_config(Commands& commands) {
  const auto [app, options] = commands.add("check-config", "Check a configuration", check_config);
  app.footer("Exit codes: 0 good; 1 failed; 2 the configuration has errors, or wrong options or arguments");
  app.add_option("FILE", options.file, "Configuration; - for standard input")->required()->option_text(" ");
  app.add_option("--as-service", options.service_user, "Also report files that this user can't read or write")
      ->option_text("USER");
  app.add_flag("--json", options.is_json, "Print errors and warnings as one line of JSON");
}

}  // namespace rrgate
