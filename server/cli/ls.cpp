// rrgate ls: nodes and their services on the network and this machine, of a node, or devices of a gateway.
// Layer: server/cli.
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <iostream>

#include "node/discovery/discovery.hpp"
#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

struct FoundService {
  std::string node;
  std::string name;
  std::string type;
  std::string url;
  std::string problem = {};  ///< why the node told nothing
};

void add_services(std::vector<FoundService>& out, const rr::NodeServices& answer) {
  for (const auto& each : answer.services)
    out.push_back({answer.node.name, each.name, each.root_object_type, each.connection_url});
}

/// Hears for `wait` who is there, then asks all for their services, side by side.
rr::awaitable<void> find_services(rr::Discovery& discovery, std::chrono::milliseconds wait,
                                  std::vector<FoundService>& out) {
  asio::steady_timer timer(co_await asio::this_coro::executor);
  discovery.refresh();
  timer.expires_after(wait);
  co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
  const auto nodes = discovery.detected_nodes();
  auto waiting = nodes.size();
  timer.expires_at(asio::steady_timer::time_point::max());
  for (const auto& node : nodes) {
    rr::ServiceQueryOptions options;
    options.dial.timeout = std::chrono::milliseconds(3000);
    auto asked = rr::query_node(rr::candidate_urls(node), options);
    asio::co_spawn(timer.get_executor(), std::move(asked),
                   [&, node](const std::exception_ptr& failure, rr::Result<rr::NodeServices> answer) {
                     if (!failure && answer)
                       add_services(out, *answer);
                     else
                       out.push_back({node.node_name.empty() ? rr::format_node_id(node.node_id) : node.node_name, "",
                                      "", node.urls.front().url, failure ? "no answer" : answer.error().message});
                     if (--waiting == 0) timer.cancel();
                   });
  }
  if (waiting > 0) co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
}

std::vector<FoundService> services_around(std::chrono::milliseconds wait) {
  asio::io_context io;
  std::vector<FoundService> out;
  {
    rr::DiscoveryOptions options;
    options.report = [](const std::string& problem) { std::cerr << "rrgate ls: " << problem << "\n"; };
    rr::Discovery discovery(io, options);
    asio::co_spawn(io, find_services(discovery, wait, out), [&](const std::exception_ptr&) { io.stop(); });
    io.run();
  }
  return out;
}

std::vector<FoundService> services_of_node(const RemoteAddress& address) {
  asio::io_context io;
  rr::ServiceQueryOptions options;
  options.dial = address.options.dial;
  options.dial.timeout = address.timeout;
  std::vector<FoundService> out;
  rr::Result<rr::NodeServices> answer = rr::make_error(rr::ErrorCode::connection_error, "no answer");
  auto asked = rr::query_services(rr::parse_url(address.url, rr::ServiceInUrl::optional).value(), options);
  asio::co_spawn(io, std::move(asked),
                 [&](const std::exception_ptr&, rr::Result<rr::NodeServices> told) { answer = std::move(told); });
  io.run();
  if (!answer) throw rr::ClientException(answer.error());
  add_services(out, *answer);
  return out;
}

/// Each service of each device, with the URL by which it is reached through the gateway.
std::vector<FoundService> services_of_gateway(const std::string& web_url, RemoteAddress address) {
  auto url = rr::parse_url(address.url, rr::ServiceInUrl::optional).value();
  const auto base = web_url.substr(0, web_url.find('/', web_url.find("://") + 3));
  url.path = "/";
  // By its name, since a gateway with one relayed device leads whoever asks for no node to that.
  url.query = "nodename=rrgate&service=gateway";
  address.url = rr::format_url(url);
  const auto gateway = open_service(address);
  const auto found = find_member(gateway, "devices");
  const auto devices = to_json(gateway.get("devices"), found.member->type, found.types());
  std::vector<FoundService> out;
  for (const auto& device : devices) {
    const auto name = device["name"].get<std::string>();
    const auto problem = device["state"] == "online"
                             ? std::string()
                             : device["state"].get<std::string>() + ": " + device["last_error"].get<std::string>();
    for (const auto& service : device["services"])
      out.push_back(
          {name, service.get<std::string>(), "",
           base + "/devices/" + rr::percent_encode(name) + "?service=" + rr::percent_encode(service.get<std::string>()),
           problem});
    if (device["services"].empty())
      out.push_back({name, "", "", base + "/devices/" + rr::percent_encode(name), problem});
  }
  return out;
}

void print_services(std::vector<FoundService> services, const ParsedArguments& parsed) {
  const auto by_name = [](const auto& a, const auto& b) { return std::tie(a.node, a.name) < std::tie(b.node, b.name); };
  std::sort(services.begin(), services.end(), by_name);
  std::size_t widths[3] = {4, 7, 4};
  for (const auto& each : services) {
    widths[0] = std::max(widths[0], each.node.size());
    widths[1] = std::max(widths[1], each.name.size());
    widths[2] = std::max(widths[2], each.type.size());
  }
  const auto padded = [&](const std::string& text, std::size_t column) {
    return text + std::string(widths[column] - text.size() + 2, ' ');
  };
  for (const auto& each : services) {
    if (parsed.flags.contains("--json")) {
      auto line = rr::OrderedJson::object();
      line["node"] = each.node;
      line["service"] = each.name;
      line["type"] = each.type;
      line["url"] = each.url;
      if (!each.problem.empty()) line["problem"] = each.problem;
      std::cout << line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
    } else {
      std::cout << padded(each.node, 0) << padded(each.name, 1) << padded(each.type, 2) << each.url
                << (each.problem.empty() ? "" : "  (" + each.problem + ")") << "\n";
    }
  }
}

}  // namespace

int run_ls(Arguments arguments) {
  constexpr std::string_view options[] = {"--timeout", "--user", "--wait", "--type"};
  const auto parsed = parse_arguments(arguments, {options, remote_flags});
  if (!parsed.error.empty()) return usage_error("ls", parsed.error);
  if (parsed.operands.size() > 1) return usage_error("ls", "expected no URL, or one");
  const auto wait = number_option(parsed, "--wait", 2, 3600);
  if (!wait) return usage_error("ls", "--wait: expected whole seconds, 3600 at most");
  const auto url = parsed.operands.empty() ? std::string("network") : parsed.operands[0];
  return run_remote("ls", url, [&] {
    std::vector<FoundService> services;
    if (parsed.operands.empty()) {
      services = services_around(std::chrono::seconds(*wait));
    } else {
      const auto address = remote_address(url, parsed);
      services = url.starts_with("http") ? services_of_gateway(url, address) : services_of_node(address);
    }
    if (const auto type = parsed.options.find("--type"); type != parsed.options.end())
      std::erase_if(services, [&](const auto& each) { return each.type != type->second; });
    print_services(services, parsed);
    return static_cast<int>(exit_ok);
  });
}

}  // namespace rrgate
