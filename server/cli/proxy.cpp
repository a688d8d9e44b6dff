// rrgate proxy: a gateway for one device, without a file. Layer: server/cli.
#include <iostream>
#include <nlohmann/json.hpp>

#include "server/cli/command.hpp"
#include "server/cli/run_gateway.hpp"

namespace rrgate {

int run_proxy(Arguments arguments) {
  constexpr std::string_view options[] = {"--port", "--name"};
  constexpr std::string_view flags[] = {"--relay"};
  const auto parsed = parse_arguments(arguments, {options, flags});
  if (!parsed.error.empty()) return usage_error("proxy", parsed.error);
  if (parsed.operands.size() != 1) return usage_error("proxy", "expected URL");
  const auto port = number_option(parsed, "--port", 8080, 65535);
  if (!port) return usage_error("proxy", "--port: expected 0 to 65535");
  const auto url = rr::parse_url(parsed.operands[0]);
  if (!url) return usage_error("proxy", url.error().message);
  auto name = url->service;
  if (const auto given = parsed.options.find("--name"); given != parsed.options.end()) name = given->second;
  // As a file would say it: the rules for names and addresses are the same.
  auto text = nlohmann::json::object();
  text["listen"] = {"127.0.0.1:" + std::to_string(*port)};
  text["devices"] = {
      {{"name", name}, {"url", parsed.operands[0]}, {"mode", parsed.flags.contains("--relay") ? "relay" : "shared"}}};
  text["log"] = {{"level", "warning"}};
  auto read = parse_config(text.dump());
  if (!read.findings.empty()) return usage_error("proxy", format_finding("configuration", read.findings.front()));
  return run_gateway(std::move(read.config), [&](auto&, Gateway&, const auto& addresses) {
    std::cout << "rrgate proxy: http://127.0.0.1:" << addresses.front().port << "/ stands for " << parsed.operands[0]
              << std::endl;
  });
}

}  // namespace rrgate
