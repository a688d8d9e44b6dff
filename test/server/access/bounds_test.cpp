// What is bounded in number and time: rates, tickets, requests of access.
#include <catch2/catch.hpp>

#include "server/access/access_requests.hpp"
#include "server/access/rate_gate.hpp"
#include "server/access/tickets.hpp"
#include "test/support/print.hpp"

using namespace rrgate;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

const auto start = std::chrono::steady_clock::time_point(seconds(1000));
const auto day = std::chrono::system_clock::time_point(seconds(1'900'000'000));

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

TEST_CASE("rates: without a bound nothing is kept, and who is gone is forgotten") {
  RateGate gate;
  CHECK(gate.enter("a", 0, 0, start));
  CHECK(gate.keys() == 0);
  for (int i = 0; i < 30'000; ++i) CHECK(gate.enter(std::to_string(i), 1, 0, start + milliseconds(i)));
  CHECK(gate.keys() < 12'000);
}

TEST_CASE("tickets: once, and soon") {
  Tickets tickets;
  Identity alice;
  alice.name = "alice";
  const auto ticket = tickets.issue(alice, start);
  REQUIRE(ticket);
  CHECK_FALSE(tickets.redeem(*ticket + "x", start));
  const auto redeemed = tickets.redeem(*ticket, start + seconds(29));
  REQUIRE(redeemed);
  CHECK(redeemed->name == "alice");
  CHECK_FALSE(tickets.redeem(*ticket, start + seconds(29)));
  const auto late = tickets.issue(alice, start);
  CHECK_FALSE(tickets.redeem(*late, start + seconds(30)));
  std::size_t issued = 0;
  while (tickets.issue(alice, start) && issued < 10'000) ++issued;
  CHECK(issued == 4096);
  CHECK(tickets.issue(alice, start + seconds(31)));
}

TEST_CASE("requests of access: asked, decided, fetched once") {
  AccessRequests requests;
  const auto asked = requests.ask("tablet", "cell 3", "192.0.2.1:5", "192.0.2.1", day);
  REQUIRE(asked);
  CHECK(requests.claim(asked->id, asked->secret, day)->state == RequestState::pending);
  CHECK_FALSE(requests.claim(asked->id, "x", day));
  CHECK_FALSE(requests.claim("x", asked->secret, day));
  REQUIRE(requests.list(day).size() == 1);
  CHECK(requests.list(day)[0].name == "tablet");
  REQUIRE(requests.find_pending(asked->id, day));
  requests.decide(asked->id, "rrg_token");
  CHECK(requests.find_pending(asked->id, day).error().code == rr::ErrorCode::invalid_state);
  const auto answer = requests.claim(asked->id, asked->secret, day);
  REQUIRE(answer);
  CHECK(answer->state == RequestState::approved);
  CHECK(answer->token == "rrg_token");
  CHECK_FALSE(requests.claim(asked->id, asked->secret, day));
}

TEST_CASE("requests of access: few, and for an hour") {
  AccessRequests requests;
  const auto ask = [&](int address, std::chrono::minutes after = {}) {
    return requests.ask("n", "", "c", std::to_string(address), day + after).has_value();
  };
  for (int i = 0; i < 3; ++i) CHECK(ask(0));
  CHECK_FALSE(ask(0));
  int more = 0;
  while (ask(1 + more) && more < 1000) ++more;
  CHECK(more == 97);
  CHECK(ask(0, std::chrono::minutes(60)));
  CHECK(requests.list(day + std::chrono::minutes(60)).size() == 1);
  CHECK_FALSE(requests.ask("a b", "", "c", "x", day + std::chrono::minutes(60)));
  CHECK_FALSE(requests.ask("a", std::string(501, 'x'), "c", "x", day + std::chrono::minutes(60)));
}
