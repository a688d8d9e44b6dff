// Nodes that are found without packets: through the file system, and where the system shows devices.
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <catch2/catch.hpp>
#include <fstream>

#include "core/support/random.hpp"
#include "node/discovery/discovery.hpp"
#include "node/discovery/machine_nodes.hpp"
#include "node/platform/folders.hpp"
#include "node/transport/local_files.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/sandbox.hpp"

using namespace rr;
namespace fs = std::filesystem;
using std::chrono::milliseconds;

namespace {

/// A Discovery that looks at this machine alone, and what it tells.
struct Watcher {
  explicit Watcher(std::optional<DriverRoots> hardware = std::nullopt, bool local = true)
      : discovery(io, DiscoveryOptions{.ip = std::nullopt,
                                       .intra = false,
                                       .local = local,
                                       .hardware = std::move(hardware),
                                       .report = [this](const std::string& problem) { problems.push_back(problem); }}) {
    discovery.watch([this](const NodeEvent& event) { events.push_back(event); });
  }

  /// Waits for an event of the node; its URLs, or "lost".
  std::string next(const NodeId& id) {
    for (const auto deadline = std::chrono::steady_clock::now() + milliseconds(5000);;) {
      for (std::size_t i = 0; i < events.size(); ++i) {
        if (events[i].node.node_id != id) continue;
        const auto event = events[i];
        events.erase(events.begin() + static_cast<std::ptrdiff_t>(i));
        if (event.kind == NodeEvent::Kind::lost) return "lost";
        std::string urls;
        for (const auto& url : event.node.urls) urls += (urls.empty() ? "" : " ") + url.url;
        return urls;
      }
      if (std::chrono::steady_clock::now() > deadline) return "nothing";
      io.restart();
      io.run_one_for(milliseconds(50));
    }
  }

  void run_for(milliseconds duration) {
    io.restart();
    io.run_for(duration);
  }

  boost::asio::io_context io{1};
  std::vector<NodeEvent> events;
  std::vector<std::string> problems;
  Discovery discovery;
};

std::string id_query(const NodeId& id) {
  return "nodeid=" + format_node_id(id, NodeIdFormat::dashes) + "&service=RobotRaconteurServiceIndex";
}
std::string local_url(const NodeId& id) {
  return "rr+local:///?" + id_query(id);
}

std::shared_ptr<Service> make_thing(const std::string& name) {
  auto service = Service::from_text({"service experimental.found\nobject Thing\nproperty int32 one [readonly]\nend\n"},
                                    name, "Thing");
  service->property("one").get([] { return 1; });
  return service;
}

NodeId id_of(RunningNode& node) {
  return node.ask([](Node& asked) { return asked.identity().id; });
}

void offer_thing(Node& node) {
  node.add(make_thing("thing"));
  node.listen("rr+local:///");
}

/// Another process whose node has the files in `base`, until it is killed.
class Neighbour {
 public:
  Neighbour(const fs::path& base, const NodeIdentity& node, const std::string& username = user_name()) {
    process_ = ::fork();
    if (process_ != 0) return;
    auto files = LocalNodeFiles::take(base, node);
    if (files && files->publish({node, base.string() + "/none.sock", username, "nonce"})) ::pause();
    ::_exit(1);
  }
  ~Neighbour() { kill(); }
  void kill() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
    process_ = -1;
  }

 private:
  pid_t process_;
};

}  // namespace

TEST_CASE("a node of this machine is found when it starts, changes and ends") {
  const Sandbox sandbox;  // no folder of nodes there yet
  Watcher watcher;
  watcher.run_for(milliseconds(100));
  NodeId id;
  {
    RunningNode node(offer_thing);
    id = id_of(node);
    CHECK(watcher.next(id) == local_url(id));
    watcher.run_for(milliseconds(400));
    watcher.events.clear();
    node.ask([](Node& asked) {
      asked.add(make_thing("more"));
      return 0;
    });
    CHECK(watcher.next(id) == local_url(id));
    REQUIRE(watcher.discovery.detected_nodes().size() == 1);
    CHECK(watcher.discovery.detected_nodes()[0].node_name == "test.node");
    CHECK(watcher.discovery.detected_nodes()[0].service_state_nonce ==
          node.ask([](Node& asked) { return asked.service_state_nonce(); }));
  }
  CHECK(watcher.next(id) == "lost");
  CHECK(watcher.discovery.detected_nodes().empty());
  CHECK(watcher.problems.empty());
}

TEST_CASE("a node that is killed is gone at once, though its files stay") {
  const Sandbox sandbox;
  const auto base = make_local_folders().value().base;
  const NodeIdentity who{random_node_id(), "short.lived"};
  Watcher watcher;
  Neighbour node(base, who);
  CHECK(watcher.next(who.id) == local_url(who.id));
  watcher.run_for(milliseconds(400));
  watcher.events.clear();
  node.kill();
  CHECK(watcher.next(who.id) == "lost");
  CHECK(fs::exists(base / "by-nodeid" / (format_node_id(who.id, NodeIdFormat::dashes) + ".info")));
}

TEST_CASE("a process that runs out of file descriptors loses no nodes, and sees later which are gone") {
  const Sandbox sandbox;
  Watcher watcher;
  // No node on a thread of its own, which might close a descriptor meanwhile.
  const NodeIdentity node{random_node_id(), "test.node"};
  const auto base = make_local_folders().value().base;
  std::optional files(LocalNodeFiles::take(base, node).value());
  REQUIRE(files->publish({node, "/a.sock", user_name(), "nonce"}).has_value());
  CHECK(watcher.next(node.id) == local_url(node.id));
  files.reset();
  const int free_number = ::dup(0);
  ::close(free_number);
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_NOFILE, &before) == 0);
  const rlimit few{static_cast<rlim_t>(free_number), before.rlim_max};
  ::setrlimit(RLIMIT_NOFILE, &few);
  for (int i = 0; i < 100 && watcher.problems.empty(); ++i) watcher.run_for(milliseconds(50));
  CHECK(watcher.events.empty());
  CHECK(watcher.problems.size() == 1);
  ::setrlimit(RLIMIT_NOFILE, &before);
  CHECK(watcher.next(node.id) == "lost");
}

TEST_CASE("services of local nodes are found by type, nodes by name and ID") {
  const Sandbox sandbox;
  RunningNode node(offer_thing);
  Watcher watcher;
  const auto get = [&watcher](auto work) {
    std::optional<typename decltype(work)::value_type> result;
    boost::asio::co_spawn(watcher.io, std::move(work),
                          [&](std::exception_ptr, auto value) { result = std::move(value); });
    for (int i = 0; i < 200 && !result; ++i) watcher.run_for(milliseconds(50));
    return result.value();
  };
  const auto found = get(watcher.discovery.find_service_by_type("experimental.found.Thing", {}, milliseconds(2000)));
  REQUIRE(found.size() == 1);
  CHECK(connect(found[0].connection_url).get("one").to<std::int32_t>().value() == 1);
  CHECK(get(watcher.discovery.find_node_by_name("test.node", {"rr+local"})).size() == 1);
  CHECK(get(watcher.discovery.find_node_by_id(id_of(node))).size() == 1);
  CHECK(get(watcher.discovery.find_node_by_name("test.node", {"rr+tcp"}, milliseconds(100))).empty());
}

TEST_CASE("public nodes of other users are found as theirs") {
  const Sandbox sandbox;
  Watcher watcher;
  watcher.run_for(milliseconds(100));
  const auto base = public_bases_folder().value() / "alice";  // made while it is watched
  fs::create_directories(base);
  const NodeIdentity who{random_node_id(), "public.node"};
  const NodeIdentity liar{random_node_id(), "liar"};
  const Neighbour node(base, who, "alice");
  const Neighbour other(base, liar, "bob");
  CHECK(watcher.next(who.id) == "rr+local://alice@localhost/?" + id_query(who.id));
  CHECK(watcher.next(who.id) == "nothing");
  CHECK(watcher.discovery.detected_nodes().size() == 1);
}

TEST_CASE("what is no info file makes nobody wait") {
  const Sandbox sandbox;
  const auto base = make_local_folders().value().base;
  fs::create_directories(base / "by-nodeid");
  const auto trap = base / "by-nodeid" / (format_node_id(random_node_id(), NodeIdFormat::dashes) + ".info");
  REQUIRE(::mkfifo(trap.c_str(), 0600) == 0);
  fs::create_symlink("/etc/passwd", base / "by-nodeid" / "link.info");
  std::ofstream(base / "by-nodeid" / "large.info") << std::string(100'000, 'x');
  RunningNode node(offer_thing);
  Watcher watcher;
  CHECK(watcher.next(id_of(node)) == local_url(id_of(node)));
}

TEST_CASE("a node does not find itself, and where no folder can be is told once") {
  Sandbox sandbox;
  Watcher watcher;
  Node node(watcher.io, "self.node");
  node.listen("rr+local:///");
  watcher.discovery.announce(node);
  watcher.run_for(milliseconds(200));
  CHECK(watcher.discovery.detected_nodes().empty());
  watcher.discovery.withdraw(node.identity().id);
  node.stop();

  sandbox.set(::geteuid() == 0 ? "ROBOTRACONTEUR_SYSTEM_RUN_DIR" : "ROBOTRACONTEUR_USER_RUN_DIR", "nowhere");
  Watcher lost;
  for (int i = 0; i < 3; ++i) {
    lost.run_for(milliseconds(300));
    lost.discovery.refresh();
  }
  REQUIRE(lost.problems.size() == 1);
  CHECK(lost.problems[0].find("'nowhere', expected an absolute path") != std::string::npos);
}

TEST_CASE("devices are found where the system shows them, and gone with them") {
  const Sandbox sandbox;
  const fs::path root = sandbox.folder();
  const auto id = random_node_id();
  const auto device = root / "class" / "rr0";
  fs::create_directories(device);
  std::ofstream(device / "transport") << "pci\n";
  std::ofstream(device / "nodename") << "arm.one\n";
  std::ofstream(device / "nodeid") << format_node_id(id) << '\n';
  boost::asio::io_context io(1);
  std::vector<std::string> told;
  MachineNodes::Callbacks callbacks;
  callbacks.is_own = [](const NodeId&) { return false; };
  callbacks.announced = [&](const Announcement& node) {
    if (node.node_id == id) told.push_back(node.node_name + " " + node.url);
    fs::remove_all(device);
  };
  callbacks.withdrawn = [&](const NodeId& gone, const std::string& url) {
    if (gone != id) return;
    told.push_back("gone " + url);
    io.stop();
  };
  MachineNodesOptions options;
  options.intra = false;
  options.local = false;
  options.hardware = DriverRoots{root / "class", root / "dev"};
  options.refresh = milliseconds(50);
  const MachineNodes nodes(io.get_executor(), options, std::move(callbacks));
  io.run_for(milliseconds(5000));
  const auto url = "rr+pci:///?" + id_query(id);
  CHECK(told == std::vector<std::string>{"arm.one " + url, "gone " + url});

  fs::create_directories(device);
  std::ofstream(device / "transport") << "pci\n";
  std::ofstream(device / "nodeid") << format_node_id(id) << '\n';
  Watcher watcher(DriverRoots{root / "class", root / "dev"}, false);
  CHECK(watcher.next(id) == url);
}
