#include "core/discovery/detected_nodes.hpp"

#include <catch2/catch.hpp>

using namespace rr;
using std::chrono::seconds;

namespace {

/// A cache whose events read as a transcript.
struct Cache {
  explicit Cache(DetectedNodesOptions options = {}) : nodes(options) {}

  void hear(std::uint8_t node, const std::string& url, const std::string& nonce = "n",
            const std::string& name = "robot") {
    nodes.handle_announcement({id(node), name, url, nonce}, now);
  }
  void hear_from(const std::string& sender, std::uint8_t node) {
    nodes.handle_announcement({id(node), "robot", "a", "n"}, now, sender);
  }
  bool has(std::uint8_t node) const { return nodes.nodes().contains(id(node)); }
  void pass(seconds time) {
    now.steady += time;
    nodes.handle_timeout(now);
  }
  std::string events() {
    std::string out;
    while (const auto event = nodes.poll_event()) {
      constexpr const char* words[] = {"found", "changed", "lost"};
      out += (out.empty() ? "" : ", ") + std::string(words[static_cast<int>(event->kind)]) + " " +
             std::to_string(event->node.node_id.bytes[0]);
      if (event->urls_changed) out += " urls";
      if (event->name_changed) out += " name";
      if (event->nonce_changed) out += " nonce";
    }
    return out;
  }
  std::string urls(std::uint8_t node) const {
    const auto found = nodes.nodes().find(id(node));
    std::string out;
    if (found != nodes.nodes().end())
      for (const auto& url : found->second.urls) out += (out.empty() ? "" : " ") + url.url;
    return out;
  }
  static NodeId id(std::uint8_t node) { return NodeId{{node, 1}}; }

  DetectedNodes nodes;
  Now now{};
};

}  // namespace

TEST_CASE("a node is found once, changes when something changes, and is lost a minute after its last announcement") {
  Cache cache;
  CHECK_FALSE(cache.nodes.poll_timeout().has_value());
  cache.hear(1, "a");
  CHECK(cache.events() == "found 1");
  REQUIRE(cache.nodes.poll_timeout());
  CHECK(*cache.nodes.poll_timeout() == cache.now.steady + seconds(60));

  cache.pass(seconds(55));
  cache.hear(1, "a");
  CHECK(cache.events().empty());
  cache.hear(1, "a", "m");
  CHECK(cache.events() == "changed 1 nonce");
  cache.hear(1, "a", "m", "arm");
  CHECK(cache.events() == "changed 1 name");

  cache.pass(seconds(59));
  CHECK(cache.events().empty());
  CHECK(cache.nodes.nodes().size() == 1);
  cache.pass(seconds(1));
  CHECK(cache.events() == "lost 1");
  CHECK(cache.nodes.nodes().empty());
  CHECK_FALSE(cache.nodes.poll_timeout().has_value());
}

TEST_CASE("an announcement without a nonce leaves the one that is known") {
  Cache cache;
  cache.hear(1, "a");
  cache.hear(1, "usb", "");
  CHECK(cache.events() == "found 1, changed 1 urls");
  CHECK(cache.nodes.nodes().at(Cache::id(1)).service_state_nonce == "n");
  cache.hear(1, "a");
  CHECK(cache.events().empty());

  cache.hear(2, "usb", "");
  cache.hear(2, "b");
  CHECK(cache.events() == "found 2, changed 2 urls nonce");
}

TEST_CASE("each URL expires by itself, and the node with its last one") {
  Cache cache;
  cache.hear(1, "a");
  cache.pass(seconds(30));
  cache.hear(1, "b");
  CHECK(cache.events() == "found 1, changed 1 urls");
  CHECK(cache.urls(1) == "a b");
  cache.pass(seconds(30));
  CHECK(cache.events() == "changed 1 urls");
  CHECK(cache.urls(1) == "b");
  REQUIRE(cache.nodes.poll_timeout());
  CHECK(*cache.nodes.poll_timeout() == cache.now.steady + seconds(30));
  cache.pass(seconds(30));
  CHECK(cache.events() == "lost 1");
}

TEST_CASE("a source that sees a node go says so") {
  Cache cache;
  cache.hear(1, "a");
  cache.hear(1, "b");
  cache.events();
  cache.nodes.handle_withdrawn(Cache::id(1), "a");
  CHECK(cache.events() == "changed 1 urls");
  cache.nodes.handle_withdrawn(Cache::id(1), "a");
  cache.nodes.handle_withdrawn(Cache::id(2), "a");
  CHECK(cache.events().empty());
  cache.nodes.handle_withdrawn(Cache::id(1), "b");
  CHECK(cache.events() == "lost 1");
}

TEST_CASE("a node that is forgotten is lost once, and found when it is announced again") {
  Cache cache;
  cache.hear(1, "a");
  cache.hear(1, "b");
  const auto found = cache.events();
  cache.nodes.forget(Cache::id(1));
  cache.nodes.forget(Cache::id(1));
  CHECK(cache.events() == "lost 1");
  cache.hear(1, "a");
  cache.hear(1, "b");
  CHECK(cache.events() == found);
}

TEST_CASE("a flood of nodes is bounded; those that are known stay") {
  Cache cache({seconds(60), 3, 32});
  cache.hear(1, "a");
  for (int node = 2; node < 200; ++node) cache.hear(static_cast<std::uint8_t>(node), "a");
  CHECK(cache.nodes.nodes().size() == 3);
  CHECK(cache.events() == "found 1, found 2, found 3");
  cache.hear(1, "a", "m");
  CHECK(cache.events() == "changed 1 nonce");
  cache.pass(seconds(60));
  cache.events();
  cache.hear(9, "a");
  CHECK(cache.events() == "found 9");
}

TEST_CASE("nodes that nobody has seen give way, the oldest first; one that has answered stays") {
  Cache cache({.max_nodes = 4});
  cache.hear(1, "a");  // of this machine
  cache.hear_from("one", 2);
  cache.hear_from("one", 3);
  cache.hear_from("two", 4);
  cache.nodes.confirm(Cache::id(2));
  cache.hear_from("one", 3);  // heard of anew
  cache.events();
  cache.hear_from("three", 5);
  CHECK(cache.events() == "lost 4, found 5");
  cache.hear_from("four", 6);
  CHECK(cache.events() == "lost 3, found 6");
  for (int node = 7; node < 200; ++node) cache.hear_from(std::to_string(node), static_cast<std::uint8_t>(node));
  CHECK(cache.has(1));
  CHECK(cache.has(2));
  CHECK(cache.has(199));
  CHECK(cache.nodes.nodes().size() == 4);
  // A node that was pushed out comes back with its next announcement.
  cache.hear_from("two", 4);
  CHECK(cache.has(4));
  cache.nodes.confirm(Cache::id(199));
  cache.nodes.confirm(Cache::id(4));
  cache.hear_from("five", 200);
  CHECK_FALSE(cache.has(200));  // all others have answered
  cache.pass(seconds(60));
  CHECK(cache.nodes.nodes().empty());
  cache.hear_from("five", 200);
  CHECK(cache.has(200));
}

TEST_CASE("a sender who claims to be many pushes out his own alone") {
  Cache cache({.max_nodes = 100, .max_nodes_of_sender = 3});
  cache.hear_from("honest", 1);
  for (int node = 2; node < 200; ++node) cache.hear_from("flood", static_cast<std::uint8_t>(node));
  CHECK(cache.has(1));
  CHECK_FALSE(cache.has(2));
  CHECK(cache.has(199));
  CHECK(cache.nodes.nodes().size() == 4);
  cache.hear_from("flood", 1);  // a claim to be somebody else's node does not make it his
  cache.hear_from("flood", 200);
  CHECK(cache.has(1));
  cache.nodes.handle_withdrawn(Cache::id(200), "a");
  cache.nodes.confirm(Cache::id(199));
  for (int node = 201; node < 204; ++node) cache.hear_from("flood", static_cast<std::uint8_t>(node));
  CHECK(cache.has(198) == false);
  CHECK(cache.nodes.nodes().size() == 5);
}

TEST_CASE("a flood of URLs is bounded: the one not heard for longest gives way") {
  Cache cache({seconds(60), 3, 3});
  for (const auto* url : {"a", "b", "c"}) {
    cache.hear(1, url);
    cache.pass(seconds(1));
  }
  cache.hear(1, "a");
  cache.hear(1, "d");
  CHECK(cache.urls(1) == "a c d");
}
