#include "core/member/follower_list.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <map>
#include <string>

using namespace rr;

namespace {

/// Followers are numbers, packets are texts; what each was sent is written down, "-2" for two that were replaced.
struct Sent {
  explicit Sent(FollowRule rule) : list(rule) {}

  bool hand_out() {
    return list.hand_out([&](int follower, const std::string& packet, std::uint64_t missed) {
      if (missed > 0) heard[follower] += "-" + std::to_string(missed);
      heard[follower] += packet;
      if (then) then(follower, packet);
    });
  }
  int turns() {
    int count = 1;
    while (hand_out()) ++count;
    return count;
  }

  FollowerList<int, std::string> list;
  std::map<int, std::string> heard;
  std::function<void(int, const std::string&)> then;
};

constexpr int many = 200;  // four turns

}  // namespace

TEST_CASE("a packet that nobody follows is not even kept") {
  Sent sent(GENERATE(FollowRule::newest, FollowRule::in_order));
  CHECK_FALSE(sent.list.push("a"));
  sent.list.add(1);
  CHECK_FALSE(sent.hand_out());
  CHECK(sent.heard.empty());
}

TEST_CASE("every follower is sent every packet in order, in turns") {
  Sent sent(FollowRule::in_order);
  for (int i = 0; i < many; ++i) sent.list.add(i);
  CHECK(sent.list.push("a"));
  CHECK_FALSE(sent.list.push("b"));  // it is due already
  CHECK(sent.hand_out());
  CHECK(sent.heard.size() == sent.list.turn);
  CHECK_FALSE(sent.list.push("c"));
  CHECK(sent.turns() == 9);  // 600 deliveries, 64 of them done
  for (int i = 0; i < many; ++i) CHECK(sent.heard[i] == "abc");
  CHECK(sent.list.push("d"));
}

TEST_CASE("of a wire every follower is sent the newest value, and how many it missed") {
  Sent sent(FollowRule::newest);
  for (int i = 0; i < many; ++i) sent.list.add(i);
  CHECK(sent.list.push("a"));
  CHECK(sent.hand_out());
  CHECK_FALSE(sent.list.push("b"));
  CHECK_FALSE(sent.list.push("c"));
  sent.turns();
  CHECK(sent.heard[0] == "a-1c");
  CHECK(sent.heard[many - 1] == "-2c");
}

TEST_CASE("who comes later is sent what comes later, who leaves is sent nothing more, also in the middle") {
  Sent sent(FollowRule::in_order);
  for (int i = 0; i < 4; ++i) sent.list.add(i);
  sent.then = [&](int follower, const std::string& packet) {
    if (follower != 1 || packet != "a") return;
    CHECK(sent.list.remove(0));
    CHECK(sent.list.remove(2));
    sent.list.add(4);
    CHECK_FALSE(sent.list.push("b"));
  };
  CHECK(sent.list.push("a"));
  CHECK_FALSE(sent.hand_out());
  CHECK(sent.heard == std::map<int, std::string>{{0, "a"}, {1, "ab"}, {3, "ab"}, {4, "b"}});
  CHECK_FALSE(sent.list.remove(0));
}

TEST_CASE("packets that come faster than turns do are not kept without end") {
  Sent sent(FollowRule::in_order);
  for (int i = 0; i < many; ++i) sent.list.add(i);
  sent.list.push("x");
  for (std::size_t i = 0; i < sent.list.max_waiting; ++i) sent.list.push("x");
  sent.hand_out();
  CHECK(sent.heard[0].size() + sent.heard[many - 1].size() >= 1);
  sent.turns();
  for (int i = 0; i < many; ++i) CHECK(sent.heard[i].size() == sent.list.max_waiting + 1);
}
