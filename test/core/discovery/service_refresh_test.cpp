#include "core/discovery/service_refresh.hpp"

#include <catch2/catch.hpp>

using namespace rr;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

bool is_between(milliseconds value, int least, int most) {
  INFO(value.count());
  return value >= milliseconds(least) && value <= milliseconds(most);
}

/// One node and a clock that follows its timeouts.
struct Followed {
  milliseconds wait() const {
    REQUIRE(refresh.poll_timeout());
    return std::chrono::duration_cast<milliseconds>(*refresh.poll_timeout() - now);
  }
  void query() {
    now = *refresh.poll_timeout();
    REQUIRE(refresh.take_due(now));
  }
  void fetch() {
    query();
    refresh.handle_success(now);
  }

  ServiceRefresh refresh;
  TimePoint now{};
};

}  // namespace

TEST_CASE("the delays of the specification") {
  for (int round = 0; round < 200; ++round) {
    for (const std::size_t recent : {0, 3}) CHECK(is_between(service_query_delay(recent, true), 100, 600));
    for (const std::size_t recent : {4, 5}) CHECK(is_between(service_query_delay(recent, true), 2100, 3100));
    for (const std::size_t recent : {6, 8}) CHECK(is_between(service_query_delay(recent, true), 4600, 6100));
    for (const std::size_t recent : {9, 12}) CHECK(is_between(service_query_delay(recent, true), 9100, 11'600));
    CHECK(is_between(service_query_delay(13, true), 25'100, 35'600));
    CHECK(is_between(service_query_delay(0, false), 15'100, 15'600));
  }
}

TEST_CASE("a node is queried once for each nonce") {
  Followed node;
  CHECK_FALSE(node.refresh.poll_timeout().has_value());
  node.refresh.handle_nonce("a", node.now);
  CHECK(is_between(node.wait(), 100, 600));
  CHECK_FALSE(node.refresh.take_due(node.now));
  node.fetch();
  CHECK_FALSE(node.refresh.poll_timeout().has_value());
  node.refresh.handle_nonce("a", node.now);
  CHECK_FALSE(node.refresh.poll_timeout().has_value());
  node.refresh.handle_nonce("b", node.now);
  node.fetch();
  node.refresh.handle_nonce("a", node.now);  // a late packet
  CHECK_FALSE(node.refresh.poll_timeout().has_value());
}

TEST_CASE("a nonce that changes during a query is queried after it") {
  Followed node;
  node.refresh.handle_nonce("a", node.now);
  node.query();
  node.refresh.handle_nonce("b", node.now);
  CHECK_FALSE(node.refresh.poll_timeout().has_value());
  node.refresh.handle_success(node.now);
  CHECK(is_between(node.wait(), 100, 600));
  node.fetch();
  CHECK_FALSE(node.refresh.poll_timeout().has_value());
}

TEST_CASE("three attempts, then a pause") {
  Followed node;
  node.refresh.handle_nonce("a", node.now);
  for (int attempt = 1; attempt <= 3; ++attempt) {
    node.query();
    node.refresh.handle_failure(node.now);
    CHECK(is_between(node.wait(), attempt < 3 ? 0 : 55'100, attempt < 3 ? 500 : 55'600));
  }
  node.fetch();
  CHECK_FALSE(node.refresh.poll_timeout().has_value());
}

TEST_CASE("a node that changes all the time is queried less and less") {
  Followed node;
  int queries = 0;
  const auto end = node.now + seconds(60);
  while (true) {
    node.refresh.handle_nonce("n" + std::to_string(queries), node.now);
    if (*node.refresh.poll_timeout() > end) break;
    node.fetch();
    ++queries;
  }
  CHECK(queries >= 9);
  CHECK(queries <= 14);
}

TEST_CASE("a node without nonce is queried about once a minute") {
  Followed node;
  node.refresh.handle_nonce("", node.now);
  CHECK(is_between(node.wait(), 100, 600));
  node.fetch();
  CHECK(is_between(node.wait(), 70'000, 70'000));
  node.fetch();
  CHECK(is_between(node.wait(), 70'000, 70'000));
}
