// rrgate ls: nodes and their services on the network and this machine, of a node, or devices of a gateway.
// Layer: server/cli.
#include "server/cli/ls.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <iostream>
#include <optional>
#include <thread>

#include "node/discovery/discovery.hpp"
#include "server/cli/progress.hpp"
#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::milliseconds listen_step{100};

struct FoundService {
  std::string node;
  std::string name;
  std::string type;
  std::string url;
  std::string problem = {};  ///< why the node told nothing

  auto operator<=>(const FoundService&) const = default;  // NOLINT(modernize-use-nullptr): of what it makes
};

void add_services(std::vector<FoundService>& out, const rr::NodeServices& answer) {
  for (const auto& each : answer.services)
    out.push_back({answer.node.name, each.name, each.root_object_type, each.connection_url});
}

/// Hears for `wait` who is there, then asks all for their services, side by side.
rr::awaitable<void> find_services(rr::Discovery& discovery, std::chrono::milliseconds wait, bool shows_progress,
                                  std::vector<FoundService>& out) {
  asio::steady_timer timer(co_await asio::this_coro::executor);
  discovery.refresh();
  std::optional<Progress> progress;
  if (shows_progress) progress.emplace("listening", wait.count());
  for (auto heard = std::chrono::milliseconds(0); heard < wait; heard += listen_step) {
    timer.expires_after(std::min(listen_step, wait - heard));
    co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
    if (progress) progress->show(static_cast<std::uint64_t>((heard + listen_step).count()));
  }
  const auto nodes = discovery.detected_nodes();
  auto waiting = nodes.size();
  timer.expires_at(asio::steady_timer::time_point::max());
  if (shows_progress) progress.emplace("asking nodes", waiting);
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
                     --waiting;
                     if (progress) progress->show(nodes.size() - waiting);
                     if (waiting == 0) timer.cancel();
                   });
  }
  if (waiting > 0) co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
}

std::vector<FoundService> services_around(std::chrono::milliseconds wait, bool shows_progress) {
  asio::io_context io;
  std::vector<FoundService> out;
  {
    rr::DiscoveryOptions options;
    options.report = [](const std::string& problem) { std::cerr << "rrgate ls: " << problem << "\n"; };
    rr::Discovery discovery(io, options);
    asio::co_spawn(io, find_services(discovery, wait, shows_progress, out),
                   [&](const std::exception_ptr&) { io.stop(); });
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
  const auto base = gateway_base(web_url);
  const auto gateway = open_gateway(std::move(address));
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

struct ListOptions : RemoteOptions {
  std::string type;
  std::uint32_t wait = 2;  ///< in s
  bool watches = false;
};

std::vector<FoundService> list_services(const ListOptions& options) {
  std::vector<FoundService> out;
  if (options.url.empty()) {
    out = services_around(std::chrono::seconds(options.wait), !options.watches);
  } else {
    const auto address = remote_address(options);
    out = options.url.starts_with("http") ? services_of_gateway(options.url, address) : services_of_node(address);
  }
  if (!options.type.empty()) std::erase_if(out, [&](const auto& each) { return each.type != options.type; });
  std::sort(out.begin(), out.end());
  return out;
}

/// `mark`  what each line begins with.
void print_services(const std::vector<FoundService>& services, std::string_view mark, bool is_json) {
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
    if (is_json) {
      auto line = rr::OrderedJson::object();
      if (!mark.empty()) line["change"] = mark == "+ " ? "found" : "lost";
      line["node"] = each.node;
      line["service"] = each.name;
      line["type"] = each.type;
      line["url"] = each.url;
      if (!each.problem.empty()) line["problem"] = each.problem;
      std::cout << line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
    } else {
      std::cout << mark << padded(each.node, 0) << padded(each.name, 1) << padded(each.type, 2) << each.url
                << (each.problem.empty() ? "" : "  (" + each.problem + ")") << "\n";
    }
  }
  std::cout << std::flush;
}

/// What was not there before, and what has gone, until the program is ended.
void watch_services(const ListOptions& options) {
  std::vector<FoundService> before;
  while (true) {
    const auto now = list_services(options);
    std::vector<FoundService> lost;
    std::vector<FoundService> found;
    std::set_difference(before.begin(), before.end(), now.begin(), now.end(), std::back_inserter(lost));
    std::set_difference(now.begin(), now.end(), before.begin(), before.end(), std::back_inserter(found));
    print_services(lost, "- ", options.is_json);
    print_services(found, "+ ", options.is_json);
    before = now;
    if (!options.url.empty()) std::this_thread::sleep_for(std::chrono::seconds(options.wait));
  }
}

int ls(const ListOptions& options) {
  return run_remote("ls", options.url.empty() ? "network" : options.url, [&] {
    if (options.watches) return watch_services(options);
    print_services(list_services(options), "", options.is_json);
  });
}

}  // namespace

std::vector<std::string> find_service_urls(std::chrono::milliseconds wait) {
  std::vector<std::string> out;
  for (auto& each : services_around(wait, false))
    if (each.problem.empty()) out.push_back(std::move(each.url));
  return out;
}

void add_ls(Commands& commands) {
  const auto [app, options] = commands.add("ls", "List services: around here, of a node, of a gateway", ls);
  app.add_option("URL", options.url, "A node, or a gateway's http(s)://HOST:PORT")->option_text(" ");
  app.add_option("--type", options.type, "Services of this type alone")->option_text("TYPE");
  add_count(app, "--wait", options.wait, "How long to listen for nodes, in s")->option_text("SECONDS [2]");
  app.add_flag("--watch", options.watches, "Go on, and tell what comes and goes");
  add_json(app, options);
  add_connection_options(app, options);
}

}  // namespace rrgate
