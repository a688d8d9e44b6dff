// rrgate proxy: a gateway for one device, without a file. Layer: server/cli.
#include <iostream>
#include <nlohmann/json.hpp>

#include "server/cli/command.hpp"
#include "server/cli/remote_service.hpp"
#include "server/cli/run_gateway.hpp"

namespace rrgate {

namespace {

struct ProxyOptions {
  std::string url;
  std::optional<std::string> name;
  std::string user;
  std::uint16_t port = 8080;
  bool is_relay = false;
  bool is_json = false;
};

/// As a file would say it: the rules for names and addresses are the same. Throws   NotUnderstood.
Config config_of(const ProxyOptions& options) {
  const auto url = rr::parse_url(options.url);
  if (!url) throw NotUnderstood(url.error().message);
  auto device = nlohmann::json::object();
  device["name"] = options.name.value_or(url->service);
  device["url"] = options.url;
  device["mode"] = options.is_relay ? "relay" : "shared";
  auto text = nlohmann::json::object();
  text["listen"] = {"127.0.0.1:" + std::to_string(options.port)};
  text["devices"] = nlohmann::json::array({device});
  text["log"] = {{"level", "warning"}};
  auto read = parse_config(text.dump());
  if (!read.findings.empty()) throw NotUnderstood(format_finding("configuration", read.findings.front()));
  auto& login = read.config.devices.front().login;
  login.username = options.user;
  if (!options.user.empty()) login.credentials.items.emplace_back("password", rr::Value(user_password()));
  return std::move(read.config);
}

int run_proxy(const ProxyOptions& options) {
  Config config;
  try {
    config = config_of(options);
  } catch (const NotUnderstood& mistake) {
    return usage_error("proxy", mistake.what());
  }
  return run_gateway(std::move(config), [&](auto&, Gateway&, const auto& addresses) {
    const auto address = "http://127.0.0.1:" + std::to_string(addresses.front().port) + "/";
    if (options.is_json)
      print_json_line({{"url", address}, {"device", options.url}});
    else
      std::cout << "rrgate proxy: " << address << " stands for " << options.url << std::endl;
  });
}

}  // namespace

void add_proxy(Commands& commands) {
  const auto [app, options] = commands.add("proxy", "Run a gateway for one device, without a file", run_proxy);
  app.add_option("URL", options.url, "The device's service")->required()->option_text(" ");
  app.add_option("--name", options.name, "Name of the device; default: the name of the service")->option_text("NAME");
  app.add_option("--port", options.port, "Port on 127.0.0.1; 0 for a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str()
      ->option_text("N [8080]");
  auto* relay = app.add_flag("--relay", options.is_relay, "Give each client its own session with the device");
  app.add_option("--user", options.user, "Log in at the device, with the password of $RRGATE_PASSWORD")
      ->excludes(relay)
      ->option_text("NAME");
  app.add_flag("--json", options.is_json, "Print the address as one line of JSON");
}

}  // namespace rrgate
