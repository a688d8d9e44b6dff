// What is bounded in number and time: tickets, requests of access.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <limits>

#include "server/access/access_requests.hpp"
#include "server/access/ended_sign_ins.hpp"
#include "server/access/login_limits.hpp"
#include "server/access/refusal_digest.hpp"
#include "server/access/sign_ins.hpp"
#include "server/access/tickets.hpp"
#include "server/limits/client_network.hpp"
#include "test/support/folder.hpp"
#include "test/support/print.hpp"

using namespace rrgate;
using std::chrono::seconds;

namespace {

const auto day = std::chrono::system_clock::time_point(seconds(1'900'000'000));
const auto start = std::chrono::steady_clock::time_point(seconds(1000));

}  // namespace

TEST_CASE("refusals of strangers: one of a network a minute, and the sum of the others") {
  RefusalDigest digest;
  const auto sums = [&](seconds after, bool is_forced = false) {
    std::string out;
    for (const auto& [network, count] : digest.take(start + after, is_forced))
      out += (network.empty() ? "others" : network) + " " + std::to_string(count) + "; ";
    return out;
  };
  CHECK(sums(seconds(0), true).empty());
  CHECK(digest.note("a", start));
  CHECK(digest.note("b", start));
  for (int i = 0; i < 7; ++i) CHECK_FALSE(digest.note("a", start + seconds(59)));
  CHECK(sums(seconds(59)).empty());
  CHECK(sums(seconds(60)) == "a 7; ");
  CHECK(sums(seconds(200), true).empty());
  CHECK(digest.note("a", start + seconds(200)));
  int written = 1;
  for (int i = 0; i < 20'000; ++i) written += digest.note("n" + std::to_string(i), start + seconds(200));
  CHECK(written == 100);
  CHECK(sums(seconds(201), true) == "others 19901; ");
}

TEST_CASE("refusals: as many of a network as are wanted, then their sum") {
  RefusalDigest digest(20);
  int written = 0;
  for (int i = 0; i < 50; ++i) written += digest.note("a", start);
  for (int i = 0; i < 20; ++i) written += digest.note("b", start);
  CHECK(written == 40);
  const auto sums = digest.take(start + seconds(60));
  REQUIRE(sums.size() == 1);
  CHECK(sums[0].network == "a");
  CHECK(sums[0].count == 30);
}

TEST_CASE("the site that a network of IPv6 is a part of") {
  CHECK(site_name("2001:db8:1:2::/64") == "2001:db8:1::/48");
  CHECK(site_name("2001:db8:1:ffff::/64") == "2001:db8:1::/48");
  CHECK(site_name("192.0.2.1") == "192.0.2.1");
  CHECK(site_name("::1") == "::1");
  CHECK(site_name("no address/64") == "no address/64");
}

TEST_CASE("the network of a client as logs name it") {
  CHECK(network_name_of("192.0.2.1:40000") == "192.0.2.1");
  CHECK(network_name_of("192.0.2.1") == "192.0.2.1");
  CHECK(network_name_of("[2001:db8:1:2:3::4]:40000") == "2001:db8:1:2::/64");
  CHECK(network_name_of("2001:db8:1:2:3::4") == "2001:db8:1:2::/64");
  CHECK(network_name_of("a relay") == "a relay");
}

TEST_CASE("guessing: so often of a user and of a network, and nobody else is kept out") {
  LoginLimits limits;
  const auto at = [](seconds after) { return rr::Now{start + after, {}}; };
  const auto guess = [&](const std::string& user, const std::string& network, seconds after = seconds(0)) {
    const auto may = limits.begin(user, network, at(after)).has_value();
    if (may) limits.handle_failure(user, network, at(after));
    return may;
  };
  int guesses = 0;
  while (guess("alice", "here") && guesses < 1000) ++guesses;
  CHECK(guesses == 20);
  CHECK(limits.begin("bob", "here", at(seconds(0))));
  CHECK(limits.begin("alice", "there", at(seconds(0))));
  CHECK(limits.begin("alice", "here", at(seconds(1))));
  while (guess("user" + std::to_string(guesses), "here", seconds(1)) && guesses < 1000) ++guesses;
  CHECK(guesses == 61);  // one was forgotten meanwhile
  CHECK(limits.begin("bob", "here", at(seconds(1))).error().code == rr::ErrorCode::authentication_error);
  CHECK(guess("carol", "here", seconds(2)));
  // Nor do many networks make the gateway forget one of them.
  for (int i = 0; i < 30'000; ++i) {
    guess("alice", std::to_string(i), seconds(2));
    if (i % 5000 == 0) CHECK_FALSE(limits.begin("bob", "here", at(seconds(2))));
  }
}

TEST_CASE("guessing: the networks of one site do not each get their own share") {
  LoginLimits limits;
  const rr::Now now{start, {}};
  const auto network = [](int number) { return "2001:db8:1:" + std::to_string(number) + "::/64"; };
  int guesses = 0;
  for (; guesses < 10'000 && limits.begin("alice", network(guesses), now); ++guesses)
    limits.handle_failure("alice", network(guesses), now);
  CHECK(guesses == 600);
  CHECK(limits.begin("alice", network(1), {start + seconds(1), {}}));
  CHECK(limits.begin("alice", "2001:db8:2:1::/64", now));
  CHECK(limits.begin("alice", "192.0.2.1", now));
}

TEST_CASE("guessing: so many of a network are judged at a time") {
  LoginLimits limits;
  const rr::Now now{start, {}};
  std::vector<LoginLimits::Ticket> judged;
  for (int i = 0; i < 64; ++i) judged.push_back(limits.begin("alice", "here", now).value());
  CHECK(limits.begin("alice", "here", now).error().code == rr::ErrorCode::out_of_system_resource);
  CHECK(limits.begin("alice", "there", now));
  judged.pop_back();
  CHECK(limits.begin("alice", "here", now));
}

TEST_CASE("tickets: once, soon, and by gateways of one key") {
  Tickets tickets(rr::Bytes(32, 1));
  Identity alice;
  alice.name = "alice";
  alice.roles = alice.proven_roles = {"operator", "viewer"};
  alice.proof = Proof::password;
  const auto ticket = tickets.issue(alice, day).value();
  CHECK(tickets.issue(alice, day) != ticket);
  for (const auto& wrong : {ticket + "x", ticket.substr(1), std::string(), std::string("."), std::string("e30.")})
    CHECK_FALSE(tickets.redeem(wrong, day));
  CHECK_FALSE(Tickets(rr::Bytes(32, 2)).redeem(ticket, day));
  CHECK(tickets.redeem(ticket, day + seconds(29)) == alice);
  CHECK_FALSE(tickets.redeem(ticket, day + seconds(29)));
  const auto late = tickets.issue(alice, day).value();
  CHECK_FALSE(tickets.redeem(late, day + seconds(30)));

  const rr::Bytes key(32, 7);
  Tickets here(key);
  Tickets there(key);
  CHECK(there.redeem(here.issue(alice, day).value(), day) == alice);

  alice.credential = "abc";
  alice.ends = day + std::chrono::hours(1);
  CHECK(there.redeem(here.issue(alice, day).value(), day) == alice);

  alice.proven_roles.assign(1000, "operator");
  CHECK_FALSE(tickets.issue(alice, day));
}

TEST_CASE("tickets: those that were used are kept until they would be too late, and no more than fit") {
  Tickets tickets(rr::Bytes(32, 1));
  const auto use = [&](const std::string& name, seconds at) {
    Identity who;
    who.name = name;
    who.proof = Proof::password;
    return tickets.redeem(tickets.issue(who, day + at).value(), day + at).has_value();
  };
  std::size_t used = 0;
  while (used < 70'000 && use("alice", seconds(0))) ++used;
  CHECK(used == SpentSeals::most_of_subject);
  CHECK(use("bob", seconds(0)));  // whatever alice does
  ++used;
  for (int user = 0; used < SpentSeals::most && user < 20; ++user)
    while (use("user" + std::to_string(user), seconds(0))) ++used;
  CHECK(used == SpentSeals::most);
  CHECK_FALSE(use("carol", seconds(0)));
  CHECK(use("alice", seconds(31)));
}

TEST_CASE("sign-ins: what has ended is kept until it would be too late; who signs out without end stops nobody else") {
  SignIns sign_ins(rr::Bytes(32, 7));
  const auto sign_out = [&](const std::string& name, std::size_t number, SignIns::Time at = day) {
    Identity who;
    who.name = name;
    who.proof = Proof::password;
    who.sign_in = name + std::to_string(number);
    return sign_ins.end(who, at);
  };
  std::size_t ended = 0;
  while (ended < 70'000 && sign_out("alice", ended)) ++ended;
  CHECK(ended == SpentSeals::most_of_subject);
  CHECK(sign_out("alice", 0));  // it has ended
  CHECK(sign_out("bob", 0));
  CHECK(sign_ins.has_ended("bob0"));
  for (int user = 0; user < 20; ++user)
    for (std::size_t i = 0; sign_out("user" + std::to_string(user) + "-", i); ++i) ++ended;
  CHECK(ended + 1 == SpentSeals::most);
  CHECK_FALSE(sign_out("carol", 0));
  CHECK(sign_out("carol", 0, day + std::chrono::hours(9)));
  CHECK_FALSE(sign_ins.has_ended("alice0"));
}

TEST_CASE("sign-ins: for hours, by gateways of one key, and for nothing else") {
  using std::chrono::hours;
  const rr::Bytes key(32, 7);
  const SignIns here(key);
  Identity alice;
  alice.name = "alice";
  alice.roles = alice.proven_roles = {"operator"};
  alice.proof = Proof::password;
  alice.credential = "abc";
  const auto cookie = here.begin(alice, day).value();
  const auto found = SignIns(key).find(cookie, day + hours(8) - seconds(1)).value();
  CHECK(found.name == "alice");
  CHECK(found.roles == alice.roles);
  CHECK(found.credential == "abc");
  CHECK_FALSE(found.sign_in.empty());
  CHECK(here.find(here.begin(alice, day).value(), day)->sign_in != found.sign_in);
  CHECK_FALSE(here.find(cookie, day + hours(8)));
  CHECK_FALSE(SignIns(rr::Bytes(32, 8)).find(cookie, day));
  for (const auto& wrong : {cookie + "x", cookie.substr(1), std::string(), std::string(".")})
    CHECK_FALSE(here.find(wrong, day));

  Tickets tickets(key);
  CHECK_FALSE(tickets.redeem(cookie, day));
  CHECK_FALSE(here.find(tickets.issue(alice, day).value(), day));
  CHECK(tickets.redeem(tickets.issue(found, day).value(), day)->sign_in == found.sign_in);

  alice.ends = day + hours(1);
  const auto short_one = here.begin(alice, day).value();
  CHECK(here.find(short_one, day + hours(1) - seconds(1))->ends == alice.ends);
  CHECK_FALSE(here.find(short_one, day + hours(1)));
  CHECK_FALSE(here.extend(short_one, day + hours(1) - seconds(1)));
  alice.proven_roles.assign(1000, "operator");
  CHECK_FALSE(here.begin(alice, day));
}

TEST_CASE("sign-ins: with use they go on for a week, and end with all their cookies") {
  using std::chrono::hours;
  SignIns sign_ins(rr::Bytes(32, 7));
  Identity alice;
  alice.name = "alice";
  const auto first = sign_ins.begin(alice, day).value();
  CHECK_FALSE(sign_ins.extend(first, day + hours(4) - seconds(1)));
  auto newest = first;
  auto now = day;
  int cookies = 1;
  while (sign_ins.find(newest, now)) {
    now += hours(1);
    if (auto next = sign_ins.extend(newest, now)) {
      newest = std::move(*next);
      ++cookies;
    }
  }
  CHECK(now == day + hours(7 * 24));
  CHECK(cookies == 41);  // each four hours; the last time there are no four left

  const auto other = sign_ins.begin(alice, day).value();
  const auto second = sign_ins.extend(first, day + hours(5)).value();
  CHECK(sign_ins.end(*sign_ins.find(first, day), day));
  CHECK_FALSE(sign_ins.find(first, day));
  CHECK_FALSE(sign_ins.find(second, day));
  CHECK_FALSE(sign_ins.extend(first, day + hours(5)));
  CHECK(sign_ins.find(other, day));
}

TEST_CASE("sign-ins: a restart takes none up again that had ended") {
  using std::chrono::hours;
  const test::Folder folder;
  const auto file = folder.path("state/signed-out");
  const rr::Bytes key(32, 7);
  Identity alice;
  alice.name = "alice";
  SignIns before(key, file, day);
  const auto cookie = before.begin(alice, day).value();
  const auto other = before.begin(alice, day).value();
  const auto last = before.begin(alice, day).value();
  const auto sign_out = [&](const std::string& of, SignIns::Time now) {
    const auto who = before.find(of, now).value();
    REQUIRE(before.end(who, now));
    return before.keep_ended(who, now);
  };
  REQUIRE(sign_out(cookie, day));
  CHECK((std::filesystem::status(file).permissions() & std::filesystem::perms(0777)) == std::filesystem::perms(0600));
  const SignIns after(key, file, day + hours(1));
  CHECK_FALSE(after.find(cookie, day + hours(1)));
  CHECK(after.find(other, day + hours(1)));
  CHECK(read_ended_sign_ins(file, day + hours(8)).empty());

  // A piece of a line costs no other one.
  std::ofstream(file, std::ios::app) << "\nabcdefgh 19";
  REQUIRE(sign_out(other, day + hours(1)));
  std::ofstream(file, std::ios::app) << "x 99999999999999999999 y\nx " << std::numeric_limits<std::int64_t>::max()
                                     << " y";
  CHECK(read_ended_sign_ins(file, day + hours(1)).size() == 3);
  CHECK_FALSE(SignIns(key, file, day + hours(1)).find(other, day + hours(1)));

  // What is too late goes when there is much of it.
  std::ofstream(file, std::ios::app) << "\nlate 1 z " << std::string(9'000'000, '\n');
  REQUIRE(sign_out(last, day + hours(1)));
  CHECK(std::filesystem::file_size(file) < 1000);
  const SignIns next(key, file, day + hours(1));
  for (const auto& each : {cookie, other, last}) CHECK_FALSE(next.find(each, day + hours(1)));

  SignIns nowhere(key, file + "/no/folder", day);
  CHECK_THAT(nowhere.keep_ended(alice, day).error().message, Catch::Contains("Not a directory"));
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
  CHECK(more == 99);  // the two above one of address 0 have made room
  CHECK(ask(0, std::chrono::minutes(60)));
  CHECK(requests.list(day + std::chrono::minutes(60)).size() == 1);
  CHECK_FALSE(requests.ask("a b", "", "c", "x", day + std::chrono::minutes(60)));
  CHECK_FALSE(requests.ask("a", std::string(501, 'x'), "c", "x", day + std::chrono::minutes(60)));
}

TEST_CASE("requests of access: who asks for much takes the places of nobody else") {
  AccessRequests requests;
  const auto ask = [&](const std::string& name, const std::string& address, int after) {
    return requests.ask(name, "", "c", address, day + seconds(after)).has_value();
  };
  const auto has = [&](const std::string& name) {
    const auto all = requests.list(day + seconds(200));
    return std::any_of(all.begin(), all.end(), [&](const auto& each) { return each.name == name; });
  };
  const bool is_site = GENERATE(false, true);
  int asked = 0;
  const auto network = [&](int number) {
    return is_site ? "2001:db8:1:" + std::to_string(number) + "::/64" : "192.0.2." + std::to_string(number);
  };
  CHECK(ask("early", "203.0.113.1", 0));
  while (asked < 99 && ask("n" + std::to_string(asked), network(asked / 3), 1 + asked)) ++asked;
  CHECK(asked == 99);
  CHECK_FALSE(ask("more", network(0), 150));
  for (int i = 0; i < 5; ++i) CHECK(ask("late" + std::to_string(i), "198.51.100." + std::to_string(i), 150 + i));
  CHECK(requests.list(day + seconds(200)).size() == 100);
  CHECK(has("early"));
  CHECK(has("late0"));
  CHECK(has("late4"));
  CHECK_FALSE(has("n0"));
}

TEST_CASE("requests of access: those that were denied make room, approved ones wait for their client") {
  AccessRequests requests;
  const auto ask = [&](int number, int after) {
    return requests.ask("n", "", "c", "192.0.2." + std::to_string(number), day + seconds(after));
  };
  const auto approved = ask(0, 0).value();
  std::vector<AccessRequests::Asked> flood;
  for (int i = 0; i < 99; ++i) flood.push_back(ask(1 + i, 1 + i).value());
  CHECK_FALSE(ask(200, 100));
  requests.decide(approved.id, "rrg_token");
  for (const auto& each : flood) requests.decide(each.id, "");
  for (int i = 0; i < 99; ++i) CHECK(ask(100 + i, 100 + i));
  CHECK_FALSE(ask(200, 200));
  CHECK_FALSE(requests.claim(flood.front().id, flood.front().secret, day + seconds(200)));
  CHECK(requests.claim(approved.id, approved.secret, day + seconds(200))->token == "rrg_token");
}

TEST_CASE("requests of access: of those that were denied the oldest gives way") {
  AccessRequests requests;
  std::vector<AccessRequests::Asked> asked;
  for (int i = 0; i < 100; ++i)
    asked.push_back(requests.ask("n", "", "c", "192.0.2." + std::to_string(i), day + seconds(i)).value());
  for (const auto number : {70, 30, 50}) requests.decide(asked[number].id, "");
  CHECK(requests.ask("n", "", "c", "198.51.100.1", day + seconds(200)));
  const auto is_there = [&](std::size_t number) {
    return requests.claim(asked[number].id, asked[number].secret, day + seconds(200)).has_value();
  };
  CHECK_FALSE(is_there(30));
  CHECK(is_there(50));
  CHECK(is_there(70));
  CHECK(is_there(0));
}
