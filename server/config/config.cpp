#include "server/config/config.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "node/http/origin.hpp"
#include "server/config/access_options.hpp"
#include "server/config/device_options.hpp"
#include "server/config/object_reader.hpp"

namespace rrgate {

namespace {

constexpr std::int64_t hour_ms = 3'600'000;

void read_node(ObjectReader& in, NodeConfig& node) {
  in.text("name", node.name);
  if (!rr::is_valid_node_name(node.name))
    in.finding("name", wrong_text(node.name, "letters, digits, '_', '-', '.', a letter first"));
  in.node_id("id", node.id);
}

void read_tls(ObjectReader& in, TlsConfig& tls) {
  in.objects("certificates", false, [&](ObjectReader& item) {
    rr::WebCertificate certificate;
    item.required_file("cert", certificate.certificate_file);
    item.required_file("key", certificate.key_file);
    tls.certificates.push_back(std::move(certificate));
  });
  in.flag("required", tls.is_required);
  in.size("hsts_seconds", tls.hsts_seconds, {0, 100'000'000});
}

void read_proxy(ObjectReader& in, Config& config) {
  in.text("base_path", config.base_path);
  if (!is_path_prefix(config.base_path))
    in.finding("base_path", wrong_text(config.base_path, "a path as \"/robots\", without '/' at its end"));
  in.texts("trusted_proxies", false, [&](const std::string& text) -> std::string {
    const auto range = parse_address_range(text);
    if (!range) return wrong_text(text, "an address or a range as \"10.0.0.0/8\", no bits set behind it");
    config.proxy.trust.proxies.push_back(*range);
    return {};
  });
  std::string headers = "x-forwarded";
  std::string protocol = "off";
  in.choice("proxy_headers", headers, {"x-forwarded", "forwarded"});
  in.choice("proxy_protocol", protocol, {"off", "required"});
  config.proxy.trust.headers = headers == "forwarded" ? ForwardedBy::forwarded : ForwardedBy::x_forwarded;
  config.proxy.has_proxy_protocol = protocol == "required";
  if (config.proxy.has_proxy_protocol && config.proxy.trust.proxies.empty())
    in.finding("proxy_protocol", "expected trusted_proxies too: the header is accepted only from these");
}

void read_limits(ObjectReader& in, Limits& limits) {
  in.size("max_message_size", limits.max_message_size, {16 * 1024, 100 * 1024 * 1024});
  in.size("header_bytes", limits.header_bytes, {1024, 65536});
  in.size("body_bytes", limits.body_bytes, {1024, 104857600});
  in.duration("header_timeout_ms", limits.header_timeout, {100, hour_ms});
  in.size("outbox_bytes", limits.outbox_bytes, {16 * 1024, 64 * 1024 * 1024});
  in.size("clients", limits.clients, {1, 1'000'000});
  in.size("clients_per_address", limits.clients_per_address, {1, 1'000'000});
  in.size("memory", limits.memory, {0, 1'000'000'000'000});
  in.size("client_queue_bytes", limits.client_queue_bytes, {64 * 1024, 1'000'000'000});
  in.size("opaque_rate", limits.opaque_rate, {1024, 1'000'000'000'000});
}

void read_rate(ObjectReader& in, RateLimit& rate) {
  in.size("per_second", rate.per_second, {0, 1'000'000});
  in.size("at_once", rate.at_once, {0, 1'000'000});
}

void read_rates(ObjectReader& in, Rates& rates) {
  in.object("client", [&](ObjectReader& part) { read_rate(part, rates.client); });
  in.object("user", [&](ObjectReader& part) { read_rate(part, rates.user); });
  in.object("device", [&](ObjectReader& part) { read_rate(part, rates.device); });
}

void read_timeouts(ObjectReader& in, Timeouts& timeouts) {
  in.duration("connect_ms", timeouts.connect, {100, hour_ms});
  in.duration("drain_ms", timeouts.drain, {0, hour_ms});
  in.duration("send_stall_ms", timeouts.send_stall, {100, hour_ms});
  in.duration("idle_ms", timeouts.idle, {100, hour_ms});
  in.duration("unused_session_ms", timeouts.unused_session, {0, hour_ms});
  in.duration("request_ms", timeouts.request, {100, hour_ms});
}

void read_retry(ObjectReader& in, Retry& retry) {
  in.duration("min_ms", retry.min, {50, hour_ms});
  in.duration("max_ms", retry.max, {50, hour_ms});
  in.duration("online_ms", retry.online, {50, hour_ms});
}

void read_serve(ObjectReader& in, ServeConfig& serve) {
  serve.is_enabled = true;
  in.size("max_devices", serve.max_devices, {1, 4096});
  std::string mode = "shared";
  in.choice("mode", mode, {"shared", "relay"});
  serve.mode = mode == "relay" ? DeviceMode::relay : DeviceMode::shared;
}

void read_mcp(ObjectReader& in, McpConfig& mcp) {
  mcp.is_enabled = true;
  in.duration("longest_wait_ms", mcp.longest_wait, {1000, hour_ms});
  in.duration("longest_approval_ms", mcp.longest_approval, {1000, hour_ms});
}

void read_config(ObjectReader& in, Config& config) {
  std::string schema;  // for editors
  in.text("$schema", schema);
  in.texts("listen", true, [&](const std::string& text) -> std::string {
    auto address = rr::parse_host_port(text);
    if (!address) return address.error().message;
    config.listen.push_back(*address);
    return {};
  });
  in.objects("devices", true, [&](ObjectReader& item) {
    DeviceConfig device;
    read_device(item, device);
    const auto same = [&](const DeviceConfig& other) { return other.name == device.name; };
    if (!device.name.empty() && std::any_of(config.devices.begin(), config.devices.end(), same))
      item.finding("name", "found " + rr::quote(device.name) + " a second time; expected a name of its own");
    config.devices.push_back(std::move(device));
  });
  in.object("discover", [&](ObjectReader& part) { read_discover(part, config.discover); });
  in.object("node", [&](ObjectReader& part) { read_node(part, config.node); });
  in.text("web_root", config.web_root);
  read_proxy(in, config);
  in.texts("allowed_origins", false, [&](const std::string& text) -> std::string {
    if (!is_origin_pattern(text)) return wrong_text(text, "scheme://host[:port] or scheme://*.domain[:port]");
    config.allowed_origins.push_back(text);
    return {};
  });
  in.texts("allowed_hosts", false, [&](const std::string& text) -> std::string {
    if (!is_host_pattern(text))
      return wrong_text(text, "a name as \"mybox.local\" or \"*.domain\", without scheme and port");
    config.allowed_hosts.push_back(text);
    return {};
  });
  in.object("tls", [&](ObjectReader& part) { read_tls(part, config.tls); });
  in.object("audit", [&](ObjectReader& part) { read_audit(part, config.access.audit); });
  in.object("access", [&](ObjectReader& part) { read_access(part, config.access); });
  in.flag("insecure", config.insecure);
  in.object("limits", [&](ObjectReader& part) { read_limits(part, config.limits); });
  in.object("rates", [&](ObjectReader& part) { read_rates(part, config.rates); });
  in.object("timeouts", [&](ObjectReader& part) { read_timeouts(part, config.timeouts); });
  in.object("retry", [&](ObjectReader& part) { read_retry(part, config.retry); });
  in.object("mcp", [&](ObjectReader& part) { read_mcp(part, config.mcp); });
  in.object("serve", [&](ObjectReader& part) { read_serve(part, config.serve); });
  in.object("recordings", [&](ObjectReader& part) { read_recordings(part, config.recordings); });
  in.object("log", [&](ObjectReader& part) {
    part.choice("level", config.log.level, {"trace", "debug", "info", "warning", "error"});
    part.choice("format", config.log.format, {"text", "json"});
  });
}

void check_whole(const Config& config, const nlohmann::json& document, std::vector<Finding>& findings) {
  if (document.contains("listen") && document["listen"].is_array() && document["listen"].empty())
    findings.push_back({"/listen", "empty; expected at least one \"host:port\""});
  if (config.retry.min > config.retry.max)
    findings.push_back({"/retry/min_ms", "found " + std::to_string(config.retry.min.count()) +
                                             ", expected at most max_ms (" + std::to_string(config.retry.max.count()) +
                                             ")"});
  check_access(config, findings);
}

/// A sentence of nlohmann, with the end alone of the token that it shows: a comment before it is part of the token.
std::string with_short_token(std::string what) {
  constexpr std::string_view token = "last read: '";
  constexpr std::size_t longest_end = 120;
  const auto begin = what.find(token);
  if (begin == std::string::npos || what.size() - begin <= token.size() + longest_end) return what;
  auto end = what.size() - longest_end;
  while ((static_cast<unsigned char>(what[end]) & 0xc0) == 0x80) ++end;  // within a character of UTF-8
  return what.replace(begin + token.size(), end - begin - token.size(), "...");
}

/// Parses JSON with comments. nlohmann keeps the last of two equal keys; here that is a finding.
std::optional<nlohmann::json> parse_json(std::string_view text, std::vector<Finding>& findings) {
  std::vector<std::set<std::string>> seen;
  const auto watch = [&](int, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
    if (event == nlohmann::json::parse_event_t::object_start) seen.emplace_back();
    if (event == nlohmann::json::parse_event_t::object_end) seen.pop_back();
    if (event == nlohmann::json::parse_event_t::key && !seen.back().insert(parsed.get<std::string>()).second)
      findings.push_back({{}, "key " + rr::quote(parsed.get<std::string>()) + " appears twice in one object"});
    return true;
  };
  try {
    return nlohmann::json::parse(text, watch, true, true);
  } catch (const nlohmann::json::exception& error) {  // a number that no double holds is no parse_error
    std::string what = error.what();  // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    what.erase(0, what.find("] ") + 2);
    findings.push_back({{}, "not JSON: " + with_short_token(std::move(what))});
    return std::nullopt;
  }
}

/// Relative paths count from `folder`.
void locate_files(Config& config, const std::filesystem::path& folder) {
  const auto locate = [&folder](std::string& path) {
    if (!path.empty()) path = (folder / path).string();
  };
  locate(config.web_root);
  locate(config.recordings.folder);
  for (auto& certificate : config.tls.certificates) {
    locate(certificate.certificate_file);
    locate(certificate.key_file);
  }
  for (auto& device : config.devices)
    for (auto& ca : device.tls.ca) locate(ca);
  for (auto& ca : config.discover.tls.ca) locate(ca);
  for_each_file(config.access, locate);
}

}  // namespace

ParsedConfig parse_config(std::string_view text, const std::filesystem::path& folder) {
  ParsedConfig out;
  const auto document = parse_json(text, out.findings);
  if (!document) return out;
  ReadLog log;
  ObjectReader root(*document, "", log);
  if (log.findings.empty()) {
    read_config(root, out.config);
    root.finish();
    check_whole(out.config, *document, log.findings);
    locate_files(out.config, folder);
  }
  out.findings.insert(out.findings.end(), log.findings.begin(), log.findings.end());
  return out;
}

ParsedConfig load_config(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) {
    ParsedConfig out;
    out.findings.push_back({{}, "can't be read; expected a JSON file"});
    return out;
  }
  return parse_config(text.str(), std::filesystem::path(file).parent_path());
}

std::vector<OptionInfo> config_options() {
  std::vector<OptionInfo> options;
  ReadLog log;
  log.options = &options;
  const auto empty = nlohmann::json::object();
  ObjectReader root(empty, "", log);
  Config config;
  read_config(root, config);
  return options;
}

}  // namespace rrgate
