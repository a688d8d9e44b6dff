// A generated service and a generated client of it, over TCP.
#include <catch2/catch.hpp>

#include "experimental__interop.hpp"
#include "experimental__simulatedcreate.hpp"
#include "test/node/generated/words_service.hpp"

using namespace rr;
using namespace std::chrono_literals;
using namespace test::words;
using Catch::Matchers::Contains;

namespace {

struct Session {
  std::shared_ptr<Everything> everything = std::make_shared<Everything>();
  RunningNode node{[this](Node& owner) { owner.add(make_service("words", everything)); }};
  ObjectClient client{connect(node.url("words"))};

  bool wait_until(const std::function<bool()>& is_done) { return client.rr_object.connection().run_until(is_done, 5s); }
};

}  // namespace

TEST_CASE("generated: values of every type go to the service and come back as they were") {
  Session session;
  const auto& client = session.client;
  CHECK_FALSE(client.switch_value().get());
  const auto value = make_struct();
  client.switch_value().set(value);
  CHECK(client.switch_value().get() == value);
  CHECK(*client.constructor(value, "any") == value);
  CHECK_FALSE(client.constructor(nullptr, {}));
  client.pods().set({make_pod(1), make_pod(2)});
  CHECK(client.pods().get() == std::vector{make_pod(1), make_pod(2)});
  client.point().set({{1, 2}, 3});
  CHECK(client.point().get() == union_{{1, 2}, 3});
  client.auto_().set(-16);
  CHECK(client.goto_().get() == enumeration::private_);
  client.any().set(Value(std::int32_t{5}));
  CHECK(client.auto_().get() == 5);
}

TEST_CASE("generated: functions, events and wires") {
  Session session;
  const auto& client = session.client;
  std::vector<std::string> heard;
  client.explicit_().on([&](double number, const Nullable<std::vector<std::string>>& texts) {
    heard.push_back(std::to_string(static_cast<int>(number)) + texts->at(0) + texts->at(1));
  });
  CHECK(client.operator_(3, "words", enumeration::while_) == 4);
  REQUIRE(session.wait_until([&] { return !heard.empty(); }));
  CHECK(heard.front() == "3wordsmore");

  std::vector<double> positions;
  client.position().connect([&](double value) { positions.push_back(value); });
  client.target().poke({{1, 2}, 3});
  CHECK(client.target().peek_out() == union_{{1, 2}, 3});
  REQUIRE(session.wait_until([&] { return !positions.empty(); }));
  CHECK(positions == std::vector{3.0});
  CHECK(client.position().peek() == 3.0);
  client.target().connect();
  client.target().send({{0, 0}, 4});
  REQUIRE(session.wait_until([&] { return positions.size() == 2; }));
  CHECK(session.node.ask([&](Node&) { return session.everything->received_target; })->this_one == 4);

  std::optional<TimeSpec> time;
  std::optional<switch_> status;
  client.status().connect([&](const Nullable<switch_>& value, TimeSpec at) {
    status = *value;
    time = at;
  });
  client.status().send(make_struct());
  REQUIRE(session.wait_until([&] { return status.has_value(); }));
  CHECK(*status == make_struct());
  CHECK(time->seconds > 0);
  client.status().disconnect();
}

TEST_CASE("generated: objects are found by objrefs, as their type or a base of it") {
  Session session;
  const auto& client = session.client;
  const auto base = client.friend_();
  CHECK(base.who() == "friend");
  CHECK(base.rr_object.type_name() == "test.words.interface");
  const interfaceClient whole(base.rr_object);
  whole.long_().set(2.5);
  CHECK(base.long_().get() == 2.5);
  std::int32_t moved_by = 0;
  base.moved().on([&](std::int32_t by) { moved_by = by; });
  whole.f();
  REQUIRE(session.wait_until([&] { return moved_by != 0; }));
  CHECK(moved_by == 5);
  // The wire's value was set before any client looked the object up.
  CHECK(base.level().peek() == 7);
  base.level().poke(8);
  CHECK(base.level().peek() == 9);

  CHECK(client.many(2).who() == "many 2");
  CHECK(error_of([&] { client.many(3); }).code == ErrorCode::service_error);
  CHECK(client.numbered(-4).who() == "number -4");
  CHECK(client.named("a.b").named("c").auto_().get() == 0);
  CHECK(baseClient(client.whatever()).who() == "friend");
  CHECK_THAT(error_of([&] { ObjectClient wrong(base.rr_object); }).message,
             Contains("is a test.words.interface, which is no test.words.Object"));
}

TEST_CASE("generated: declared exceptions arrive as their classes, others as ClientException") {
  Session session;
  const interfaceClient left(session.client.friend_().parent().rr_object);
  try {
    left.f();
    FAIL("no exception");
  } catch (const delete_& exception) {
    CHECK(std::string(exception.what()) == "it is gone");
    CHECK(exception.error().sub_name == "why");
    CHECK(exception.error().param->to<std::int32_t>().value() == 3);
  }
  CHECK_THROWS_AS(session.client.then(1), more::thrown);
  CHECK(error_of([&] { session.client.void_function(Map::register_, nullptr); }).code == ErrorCode::null_value);
  CHECK(error_of([&] { session.client.toString(); }).name == "rrgate.UnhandledException");
  CHECK(error_of([&] { session.client.position().peek(); }).code == ErrorCode::value_not_set);
}

TEST_CASE("generated: generators") {
  Session session;
  auto numbers = session.client.count(3);
  std::vector<std::int32_t> counted;
  while (const auto number = numbers.next()) counted.push_back(*number);
  CHECK(counted == std::vector{0, 1, 2});
  CHECK_FALSE(numbers.next());

  auto lines = session.client.collect();
  CHECK(lines.next("one"));
  CHECK_FALSE(lines.next("two"));
  CHECK(session.node.ask([&](Node&) { return session.everything->lines; }) == std::vector<std::string>{"one", "two"});
  CHECK_THROWS_AS(session.client.collect().next("broken"), delete_);

  auto sums = session.client.both_ways(1);
  CHECK(sums.next(2) == 3.0);
  CHECK(sums.next(4) == 5.0);
  sums.close();
  CHECK_FALSE(sums.next(1));
}

TEST_CASE("generated: pipes") {
  Session session;
  std::vector<std::vector<double>> packets;
  const auto samples =
      session.client.samples().connect([&](std::vector<double> packet) { packets.push_back(packet); }, 7);
  samples.send({1, 2});
  samples.send({3});
  REQUIRE(session.wait_until([&] { return packets.size() == 2; }));
  CHECK(packets == std::vector<std::vector<double>>{{1, 2, 7}, {3, 7}});
  samples.close();
  CHECK_FALSE(samples.is_open());

  std::string heard;
  const auto frames = session.client.frames().connect(
      [&](const Nullable<switch_>& frame) { heard = *frame->anything->at(0).to_text(); });
  session.client.commands().connect().send("take one");
  REQUIRE(session.wait_until([&] { return !heard.empty(); }));
  CHECK(heard == "take one");
}

TEST_CASE("generated: memories") {
  Session session;
  const auto& client = session.client;
  session.node.ask([&](Node&) { return *session.everything->numbers = {{1000}, std::vector<double>(1000)}; });
  CHECK(client.numbers().dimensions() == MemoryShape{1000});
  client.numbers().write({10}, {1.5, 2.5});
  CHECK(client.numbers().read({9}, {4}) == std::vector<double>{0, 1.5, 2.5, 0});
  CHECK(client.image().read() == MultiDim<std::uint8_t>{{2, 3}, {1, 2, 3, 4, 5, 6}});
  CHECK(client.image().read({1, 1}, {1, 2}) == MultiDim<std::uint8_t>{{1, 2}, {4, 6}});
  client.pod_memory().write({1}, {make_pod(5)});
  CHECK(client.pod_memory().read() == std::vector{template_{}, make_pod(5)});
  client.points().write({1, 0}, {{1, 1}, {{{1, 2}, 3}}});
  CHECK(client.points().read() == MultiDim<union_>{{2, 1}, {{}, {{1, 2}, 3}}});
  CHECK(error_of([&] { client.numbers().read({999}, {2}); }).code == ErrorCode::out_of_range);
  session.node.ask([&](Node&) { return session.everything->numbers->items.resize(5), true; });
  CHECK(error_of([&] { client.numbers().read({0}, {1}); }).code == ErrorCode::invalid_state);
}

TEST_CASE("generated: callbacks") {
  Session session;
  const auto& client = session.client;
  std::vector<std::string> answers;
  const auto ask = [&](std::string question) {
    session.node.ask([&](Node&) {
      session.everything->ask(session.everything->last_client, question, enumeration::private_,
                              [&](const Result<std::int32_t>& answer) {
                                answers.push_back(answer ? std::to_string(*answer) : answer.error().message);
                              });
      return true;
    });
  };
  int asked = 0;
  client.ask().on([&](const std::string& question, enumeration how) {
    ++asked;
    if (question.empty()) throw delete_("nothing was asked");
    return static_cast<std::int32_t>(question.size()) + static_cast<std::int32_t>(how);
  });
  client.auto_().get();
  ask("how many");
  ask("");
  REQUIRE(session.wait_until([&] { return asked == 2; }));
  client.auto_().get();  // the answers went before it
  CHECK(answers == std::vector<std::string>{"-8", "nothing was asked"});
}

TEST_CASE("generated: stubs that are used too early or twice say so") {
  Friend alone("alone");
  CHECK_THROWS_WITH(alone.rr_service(), Contains("test.words.interface is in no service yet"));
  CHECK_NOTHROW(alone.moved(1));
  const auto root = std::make_shared<Friend>("root");
  const auto service = make_service("one", root);
  CHECK(&root->rr_service() == service.get());
  CHECK_THROWS_WITH(make_service("two", root), Contains("belongs to service 'one'"));
}

TEST_CASE("generated: a member with the name of a class that is made of its object") {
  struct MyHome : HomeService_ {
    void Home() override {}
    std::string HomeService() override { return "at home"; }
    Nullable<same> get_value() override { return {}; }
    void set_value(Nullable<same>) override {}
  };
  RunningNode node([](Node& owner) { owner.add(make_service("home", std::make_shared<MyHome>())); });
  CHECK(ActuatorClient(connect(node.url("home"))).HomeService() == "at home");
  CHECK(HomeClient(connect(node.url("home"))).HomeService() == "at home");
}

TEST_CASE("generated: constants and names") {
  CHECK(class_ == 5);
  CHECK(smallest == std::numeric_limits<std::int64_t>::min());
  CHECK(huge == std::numeric_limits<std::uint64_t>::max());
  CHECK(three == std::array<std::int16_t, 3>{-1, 16, 3});
  CHECK(text == std::string_view("a \"quoted\" \\ text\n\x01\xc3\xa9"));
  CHECK(both::second::third == 0.33333334f);
  CHECK(interface::pair::b == "interface");
  CHECK(experimental::create2::Create::DRIVE_STRAIGHT == 32767);
  CHECK(experimental::interop::Everything{}.color == experimental::interop::Color::red);
  CHECK(experimental::simulatedcreate::rr_definitions().size() == 2);
}
