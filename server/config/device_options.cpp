#include "server/config/device_options.hpp"

#include <algorithm>
#include <cctype>

#include "node/transport/schemes.hpp"
#include "server/config/lease_options.hpp"

namespace rrgate {

namespace {

std::string read_device_url(const std::string& text, rr::ConnectionUrl& target) {
  auto url = rr::parse_url(text, rr::ServiceInUrl::optional);
  if (!url) return url.error().message;
  // No node of this process is a device.
  if (!rr::can_dial(url->scheme) || url->scheme == "rr+intra")
    return "scheme " + rr::quote(url->scheme) + " is not available for devices; available: " + rr::dialable_schemes();
  target = *url;
  return {};
}

/// What stands between the gateway and the device.
void read_way(ObjectReader& in, DeviceConfig& device) {
  std::string proxy;
  in.text("proxy", proxy);
  if (!proxy.empty()) {
    auto address = rr::parse_host_port(proxy);
    const auto* scheme = rr::find_url_scheme(device.url.scheme);
    if (!address)
      in.finding("proxy", address.error().message);
    else if (scheme && !scheme->needs_host)
      in.finding("proxy", "there is no proxy on the way of " + device.url.scheme + "; expected a URL with a host");
    else
      device.proxy = std::move(*address);
  }
  in.objects("headers", false, [&](ObjectReader& item) {
    std::pair<std::string, std::string> header;
    item.required_text("name", header.first);
    item.required_text("value", header.second);
    if (!header.first.empty() && !rr::is_extra_header(header.first, header.second))
      item.finding("name", "header " + rr::quote(header.first) +
                               " can't be added: the upgrade sets it itself, or its name or value has a character that "
                               "headers can't have");
    device.headers.push_back(std::move(header));
  });
}

void read_mode(ObjectReader& in, DeviceMode& mode) {
  std::string text = "relay";
  in.choice("mode", text, {"relay", "shared"});
  mode = text == "shared" ? DeviceMode::shared : DeviceMode::relay;
}

void read_login(ObjectReader& in, UpstreamLogin& login) {
  in.required_text("username", login.username);
  in.required_text("password", [&](const std::string& text) -> std::string {
    login.credentials.items.emplace_back("password", rr::Value(text));
    return {};
  });
}

void read_callback_rule(ObjectReader& in, CallbackRule& rule) {
  in.required_text("member", rule.member);
  std::string answer = "owner";
  in.choice("answer", answer, {"owner", "first", "all"});
  rule.policy = answer == "first" ? CallbackPolicy::first
                : answer == "all" ? CallbackPolicy::all
                                  : CallbackPolicy::owner;
}

void read_discover_rule(ObjectReader& in, DiscoverRule& rule) {
  in.text("node_name", rule.node_name);
  const bool has_node_id = in.node_id("node_id", rule.node_id);
  in.text("service_type", rule.service_type);
  const auto is_glob_char = [](char c) {
    return std::string_view("*?._-").find(c) != std::string_view::npos || std::isalnum(static_cast<unsigned char>(c));
  };
  if (!std::all_of(rule.node_name.begin(), rule.node_name.end(), is_glob_char))
    in.finding("node_name", wrong_text(rule.node_name, "the letters, digits, '_', '-', '.' of node names, '*' or '?'"));
  if (!has_node_id && rule.node_name.empty() && rule.service_type.empty())
    in.finding("node_name",
               "missing; a rule needs one of node_name, node_id and service_type (\"node_name\": \"*\" allows all)");
}

}  // namespace

std::string check_device_name(const std::string& name) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  };
  const auto is_name_char = [&](char c) { return is_plain(c) || c == '_' || c == '-' || c == '.'; };
  if (name.empty() || name.size() > 64 || !is_plain(name.front()) ||
      !std::all_of(name.begin(), name.end(), is_name_char))
    return wrong_text(name, "1 to 64 letters, digits, '_', '-', '.', first a letter or digit");
  return {};
}

void read_device(ObjectReader& in, DeviceConfig& device) {
  in.required_text("name", [&](const std::string& text) {
    device.name = text;
    return check_device_name(text);
  });
  in.required_text("url", [&](const std::string& text) { return read_device_url(text, device.url); });
  in.size("max_clients", device.max_clients, {0, 1'000'000});
  read_mode(in, device.mode);
  in.object("login", [&](ObjectReader& part) { read_login(part, device.login); });
  in.objects("callbacks", false,
             [&](ObjectReader& item) { read_callback_rule(item, device.callbacks.emplace_back()); });
  in.flag("shares_reads", device.shares_reads);
  in.object("leases", [&](ObjectReader& part) { read_leases(part, device.leases); });
  if (device.mode == DeviceMode::relay && device.leases.is_offered)
    in.finding("leases", "the commands of a relayed device pass unread; expected \"mode\": \"shared\"");
  if (device.mode == DeviceMode::relay && (!device.login.username.empty() || !device.callbacks.empty()))
    in.finding("mode",
               "login and callbacks are of shared devices: clients of a relayed one have sessions of their own");
  read_way(in, device);
  in.object("tls", [&](ObjectReader& part) { part.files("ca", device.tls.ca); });
  const auto& url = device.url;
  if (!device.tls.ca.empty() && !url.scheme.empty() && !has_node_tls(url) && !has_https(url))
    in.finding("tls", "has a CA, but there is no TLS in " + rr::quote(url.scheme + "://") +
                          "; expected rrs+tcp or another with TLS");
}

void read_discover(ObjectReader& in, Discover& discover) {
  discover.is_enabled = true;
  std::vector<std::string> scopes;
  in.texts("scopes", false, [&](const std::string& text) -> std::string {
    if (text != "node_local" && text != "link_local" && text != "site_local" && text != "ipv4_broadcast")
      return wrong_text(text, "one of: node_local, link_local, site_local, ipv4_broadcast");
    scopes.push_back(text);
    return {};
  });
  if (!scopes.empty()) discover.scopes = std::move(scopes);
  in.objects("allow", false, [&](ObjectReader& item) { read_discover_rule(item, discover.allow.emplace_back()); });
  in.size("max_devices", discover.max_devices, {1, 4096});
  in.flag("local", discover.local);
  in.flag("hardware", discover.hardware);
  read_mode(in, discover.mode);
  in.object("tls", [&](ObjectReader& part) { part.files("ca", discover.tls.ca); });
}

}  // namespace rrgate
