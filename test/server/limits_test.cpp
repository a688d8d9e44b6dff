// What clients may ask for and make the gateway hold: rates, tables, networks, the account of memory.
#include <catch2/catch.hpp>

#include "server/limits/bounded_table.hpp"
#include "server/limits/client_network.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/limits/rate_gate.hpp"

using namespace rrgate;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

const auto start = std::chrono::steady_clock::time_point(seconds(1000));

std::string network(const char* address) {
  return client_network(boost::asio::ip::make_address(address)).to_string();
}

}  // namespace

TEST_CASE("rates: so many a second, then as they come back") {
  RateGate gate;
  const auto passes = [&](milliseconds after) { return gate.enter("a", 10, 0, start + after).has_value(); };
  for (int i = 0; i < 10; ++i) CHECK(passes(milliseconds(0)));
  CHECK_FALSE(passes(milliseconds(0)));
  CHECK(passes(milliseconds(100)));
  CHECK_FALSE(passes(milliseconds(150)));
  CHECK(passes(milliseconds(200)));
  CHECK(gate.enter("b", 10, 0, start));
  for (int i = 0; i < 10; ++i) CHECK(passes(seconds(60)));
  CHECK_FALSE(passes(seconds(60)));
}

TEST_CASE("rates: so many at a time") {
  RateGate gate;
  auto first = gate.enter("a", 0, 2, start);
  auto second = gate.enter("a", 0, 2, start);
  CHECK(first);
  CHECK(second);
  CHECK_FALSE(gate.enter("a", 0, 2, start));
  first.reset();
  CHECK(gate.enter("a", 0, 2, start));
  auto moved = std::move(*second);
  second.reset();
  CHECK(gate.enter("a", 0, 2, start));
  auto third = gate.enter("a", 0, 2, start);
  CHECK_FALSE(gate.enter("a", 0, 2, start));
}

TEST_CASE("rates: without a bound nothing is kept, and a flood of strangers has nobody forgotten who comes again") {
  RateGate gate;
  CHECK(gate.enter("a", 0, 0, start));
  CHECK(gate.keys() == 0);
  const auto held = gate.enter("regular", 0, 1, start);
  for (int i = 0; i < 30'000; ++i) {
    CHECK(gate.enter(std::to_string(i), 1, 0, start));
    if (i % 5000 == 0) CHECK_FALSE(gate.enter("regular", 0, 1, start));
  }
  CHECK(gate.keys() == 10'000);
  CHECK_FALSE(gate.enter("29999", 1, 0, start));  // has had its one
  CHECK(gate.enter("0", 1, 0, start));            // was pushed out long ago
}

TEST_CASE("a pass outlives what is known of its client") {
  RateGate gate;
  auto held = gate.enter("a", 0, 1, start);
  for (int i = 0; i < 10'000; ++i) CHECK(gate.enter(std::to_string(i), 0, 1, start));
  const auto another = gate.enter("a", 0, 1, start);
  CHECK(another);
  held.reset();
  CHECK_FALSE(gate.enter("a", 0, 1, start));
}

TEST_CASE("a table that is full forgets what nobody has asked for longest") {
  BoundedTable<std::string, int> table(3);
  for (const auto* key : {"a", "b", "c"}) table.at(key) = 1;
  CHECK(table.at("a") == 1);
  REQUIRE(table.find("b"));
  CHECK(table.at("d", 4) == 4);
  CHECK(table.size() == 3);
  CHECK_FALSE(table.find("c"));
  CHECK(table.find("a"));
  table.clear();
  CHECK(table.size() == 0);
  CHECK_FALSE(table.find("a"));
}

TEST_CASE("whoever has an address of IPv6 has all of its network") {
  CHECK(network("192.0.2.1") == "192.0.2.1");
  CHECK(network("::ffff:192.0.2.1") == "192.0.2.1");
  CHECK(network("2001:db8:1:2:3:4:5:6") == "2001:db8:1:2::");
  CHECK(network("2001:db8:1:2::9") == network("2001:db8:1:2:ffff::"));
  CHECK(network("2001:db8:1:3::9") != network("2001:db8:1:2::9"));
  CHECK(network("fe80::1%5") == "fe80::");
  CHECK(network("::1") == "::1");
  CHECK(network_name(boost::asio::ip::make_address("2001:db8:1:2::9")) == "2001:db8:1:2::/64");
}

TEST_CASE("memory: nobody gets more than is left for all others") {
  MemoryBudget budget(1200);
  auto one = budget.charge("a");
  CHECK_FALSE(one.resize(601));
  CHECK(one.resize(600));
  CHECK(budget.used() == 600);
  auto two = budget.charge("b");
  CHECK(two.resize(300));
  CHECK_FALSE(two.resize(301));
  CHECK_FALSE(one.resize(601));
  auto three = budget.charge("c");
  CHECK(three.resize(150));
  CHECK(budget.clients() == 3);
  CHECK(budget.refusals() == 3);
  CHECK(one.resize(10));
  CHECK(two.resize(500));
  CHECK(budget.used() == 660);
}

TEST_CASE("memory: what a client holds is one account, which ends with its last charge") {
  MemoryBudget budget(1000);
  {
    auto first = budget.charge("a");
    CHECK(first.resize(300));
    auto second = first.sibling();
    CHECK_FALSE(second.resize(201));
    CHECK(second.resize(200));
    const auto moved = std::move(first);
    CHECK(moved.bytes() == 300);
    CHECK(budget.used() == 500);
    CHECK(budget.clients() == 1);
    CHECK_FALSE(moved.has_room(1));
    CHECK(budget.charge("b").has_room(250));
  }
  CHECK(budget.used() == 0);
  CHECK(budget.clients() == 0);
}

TEST_CASE("memory: what is there already counts, and keeps others out until it has gone") {
  MemoryBudget budget(100);
  auto images = budget.charge("");
  images.hold(500);
  CHECK(budget.used() == 500);
  auto client = budget.charge("a");
  CHECK_FALSE(client.resize(1));
  CHECK(images.resize(400));  // less
  budget.set_total(1000);
  CHECK(client.resize(300));
  CHECK_FALSE(client.resize(301));
  images.hold(0);
  CHECK(client.resize(500));
}

TEST_CASE("memory: a charge may outlive its budget") {
  auto budget = std::make_unique<MemoryBudget>(1000);
  auto charge = budget->charge("a");
  CHECK(charge.resize(100));
  budget.reset();
  CHECK(charge.resize(200));
  CHECK(charge.bytes() == 200);
}

TEST_CASE("memory: there is some in this machine") {
  CHECK(machine_memory() > 100'000'000);
  CHECK(machine_memory() < std::size_t{1} << 50);
}
