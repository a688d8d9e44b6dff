// What agents ask a person for: bounded, soon over, and allowed by nobody who asks.
#include "server/access/approvals.hpp"

#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>

#include "test/support/print.hpp"

using namespace rrgate;
using std::chrono::minutes;
using std::chrono::seconds;

namespace {

const auto start = Approvals::Time(seconds(1'900'000'000));
const auto end = start + seconds(60);

Identity who(std::string name, Proof proof = Proof::token) {
  Identity out;
  out.name = std::move(name);
  out.credential = "secret of " + out.name;
  out.proof = proof;
  return out;
}

WantedCommand drive(std::string name = "mind", std::string member = "Drive") {
  return {who(std::move(name)), "robot", "Create", "Create", std::move(member), Verb::call, R"({"velocity":1})", "why"};
}

void ignore() {}

}  // namespace

TEST_CASE("approvals: what a person answers is told, once, and only as long as the agent waits") {
  Approvals approvals;
  int woken = 0;
  const auto allowed = *approvals.ask(
      drive(), [&] { ++woken; }, end, start);
  auto denied = *approvals.ask(
      drive(), [&] { ++woken; }, end, start);
  REQUIRE(approvals.list(start).size() == 2);
  CHECK(approvals.list(start)[0].command.values == R"({"velocity":1})");
  CHECK(approvals.answer(allowed->approval().id, who("root"), true, minutes(0), start));
  CHECK(approvals.answer(denied->approval().id, who("root"), false, minutes(0), start));
  CHECK(woken == 2);
  CHECK(allowed->state() == ApprovalState::allowed);
  CHECK(denied->state() == ApprovalState::denied);
  CHECK(approvals.list(start).empty());
  CHECK_FALSE(approvals.answer(denied->approval().id, who("root"), true, minutes(0), start));
  CHECK(denied->state() == ApprovalState::denied);

  auto gone = *approvals.ask(drive(), ignore, end, start);
  const auto id = gone->approval().id;
  gone.reset();
  CHECK(approvals.list(start).empty());
  CHECK(approvals.answer(id, who("root"), true, minutes(0), start).error().code == rr::ErrorCode::resource_not_found);
}

TEST_CASE("approvals: nobody can allow what is too old, and nobody allows himself anything") {
  Approvals approvals;
  const auto asked = *approvals.ask(drive(), ignore, end, start);
  const auto& id = asked->approval().id;
  CHECK(approvals.answer(id, who("mind"), true, minutes(0), start).error().code == rr::ErrorCode::permission_denied);
  CHECK(asked->state() == ApprovalState::pending);
  CHECK_FALSE(approvals.answer(id, who("root"), true, minutes(0), end));
  CHECK(approvals.list(end).empty());
  CHECK(asked->state() == ApprovalState::pending);
  CHECK(approvals.answer(id, who("mind", Proof::password), true, minutes(0), start));  // a user of the token's name
}

TEST_CASE("approvals: an answer for once takes back nothing that was allowed for some minutes") {
  Approvals approvals;
  const auto first = *approvals.ask(drive(), ignore, end, start);
  const auto second = *approvals.ask(drive(), ignore, end, start);
  REQUIRE(approvals.answer(first->approval().id, who("root"), true, minutes(5), start));
  REQUIRE(approvals.answer(second->approval().id, who("root"), true, minutes(0), start));
  CHECK(approvals.is_granted(drive(), start + minutes(4)));
}

TEST_CASE("approvals: for some minutes the same agent may do the same again, and nobody else anything") {
  Approvals approvals;
  const auto asked = *approvals.ask(drive(), ignore, end, start);
  CHECK_FALSE(approvals.is_granted(drive(), start));
  REQUIRE(approvals.answer(asked->approval().id, who("root"), true, minutes(5), start));
  auto other_values = drive();
  other_values.values = R"({"velocity":2})";
  CHECK(approvals.is_granted(other_values, start));
  CHECK(approvals.is_granted(drive(), start + minutes(5) - seconds(1)));
  CHECK_FALSE(approvals.is_granted(drive(), start + minutes(5)));
  CHECK_FALSE(approvals.is_granted(drive("other"), start));
  CHECK_FALSE(approvals.is_granted(drive("mind", "Other"), start));
  auto other = drive();
  other.device = "arm";
  CHECK_FALSE(approvals.is_granted(other, start));
  other = drive();
  other.verb = Verb::write;
  CHECK_FALSE(approvals.is_granted(other, start));
  other = drive();
  other.path = "Create.arm";
  CHECK_FALSE(approvals.is_granted(other, start));
  other = drive();
  other.who.credential = "another token of the same name";
  CHECK_FALSE(approvals.is_granted(other, start));

  auto nobody = drive();
  nobody.who = {};
  const auto once = *approvals.ask(nobody, ignore, end, start);
  REQUIRE(approvals.answer(once->approval().id, who("root"), true, minutes(5), start));
  CHECK(once->state() == ApprovalState::allowed);
  CHECK_FALSE(approvals.is_granted(nobody, start));
}

TEST_CASE("approvals: few wait at a time, of one agent fewer, and none that nobody could judge") {
  Approvals approvals;
  std::vector<Approvals::AskedPtr> kept;
  const auto ask = [&](const std::string& name, Approvals::Time now = start) {
    auto asked = approvals.ask(drive(name), ignore, now + seconds(60), now);
    if (asked) kept.push_back(*asked);
    return asked.has_value();
  };
  for (std::size_t i = 0; i < Approvals::max_of_subject; ++i) CHECK(ask("mind"));
  CHECK_FALSE(ask("mind"));
  for (std::size_t i = kept.size(); i < Approvals::max_pending; ++i) CHECK(ask("mind" + std::to_string(i)));
  CHECK_FALSE(ask("another"));
  CHECK(ask("another", start + seconds(61)));
  auto large = drive();
  large.values = std::string(Approvals::max_values + 1, ' ');
  CHECK_FALSE(Approvals().ask(large, ignore, end, start));
  large = drive();
  large.why = std::string(Approvals::max_why + 1, 'x');
  CHECK_FALSE(Approvals().ask(large, ignore, end, start));
}

TEST_CASE("approvals: stop denies what waits and what was allowed but not begun, and tells what goes on") {
  Approvals approvals;
  int woken = 0;
  const auto waiting = *approvals.ask(
      drive(), [&] { ++woken; }, end, start);
  const auto allowed = *approvals.ask(drive(), ignore, end, start);
  REQUIRE(approvals.answer(allowed->approval().id, who("root"), true, minutes(60), start));
  int told = 0;
  const auto running = approvals.watch_stop([&]() -> SafeAnswerPtr {
    ++told;
    return nullptr;
  });
  boost::asio::io_context io;
  const auto answer = std::make_shared<SafeAnswer>(io.get_executor(), "arm", "Arm");
  const auto leased = approvals.watch_stop([&] { return answer; });
  approvals.watch_stop([&]() -> SafeAnswerPtr {  // is over at once
    told += 100;
    return nullptr;
  });
  CHECK_FALSE(approvals.is_stopped(start));
  const auto stopped = approvals.stop(minutes(10), start);
  CHECK(stopped.commands == 3);
  CHECK(stopped.answers == std::vector{answer});
  CHECK(woken == 1);
  CHECK(told == 1);
  CHECK(waiting->state() == ApprovalState::denied);
  CHECK(allowed->state() == ApprovalState::denied);
  CHECK_FALSE(approvals.is_granted(drive(), start));
  CHECK(approvals.is_stopped(start + minutes(10) - seconds(1)));
  CHECK_FALSE(approvals.is_stopped(start + minutes(10)));
}

TEST_CASE("approvals: a second stop shortens no longer one, but lets agents go on at once where it says so") {
  Approvals approvals;
  approvals.stop(minutes(480), start);
  approvals.stop(minutes(10), start + minutes(1));
  CHECK(approvals.stopped_until() == start + minutes(480));
  approvals.stop(minutes(10), start + minutes(475));
  CHECK(approvals.stopped_until() == start + minutes(485));
  approvals.stop(minutes(0), start + minutes(476));
  CHECK_FALSE(approvals.is_stopped(start + minutes(476)));
  approvals.stop(minutes(10), start + minutes(477));
  CHECK(approvals.stopped_until() == start + minutes(487));
  STATIC_REQUIRE(Approvals::Clock::is_steady);
}
