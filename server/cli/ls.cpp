// rrgate ls: nodes and their services on the network and this machine, of a node, or devices of a gateway.
// Layer: server/cli.
#include "server/cli/ls.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <iostream>
#include <optional>
#include <thread>
#include <utility>

#include "node/discovery/discovery.hpp"
#include "server/cli/printable.hpp"
#include "server/cli/progress.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::milliseconds listen_step{100};

struct FoundService {
  std::string node;
  std::string name;
  std::string type;
  std::string url;
  std::vector<std::string> implements = {};
  std::string problem = {};  ///< why the node told nothing

  bool is_of(const std::string& wanted) const {
    return type == wanted || std::find(implements.begin(), implements.end(), wanted) != implements.end();
  }

  auto operator<=>(const FoundService&) const = default;  // NOLINT(modernize-use-nullptr): of what it makes
};

void add_services(std::vector<FoundService>& out, const rr::NodeServices& answer) {
  for (const auto& each : answer.services)
    out.push_back(
        {answer.node.name, each.name, each.root_object_type, each.connection_url, each.root_object_implements});
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
                       out.push_back({node.node_name.empty() ? rr::format_node_id(node.node_id) : node.node_name,
                                      "",
                                      "",
                                      node.urls.front().url,
                                      {},
                                      failure ? "no answer" : answer.error().message});
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
    const auto url = base + "/devices/" + rr::percent_encode(name);
    for (const auto& service : device["services"]) {
      const auto service_name = service["name"].get<std::string>();
      out.push_back({name, service_name, service["root_object_type"].get<std::string>(),
                     url + "?service=" + rr::percent_encode(service_name),
                     service["root_object_implements"].get<std::vector<std::string>>(), problem});
    }
    if (device["services"].empty()) out.push_back({name, "", "", url, {}, problem});
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
  if (!options.type.empty()) std::erase_if(out, [&](const auto& each) { return !each.is_of(options.type); });
  std::sort(out.begin(), out.end());
  return out;
}

void print_json(const FoundService& service, std::string_view mark) {
  auto line = rr::OrderedJson::object();
  if (!mark.empty()) line["change"] = mark == "+ " ? "found" : "lost";
  line["node"] = service.node;
  line["service"] = service.name;
  line["type"] = service.type;
  line["implements"] = service.implements;
  line["url"] = service.url;
  if (!service.problem.empty()) line["problem"] = service.problem;
  std::cout << rr::write_json(line) << "\n";
}

void print_table(const std::vector<FoundService>& services, std::string_view mark) {
  std::vector<std::array<std::string, 3>> rows;
  std::array<std::size_t, 3> widths{4, 7, 4};
  for (const auto& each : services) {
    const auto& row =
        rows.emplace_back(std::array<std::string, 3>{printable(each.node), printable(each.name), printable(each.type)});
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (std::size_t row = 0; row < rows.size(); ++row) {
    std::cout << mark;
    for (std::size_t i = 0; i < widths.size(); ++i)
      std::cout << rows[row][i] << std::string(widths[i] - rows[row][i].size() + 2, ' ');
    const auto problem = printable(services[row].problem);
    std::cout << printable(services[row].url) << (problem.empty() ? "" : "  (" + problem + ")") << "\n";
  }
}

/// `mark`  what each line begins with.
void print_services(const std::vector<FoundService>& services, std::string_view mark, bool is_json) {
  if (is_json)
    for (const auto& each : services) print_json(each, mark);
  else
    print_table(services, mark);
  std::cout << std::flush;
}

/// Those that can be used: a node that tells nothing has none, nor has a device that its gateway does not reach.
std::vector<FoundService> list_usable_services(const ListOptions& options) {
  auto out = list_services(options);
  std::erase_if(out, [](const auto& each) { return !each.problem.empty(); });
  return out;
}

/// The services of a node or gateway that was there: none while it is away, which is told once.
class WatchedPlace {
 public:
  explicit WatchedPlace(const ListOptions& options) : options_(options) {}

  /// Throws   rr::Exception: the first time that it can't be reached; it refuses.
  std::vector<FoundService> services() {
    try {
      auto out = list_usable_services(options_);
      state_ = State::reached;
      return out;
    } catch (const rr::Exception& failure) {
      if (state_ == State::unknown || exit_code_of(failure) != exit_unreachable) throw;
      if (std::exchange(state_, State::away) == State::reached)
        std::cerr << "rrgate ls: " << options_.url << ": " << printable(failure.what()) << "; waiting for it\n";
      return {};
    }
  }

 private:
  enum class State : std::uint8_t { unknown, reached, away };

  const ListOptions& options_;
  State state_ = State::unknown;
};

/// What was not there before, and what has gone, until the program is ended.
void watch_services(const ListOptions& options) {
  WatchedPlace place(options);
  std::vector<FoundService> before;
  while (true) {
    const auto now = place.services();
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
    const auto found = list_services(options);
    print_services(found, "", options.is_json);
    if (found.empty() && options.url.empty())
      std::cerr
          << "rrgate ls: found nothing within " << options.wait
          << " s; what does not announce itself, such as gateways and the devices of \"rrgate demo\", is listed by "
             "its address: rrgate ls http://127.0.0.1:8080\n";
  });
}

}  // namespace

std::vector<std::string> find_service_urls(std::chrono::milliseconds wait) {
  std::vector<std::string> out;
  for (auto& each : services_around(wait, false))
    if (each.problem.empty()) out.push_back(std::move(each.url));
  return out;
}

std::vector<std::string> list_service_urls(const RemoteOptions& where, const std::string& type) {
  ListOptions options;
  static_cast<RemoteOptions&>(options) = where;
  options.url = address_of_page(where.url);
  options.type = type;
  const auto place = options.url.substr(0, options.url.find_first_of("?#"));
  const bool is_device = place.starts_with("http") && place.find("/devices/") != std::string::npos;
  const auto service =
      rr::query_value(std::string_view(options.url).substr(std::min(place.size() + 1, options.url.size())), "service");
  const auto is_wanted = [&](const FoundService& each) {
    return (!is_device || each.url.starts_with(place + "?")) && each.name == service.value_or(each.name);
  };
  std::vector<std::string> out;
  for (const auto& each : list_services(options))
    if (!each.name.empty() && is_wanted(each)) out.push_back(each.url);
  return out;
}

void add_ls(Commands& commands) {
  const auto [app, options] = commands.add("ls", "List services: on the network, of a node, of a gateway", ls);
  takes_websocket_url(app.add_option("URL", options.url, "A node, or a gateway's http(s)://HOST:PORT"))
      ->option_text(" ");
  app.add_option("--type", options.type, "Services whose root object is of this type, or implements it")
      ->option_text("TYPE");
  add_count(app, "--wait", options.wait, "How long to listen for nodes, in s")->option_text("SECONDS [2]");
  app.add_flag("--watch", options.watches, "Continue, and report services that appear and disappear");
  add_json(app, options);
  add_connection_options(app, options);
}

}  // namespace rrgate
