// Our peer of the discovery tests: announces a node, or says what it hears. One JSON object a line on standard output;
// ends when standard input does.
//
//   rr-test-discovery serve NAME NODEID [PORT [ipv4]]  a node with the service "thing" of experimental.found.Thing;
//   every line
//                                                of input adds another service
//   rr-test-discovery watch [ipv4|all]           nodes that come, change and go
//   rr-test-discovery subscribe URL... | subscribe-type TYPE...   connections that come, with what their property "one"
//   is, and
//                                                go
//   rr-test-discovery find-type TYPE | find-name NAME
//                                                searches once
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/streambuf.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "node/client/client.hpp"
#include "node/discovery/discovery.hpp"
#include "node/service/node.hpp"
#include "node/subscribe/subscribe_service_by_type.hpp"

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* definition = R"(service experimental.found
object Thing
  property int32 one [readonly]
end
)";

void say(const Json& what) {
  std::cout << what.dump() << std::endl;
}

Json describe(const rr::NodeDiscoveryInfo& node) {
  Json out{{"id", rr::format_node_id(node.node_id, rr::NodeIdFormat::dashes)},
           {"name", node.node_name},
           {"nonce", node.service_state_nonce},
           {"urls", Json::array()}};
  for (const auto& url : node.urls) out["urls"].push_back(url.url);
  return out;
}

/// `device`  what the standard types name a device: NAME|UUID.
std::shared_ptr<rr::Service> make_thing(const std::string& name, const std::string& device = "") {
  auto service = rr::Service::from_text({definition}, name, "Thing");
  service->property("one").get([] { return 1; });
  if (!device.empty()) {
    service->set_attribute("device", rr::Value(device));
    service->set_attribute("tags", rr::Value(name));
  }
  return service;
}

/// Calls `line` for each line of standard input, and stops the io_context at its end.
struct Input {
  Input(boost::asio::io_context& io, std::function<void()> line) : io_(io), line_(std::move(line)), input_(io) {
    input_.assign(::dup(STDIN_FILENO));
    read();
  }
  void read() {
    boost::asio::async_read_until(input_, buffer_, '\n',
                                  [this](const boost::system::error_code& error, std::size_t size) {
                                    if (error) return io_.stop();
                                    buffer_.consume(size);
                                    line_();
                                    read();
                                  });
  }
  boost::asio::io_context& io_;
  std::function<void()> line_;
  boost::asio::posix::stream_descriptor input_;
  boost::asio::streambuf buffer_;
};

/// IPv6 link-local, or IPv4 broadcast alone, or both and the packets of this machine alone, or no packets.
rr::DiscoveryOptions options_for(std::string_view ip) {
  rr::DiscoveryOptions options;
  if (ip == "ipv4") options.ip = rr::IpDiscoveryScopes{.link_local = false, .ipv4_broadcast = true};
  if (ip == "all") options.ip = rr::IpDiscoveryScopes{.node_local = true, .ipv4_broadcast = true};
  if (ip == "local") options.ip.reset();
  return options;
}

void serve(const std::string& name, const std::string& id, const std::string& port, const std::string& ip) {
  boost::asio::io_context io(1);
  rr::NodeOptions options;
  options.id = rr::parse_node_id(id).value();
  rr::Node node(io, name, options);
  rr::Discovery discovery(io, options_for(ip));
  const auto device = name + "|" + id;
  node.add(make_thing("thing", device));
  say({{"port", node.listen("rr+tcp://[::]:" + port)}});
  discovery.announce(node);
  int more = 0;
  const Input input(io, [&] { node.add(make_thing("thing" + std::to_string(++more), device)); });
  io.run();
}

void serve_public(const std::string& name) {
  boost::asio::io_context io(1);
  rr::NodeOptions options;
  options.local_is_public = true;
  rr::Node node(io, name, options);
  node.add(make_thing("thing"));
  node.listen("rr+local:///");
  say({{"ready", true}, {"id", rr::format_node_id(node.identity().id, rr::NodeIdFormat::dashes)}});
  const Input input(io, [] {});
  io.run();
}

void watch(const std::string& ip) {
  boost::asio::io_context io(1);
  rr::Discovery discovery(io, options_for(ip));
  say({{"ready", true}});
  discovery.watch([](const rr::NodeEvent& event) {
    constexpr const char* words[] = {"found", "changed", "lost"};
    auto line = describe(event.node);
    line["event"] = words[static_cast<int>(event.kind)];
    say(line);
  });
  const Input input(io, [] {});
  io.run();
}

void say_client(const std::string& event, const rr::AsyncObject& client, const Json& one) {
  const auto& node = client.connection()->session().connection().peer();
  say({{"event", event},
       {"id", rr::format_node_id(node.id, rr::NodeIdFormat::dashes)},
       {"service", client.path()},
       {"one", one}});
}

void subscribe(const std::string& what, std::vector<std::string> arguments) {
  boost::asio::io_context io(1);
  rr::Discovery discovery(io, options_for(""));
  rr::SubscriptionOptions options;
  options.first_retry = std::chrono::milliseconds(100);
  auto things = what == "subscribe" ? rr::subscribe_service(io, std::move(arguments), options)
                                    : rr::subscribe_service_by_type(discovery, std::move(arguments), {}, options);
  things.on_connected([](const rr::AsyncObject& client) {
    client.get("one", [client](std::exception_ptr failure, const rr::Value& one) {
      if (!failure) say_client("connected", client, one.to<std::int32_t>().value());
    });
  });
  things.on_lost([](const rr::AsyncObject& client, const rr::Error& reason) {
    say_client("lost", client, static_cast<int>(reason.code));
  });
  say({{"ready", true}});
  const Input input(io, [] {});
  io.run();
}

rr::awaitable<void> search(rr::Discovery& discovery, std::string what, std::string argument) {
  Json found = Json::array();
  if (what == "find-type") {
    for (const auto& service : co_await discovery.find_service_by_type(argument))
      found.push_back({{"node", service.node.name}, {"name", service.name}, {"url", service.connection_url}});
  } else {
    for (const auto& node : co_await discovery.find_node_by_name(argument)) found.push_back(describe(node));
  }
  say({{"found", found}});
}

void find(const std::string& what, const std::string& argument, const std::string& ip) {
  boost::asio::io_context io(1);
  rr::Discovery discovery(io, options_for(ip));
  auto work = search(discovery, what, argument);
  boost::asio::co_spawn(io, std::move(work), [&io](std::exception_ptr) { io.stop(); });
  io.run();
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    if (words.size() >= 3 && words[0] == "serve")
      serve(words[1], words[2], words.size() > 3 ? words[3] : "0", words.size() > 4 ? words[4] : "");
    else if (words.size() == 2 && words[0] == "serve-public")
      serve_public(words[1]);
    else if (words.size() == 2 && words[0] == "call")
      say({{"one", rr::connect(words[1]).get("one").to<std::int32_t>().value()}});
    else if (!words.empty() && words[0] == "watch")
      watch(words.size() > 1 ? words[1] : "");
    else if (words.size() >= 2 && words[0].rfind("subscribe", 0) == 0)
      subscribe(words[0], {words.begin() + 1, words.end()});
    else if (words.size() >= 2 && words[0].rfind("find-", 0) == 0)
      find(words[0], words[1], words.size() > 2 ? words[2] : "");
    else
      throw std::invalid_argument(
          "usage: serve NAME NODEID [PORT [ipv4]] | serve-public NAME | call URL | watch [ipv4|local] | find-type TYPE "
          "[local] | find-name NAME "
          "[local]");
  } catch (const std::exception& failure) {
    std::cerr << "rr-test-discovery: " << failure.what() << '\n';
    return 1;
  }
}
