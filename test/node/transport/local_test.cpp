// Nodes of one machine: files, locks, look-up, and calls over rr+local.
#include "node/transport/local.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "core/support/random.hpp"
#include "node/platform/file_look.hpp"
#include "node/platform/folders.hpp"
#include "node/platform/locked_file.hpp"
#include "node/platform/node_id_store.hpp"
#include "node/transport/local_watch.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/sandbox.hpp"

using namespace rr;
using namespace std::string_view_literals;
namespace fs = std::filesystem;
using Catch::Matchers::Contains;

namespace {

void add_adder(Node& node) {
  auto service = Service::from_text({"service test.sum\nobject Sum\nfunction double add(double a, double b)\nend\n"},
                                    "Sum", "Sum");
  service->function("add", [](double a, double b) { return a + b; });
  node.add(service);
  node.listen("rr+local:///");
}

double add_at(const std::string& url) {
  return connect(url).call("add", 1.5, 2.25).to<double>().value();
}

void write_file(const fs::path& path, std::string_view text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

}  // namespace

TEST_CASE("a node is reached by name, by ID and by both, and leaves nothing behind") {
  const Sandbox sandbox;
  const NodeId id = random_node_id();
  NodeOptions options;
  options.id = id;
  const std::string by_id = "nodeid=" + format_node_id(id, NodeIdFormat::dashes);
  const auto base = *user_run_folder() / "transport" / "local";
  {
    RunningNode node(add_adder, options);
    CHECK(add_at("rr+local:///?nodename=test.node&service=Sum") == 3.75);
    CHECK(add_at("rr+local:///?" + by_id + "&service=Sum") == 3.75);
    CHECK(add_at("rr+local:///?" + by_id + "&nodename=test.node&service=Sum") == 3.75);
    CHECK(add_at("rr+local://" + user_name() + "@localhost/?nodename=test.node&service=Sum") == 3.75);

    const auto nodes = list_local_nodes(base).value();
    REQUIRE(nodes.size() == 1);
    CHECK(nodes[0].node.id == id);
    CHECK(nodes[0].node.name == "test.node");
    struct stat status {};
    REQUIRE(::stat(nodes[0].socket.c_str(), &status) == 0);
    CHECK((status.st_mode & 0777) == 0770);

    const auto other = error_of([&] { connect("rr+local:///?" + by_id + "&nodename=other&service=Sum"); });
    CHECK(other.code == ErrorCode::node_not_found);
    Node second("test.node");
    CHECK_THROWS_WITH(second.listen("rr+local:///"), Contains("in use by another node"));
  }
  CHECK(fs::is_empty(base / "by-nodeid"));
  CHECK(fs::is_empty(base / "by-nodename"));
  CHECK(fs::is_empty(*user_run_folder() / "socket"));
  CHECK(error_of([&] { connect("rr+local:///?nodename=test.node&service=Sum"); }).code == ErrorCode::node_not_found);
}

TEST_CASE("what a crashed node left is cleaned up, and a running one is left alone") {
  const Sandbox sandbox;
  const auto folders = make_local_folders().value();
  const LocalNodeInfo dead{{random_node_id(), "dead.node"}, (folders.sockets / "abc.sock").string(), "nobody", "0123"};
  const auto stem = format_node_id(dead.node.id, NodeIdFormat::dashes);
  write_file(folders.base / "by-nodeid" / (stem + ".info"), format_local_info(dead));
  write_file(folders.base / "by-nodeid" / (stem + ".pid"), "3039530421");
  write_file(dead.socket, "");
  CHECK(list_local_nodes(folders.base).value().empty());
  const auto error = error_of([&] { connect("rr+local:///?nodeid=" + stem + "&service=Sum"); });
  CHECK(error.code == ErrorCode::connection_error);
  CHECK_THAT(error.message, Contains(dead.socket));

  RunningNode node(add_adder);
  RunningNode other([](Node& into) { into.listen("rr+local:///"); }, {}, "other.node");
  CHECK_FALSE(fs::exists(dead.socket));
  CHECK_FALSE(fs::exists(folders.base / "by-nodeid" / (stem + ".info")));
  CHECK(add_at("rr+local:///?nodename=test.node&service=Sum") == 3.75);
}

TEST_CASE("a socket that answers for another node is found out") {
  const Sandbox sandbox;
  RunningNode node(add_adder);
  const auto folders = make_local_folders().value();
  auto info = list_local_nodes(folders.base).value().at(0);
  info.node = {random_node_id(), "wanted.node"};
  write_file(folders.base / "by-nodename" / "wanted.node.info", format_local_info(info));
  CHECK(error_of([&] { connect("rr+local:///?nodename=wanted.node&service=Sum"); }).code == ErrorCode::node_not_found);
}

TEST_CASE("info files are read as the reference writes them") {
  const std::string text =
      "ServiceStateNonce: HMWmpo4JgxqgfzQS\nnodeid: {0dfc24e5-8305-4b9f-a4f7-431ef45913a7}\nnodename: probe.srv\n"
      "pid: 19391\nsocket: /run/a.sock\nusername: alice\nsocket: /stale.sock\nno key\n";
  const auto info = parse_local_info(text).value();
  CHECK(format_node_id(info.node.id) == "{0dfc24e5-8305-4b9f-a4f7-431ef45913a7}");
  CHECK(info.node.name == "probe.srv");
  CHECK(info.socket == "/run/a.sock");
  CHECK(info.username == "alice");
  CHECK(info.nonce == "HMWmpo4JgxqgfzQS");
  CHECK_FALSE(parse_local_info("").has_value());
  CHECK_FALSE(parse_local_info("nodeid: {0dfc24e5-8305-4b9f-a4f7-431ef45913a7}\nsocket: relative.sock\n").has_value());
  CHECK_FALSE(parse_local_info("nodeid: nonsense\nsocket: /a.sock\n").has_value());
  CHECK_FALSE(parse_local_info("nodeid: {0dfc24e5-8305-4b9f-a4f7-431ef45913a7}\nsocket: /a\0b.sock\n"sv).has_value());
}

TEST_CASE("what lies in somebody else's folder is not taken for this user's") {
  const Sandbox sandbox;
  const auto folders = make_local_folders().value();
  const auto run = *user_run_folder();
  const NodeIdentity forged{random_node_id(), "forged.node"};
  auto files = LocalNodeFiles::take(folders.base, forged).value();
  REQUIRE(files.publish({forged, (folders.sockets / "a.sock").string(), user_name(), "nonce"}).has_value());
  REQUIRE(list_local_nodes().value().size() == 1);
  const auto check = [&] {
    CHECK(list_local_nodes().value().empty());
    CHECK(error_of([&] { connect("rr+local:///?nodename=forged.node&service=Sum"); }).code ==
          ErrorCode::node_not_found);
    const auto made = make_local_folders();
    REQUIRE_FALSE(made.has_value());
    CHECK(made.error().code == ErrorCode::system_resource_permission_denied);
  };
  const fs::path elsewhere = run.string() + ".elsewhere";
  fs::rename(run, elsewhere);
  fs::create_directory_symlink(elsewhere, run);  // who made the link may change it
  check();
  fs::remove(run);
  fs::rename(elsewhere, run);
  REQUIRE(list_local_nodes().value().size() == 1);
  if (::geteuid() != 0) return;  // only root can give a folder away
  REQUIRE(::chown(run.c_str(), 65534, static_cast<gid_t>(-1)) == 0);
  check();
}

TEST_CASE("a process without a file descriptor to spare doesn't take local nodes for gone") {
  const Sandbox sandbox;
  const auto base = make_local_folders().value().base;
  // No node on a thread of its own, which might take the descriptor that is left, or close one.
  const NodeIdentity node{random_node_id(), "test.node"};
  auto files = LocalNodeFiles::take(base, node).value();
  REQUIRE(files.publish({node, "/a.sock", user_name(), "nonce"}).has_value());
  REQUIRE(list_local_nodes(base).value().size() == 1);
  const int free_number = ::dup(0);
  ::close(free_number);
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_NOFILE, &before) == 0);
  for (const int left : {0, 1}) {  // one is enough for the folder, but not for a file
    rlimit few{static_cast<rlim_t>(free_number + left), before.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &few);
    const auto nodes = list_local_nodes(base);
    const auto is_held = LockedFile::is_held(base / "by-nodename" / "test.node.pid");
    ::setrlimit(RLIMIT_NOFILE, &before);
    INFO(left);
    REQUIRE_FALSE(nodes.has_value());
    CHECK(nodes.error().code == ErrorCode::out_of_system_resource);
    CHECK(is_held.has_value() == (left == 1));
  }
  CHECK(LockedFile::is_held(base / "by-nodename" / "test.node.pid").value());
}

TEST_CASE("a lock is of the file that the path names, whoever removes it meanwhile") {
  const Sandbox sandbox;
  const auto path = fs::path(sandbox.folder()) / "robot.pid";
  fs::create_directories(path.parent_path());
  std::atomic<bool> is_over = false;
  std::thread other([&] {
    while (!is_over)
      if (auto left = LockedFile::open_left_behind(path)) left->remove();
  });
  int taken = 0;
  int lost = 0;
  for (int i = 0; i < 100'000 && taken < 2000; ++i) {
    const auto mine = LockedFile::open(path);
    if (!mine) continue;
    ++taken;
    if (!LockedFile::is_held(path).value()) ++lost;
  }
  is_over = true;
  other.join();
  CHECK(taken > 100);
  CHECK(lost == 0);
}

TEST_CASE("a new text is written over the old one: readers never find none") {
  const Sandbox sandbox;
  auto file = LockedFile::open(fs::path(sandbox.folder()) / "robot.info").value();
  REQUIRE(file.write("a longer text").has_value());
  // Where nothing can be written, what was done to the file before shows.
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  const rlimit none{0, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &none);
  const auto written = file.write("a text");
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK_FALSE(written.has_value());
  CHECK(file.read(100).value() == "a longer text");
  REQUIRE(file.write("a text").has_value());
  CHECK(file.read(100).value() == "a text");
}

TEST_CASE("a file that is given to somebody else looks different") {
  const Sandbox sandbox;
  const auto path = sandbox.folder() + "/file";
  write_file(path, "text");
  const auto before = file_look(path);
  CHECK(file_look(path) == before);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // a tick of the file system's clock
  fs::permissions(path, fs::perms::owner_read);
  CHECK(file_look(path) != before);
}

TEST_CASE("a name keeps its NodeID, for one node at a time") {
  const Sandbox sandbox;
  NodeId id;
  {
    auto claim = NodeIdClaim::take("my.robot").value();
    id = claim.id();
    CHECK_FALSE(id.is_any());
    const auto second = NodeIdClaim::take("my.robot");
    REQUIRE_FALSE(second.has_value());
    CHECK_THAT(second.error().message, Contains("in use by another node"));
  }
  CHECK(NodeIdClaim::take("my.robot").value().id() == id);
  CHECK(fs::status(*user_run_folder()).permissions() == fs::perms::owner_all);
  CHECK(NodeIdClaim::take("other.robot").value().id() != id);
  CHECK_FALSE(NodeIdClaim::take("../robot").has_value());

  NodeOptions options;
  options.keeps_id = true;
  CHECK(Node("my.robot", options).identity().id == id);

  const auto stored = ::geteuid() == 0 ? *system_state_folder() : *user_config_folder();
  write_file(stored / "nodeids" / "broken.robot", "not an id");
  CHECK_THAT(NodeIdClaim::take("broken.robot").error().message, Contains("'not an id'"));
  write_file(stored / "nodeids" / "old.robot", " 0DFC24E583054B9FA4F7431EF45913A7\n");
  CHECK(format_node_id(NodeIdClaim::take("old.robot").value().id()) == "{0dfc24e5-8305-4b9f-a4f7-431ef45913a7}");
}

TEST_CASE("public nodes are for those whom the administrator lets in") {
  const Sandbox sandbox;
  NodeOptions options;
  options.local_is_public = true;
  Node early("early.node", options);
  CHECK_THROWS_WITH(early.listen("rr+local:///"), Contains("not set up for public nodes of " + user_name()));

  const auto base = public_bases_folder().value() / user_name();
  fs::create_directories(base);
  const auto umask_before = ::umask(077);
  RunningNode node(add_adder, options);
  ::umask(umask_before);
  const auto mode_of = [](const fs::path& path) {
    struct stat status {};
    REQUIRE(::stat(path.c_str(), &status) == 0);
    return status.st_mode & 07777;
  };
  for (const auto* folder : {"by-nodeid", "by-nodename", "socket"}) CHECK(mode_of(base / folder) == 02750);
  CHECK(mode_of(base / "by-nodename" / "test.node.info") == 01640);
  CHECK(mode_of(base / "by-nodename" / "test.node.pid") == 01640);
  CHECK(mode_of(list_local_nodes(base).value().at(0).socket) == 0770);
  CHECK(list_local_nodes(*user_run_folder() / "transport" / "local").value().empty());
  CHECK(add_at("rr+local://" + user_name() + "@localhost/?nodename=test.node&service=Sum") == 3.75);
  CHECK(add_at("rr+local:///?nodename=test.node&service=Sum") == 3.75);
}

TEST_CASE("folders follow the reference's variables, but never a relative one") {
  Sandbox sandbox;
  CHECK_THAT(user_run_folder().value().string(), Contains(sandbox.folder()));
  sandbox.set(::geteuid() == 0 ? "ROBOTRACONTEUR_SYSTEM_CONFIG_DIR" : "ROBOTRACONTEUR_USER_CONFIG_DIR", "somewhere");
  CHECK_THAT(user_config_folder().error().message, Contains("'somewhere', expected an absolute path"));
}
