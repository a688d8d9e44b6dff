// The gateway's session with a device: how it is kept open, and what its clients hear of each other's leaving.
#include "server/upstream/upstream.hpp"

#include <boost/asio/steady_timer.hpp>
#include <thread>

#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

/// A generator whose values come late.
struct Hanging {
  int asked = 0;
  int closed = 0;
  int aborted = 0;
  std::vector<std::shared_ptr<rr::LateCall>> calls;

  explicit Hanging(rr::Service& service) {
    service.generator("count", [this] {
      rr::Generator made;
      made.start = [this](rr::Value, const std::shared_ptr<rr::LateCall>& call) {
        ++asked;
        calls.push_back(call);
      };
      made.close = [this] { ++closed; };
      made.abort = [this] { ++aborted; };
      return made;
    });
  }
  void answer() {
    for (const auto& call : std::exchange(calls, {})) call->answer(rr::Value(std::int32_t{1}));
  }
};

/// When a session is opened that is lost at once.
struct Attempts {
  std::vector<std::chrono::steady_clock::time_point> times;
  std::chrono::milliseconds gap(std::size_t after) const {
    return std::chrono::duration_cast<std::chrono::milliseconds>(times.at(after + 1) - times.at(after));
  }
};

/// Asks for the wire "level" of an object that the client takes for a `type`; empty: for whatever it is.
rr::Result<rr::Value> peek_level(UpstreamBench& bench, HearingClient& client, const std::string& path,
                                 const std::string& type) {
  rr::Called called;
  called.kind = rr::CallKind::peek_in;
  called.object = std::make_shared<SharedObject>(path, type);
  called.member = bench.upstream->types()->find_entity("test.bench.Part")->find_member("level");
  std::optional<rr::Result<rr::Value>> answer;
  bench.upstream->request(client, called, [&](rr::Result<rr::Value> result) { answer = std::move(result); });
  REQUIRE(bench.run_until([&] { return answer.has_value(); }));
  return *answer;
}

}  // namespace

TEST_CASE("a client that leaves while an event is handed out hears nothing of it; all others do") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  std::vector<std::string> heard;
  HearingClient first(bench.upstream);
  std::optional<HearingClient> second(std::in_place, bench.upstream);
  HearingClient third(bench.upstream);
  first.on_event = [&](rr::EventPacket&) {
    heard.push_back("first");
    second.reset();
  };
  second->on_event = [&](rr::EventPacket&) { heard.push_back("second"); };
  third.on_event = [&](rr::EventPacket&) { heard.push_back("third"); };
  device.service->fire("struck", 1);
  CHECK(bench.run_until([&] { return heard.size() == 2; }));
  device.service->fire("struck", 2);
  CHECK(bench.run_until([&] { return heard.size() == 4; }));
  CHECK(heard == std::vector<std::string>{"first", "third", "first", "third"});
}

TEST_CASE("a wire's value is packed once, however many turns its clients take") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  const auto& wire = *bench.upstream->object_type("bench")->find_member("level");
  constexpr std::uint16_t mark = 4711;
  std::size_t packed = 0, received = 0;
  std::vector<std::unique_ptr<HearingClient>> clients;
  for (int i = 0; i < 200; ++i) {
    auto& client = *clients.emplace_back(std::make_unique<HearingClient>(bench.upstream));
    bench.upstream->join_wire(client, "bench", wire);
    client.on_wire = [&](rr::WirePacket& packet) {
      const auto message = packet.message(*bench.upstream->types());
      REQUIRE(message.has_value());
      auto& id = (*message)->message.header.message_id;
      if (std::exchange(id, mark) != mark) ++packed;
      ++received;
    };
  }
  REQUIRE(bench.run_until([&] { return clients.back()->heard.size() == 1; }));
  for (std::size_t i = 1; i <= 2; ++i) {
    device.service->set_wire("level", 0.5);
    REQUIRE(bench.run_until([&] { return received == i * clients.size(); }));
    CHECK(packed == i);
  }
}

TEST_CASE("a device that drops each session at once is tried ever more rarely, until one has lasted") {
  Counting device;
  UpstreamBench bench(device.service);
  Attempts attempts;
  constexpr std::size_t lasting = 4;
  bench.keep_open({40ms, 10s, 10s}, [&]() -> rr::Result<> {
    attempts.times.push_back(std::chrono::steady_clock::now());
    if (attempts.times.size() - 1 != lasting) bench.upstream->break_off();
    return {};
  });
  REQUIRE(bench.run_until([&] { return attempts.times.size() == lasting + 1; }));
  CHECK(attempts.gap(0) >= 20ms);  // at least half of 40 ms, 80 ms, ...
  CHECK(attempts.gap(2) >= 80ms);
  CHECK(attempts.gap(3) >= 160ms);
  boost::asio::steady_timer while_it_lasts(bench.io, 450ms);
  bool has_lasted = false;
  while_it_lasts.async_wait([&](const auto&) { has_lasted = true; });
  REQUIRE(bench.run_until([&] { return has_lasted; }));
  const auto lost = std::chrono::steady_clock::now();
  bench.upstream->break_off();
  REQUIRE(bench.run_until([&] { return attempts.times.size() == lasting + 2; }));
  CHECK(attempts.times.back() - lost < 320ms);  // half of what would come next, had it not lasted
}

TEST_CASE("what a reload says of retries holds from the next wait on") {
  Counting device;
  UpstreamBench bench(device.service);
  int attempts = 0;
  bench.keep_open({10ms, 20ms, 10s}, [&]() -> rr::Result<> {
    if (++attempts == 1) bench.set_retry({1h, 1h, 10s});
    if (attempts == 2) bench.set_retry({10ms, 20ms, 10s});
    bench.upstream->break_off();
    return {};
  });
  REQUIRE(bench.run_until([&] { return attempts == 1 && !bench.upstream->is_open(); }));
  boost::asio::steady_timer would_have_retried(bench.io, 100ms);
  bool is_over = false;
  would_have_retried.async_wait([&](const auto&) { is_over = true; });
  REQUIRE(bench.run_until([&] { return is_over; }));
  CHECK(attempts == 1);
  bench.upstream->retry_now();
  CHECK(bench.run_until([&] { return attempts >= 3; }));
}

TEST_CASE("wires that were joined anew by a session that was lost at once are joined by the next one") {
  const std::string path = "bench.parts[1]";  // which the device is asked for
  Counting device;
  auto part = device.service->make_object("Part");
  device.service->root().objref("parts", [&](std::string_view) { return part; });
  UpstreamBench bench(device.service);
  const auto cut = rr::make_error(rr::ErrorCode::connection_error, "the line was cut");
  int sessions = 0;
  bench.keep_open({10ms, 20ms, 10s}, [&]() -> rr::Result<> {
    if (++sessions == 2) bench.upstream->connection()->close(cut);
    return {};
  });
  REQUIRE(bench.wait_for(bench.upstream->opened()).has_value());
  REQUIRE(bench.find(path).has_value());
  HearingClient client(bench.upstream);
  std::vector<double> received;
  client.on_wire = [&](rr::WirePacket& packet) { received.push_back(packet.value().to<double>().value()); };
  bench.upstream->join_wire(client, path, *bench.upstream->object_type(path)->find_member("level"));
  REQUIRE(bench.run_until([&] { return client.heard.size() == 1; }));
  bench.upstream->connection()->close(cut);
  REQUIRE(bench.run_until([&] { return sessions == 3 && client.heard.back() == "wire level joined"; }));
  part->set_wire("level", 0.5);
  CHECK(bench.run_until([&] { return !received.empty(); }));
  for (const auto& heard : client.heard) CHECK(heard == "wire level joined");
}

TEST_CASE("what a client sends while the device is away is not sent when it has left, but what others send is") {
  Counting device;
  std::vector<double> wishes;
  device.service->on_wire("wish", [&](double value) { wishes.push_back(value); });
  UpstreamBench bench(device.service);
  bench.open();
  const auto& wire = *bench.upstream->object_type("bench")->find_member("wish");
  std::optional<HearingClient> first(std::in_place, bench.upstream);
  HearingClient second(bench.upstream);
  const auto is_joined = [&] { return second.heard.size() == 1 && second.heard.back() == "wire wish joined"; };
  bench.upstream->join_wire(*first, "bench", wire);
  bench.upstream->join_wire(second, "bench", wire);
  REQUIRE(bench.run_until(is_joined));
  bench.upstream->connection()->close(rr::make_error(rr::ErrorCode::connection_error, "the line was cut"));
  REQUIRE(bench.run_until([&] { return !bench.upstream->is_open(); }));
  CHECK(bench.upstream->send_wire(*first, "bench", wire, rr::Value(1.0)).has_value());
  first.reset();
  second.heard.clear();
  bench.open();
  REQUIRE(bench.run_until(is_joined));
  CHECK(bench.upstream->send_wire(second, "bench", wire, rr::Value(2.0)).has_value());
  REQUIRE(bench.run_until([&] { return !wishes.empty(); }));
  CHECK(wishes == std::vector<double>{2.0});
}

TEST_CASE("who waits for a session that is lost as soon as it is open hears that; the next one gets in") {
  Counting device;
  UpstreamBench bench(device.service);
  bool is_first = true;
  bench.keep_open({10s, 10s, 10s}, [&]() -> rr::Result<> {
    const auto cut = rr::make_error(rr::ErrorCode::connection_error, "the line was cut");
    if (std::exchange(is_first, false)) bench.upstream->connection()->close(cut);
    return {};
  });
  const auto first = bench.wait_for(bench.upstream->opened());
  REQUIRE_FALSE(first.has_value());
  CHECK(first.error().message == "connection_lost: device 'device': the line was cut");
  CHECK(bench.wait_for(bench.upstream->opened()).has_value());
  CHECK(bench.upstream->is_open());
}

TEST_CASE("a session that nobody has wanted yet rests once it is known what the service is; one that is wanted stays") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.upstream->rest_unused(1h);
  bench.keep_open({10s, 10s, 10s});
  REQUIRE(bench.run_until([&] { return bench.upstream->is_resting(); }));
  CHECK(bench.upstream->has_tried());
  REQUIRE(bench.upstream->types());
  CHECK(bench.upstream->types()->find_entity("test.bench.Bench"));
  CHECK(bench.run_until([&] { return bench.node.client_count() == 0; }));
  CHECK(bench.wait_for(bench.upstream->opened()).has_value());
  CHECK(bench.find("bench").has_value());
  CHECK(bench.upstream->is_open());
}

TEST_CASE("a generator that opens when its client has gone is nobody else's") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  std::optional<HearingClient> client(std::in_place, bench.upstream);
  const auto* address = &*client;
  const auto opened = bench.ask(*client, rr::CallKind::generator_open, "bench", "count", 1);
  client.reset();
  client.emplace(bench.upstream);
  REQUIRE(&*client == address);
  REQUIRE(bench.run_until([&] { return opened->has_value(); }));
  CHECK(bench.run_until([&] { return device.open_generators() == 0; }));
  const auto next = bench.ask(*client, rr::CallKind::generator_next, "bench", "count", 1);
  REQUIRE(bench.run_until([&] { return next->has_value(); }));
  REQUIRE_FALSE((**next).has_value());
  CHECK((*next)->error().code == rr::ErrorCode::invalid_operation);
}

TEST_CASE("a device that takes too long has the time for its answer that the configuration gives it") {
  Counting device;
  UpstreamBench bench(device.service);
  answer_within(bench, 100ms);
  bench.open();
  HearingClient client(bench.upstream);
  const auto asked = bench.ask(client, rr::CallKind::function, "bench", "wait");
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  REQUIRE_FALSE((**asked).has_value());
  CHECK((*asked)->error().code == rr::ErrorCode::request_timeout);
}

TEST_CASE("a generator whose value comes too late is the client's still, to be ended at the device") {
  Counting device;
  Hanging hanging(*device.service);
  UpstreamBench bench(device.service);
  answer_within(bench, 200ms);
  bench.open();
  std::optional<HearingClient> client(std::in_place, bench.upstream);
  const auto opened = bench.ask(*client, rr::CallKind::generator_open, "bench", "count", 1);
  REQUIRE(bench.run_until([&] { return opened->has_value(); }));
  const auto next = bench.ask(*client, rr::CallKind::generator_next, "bench", "count", 1);
  REQUIRE(bench.run_until([&] { return next->has_value(); }));
  REQUIRE(hanging.asked == 1);
  REQUIRE_FALSE((**next).has_value());
  CHECK((*next)->error().code == rr::ErrorCode::request_timeout);
  SECTION("by the client") {
    const auto aborted = bench.ask(*client, rr::CallKind::generator_abort, "bench", "count", 1);
    REQUIRE(bench.run_until([&] { return aborted->has_value(); }));
    CHECK((**aborted).has_value());
    CHECK(hanging.aborted == 1);
  }
  SECTION("when the client leaves") {
    client.reset();
    bench.find("bench.others[1]");
    hanging.answer();  // until then it is not closed
    CHECK(bench.run_until([&] { return hanging.closed == 1; }));
  }
}

TEST_CASE("a generator whose step is too large to be sent is ended at the device, which knows nothing of it") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  const auto opened = bench.ask(client, rr::CallKind::generator_open, "bench", "fill", 1);
  REQUIRE(bench.run_until([&] { return opened->has_value(); }));
  REQUIRE(device.open_generators() == 1);
  const auto next = bench.ask(client, rr::CallKind::generator_next, "bench", "fill", 1,
                              {rr::Value(std::vector<std::uint8_t>(13'000'000))});
  REQUIRE(bench.run_until([&] { return next->has_value(); }));
  REQUIRE_FALSE((**next).has_value());
  CHECK_FALSE(bench.upstream->has_generator(client, 1));
  CHECK(bench.run_until([&] { return device.open_generators() == 0; }));
}

TEST_CASE("an object that is of another type after an outage is released, and found as what it is") {
  const std::string path = "bench.things[1]";
  Counting device;
  device.put_thing("Part");
  UpstreamBench bench(device.service);
  bench.open();
  REQUIRE(bench.find(path).has_value());
  std::vector<std::string> released;
  bench.upstream->on_released([&](const std::string& which) { released.push_back(which); });
  HearingClient client(bench.upstream);
  bench.upstream->join_wire(client, path, *bench.upstream->object_type(path)->find_member("level"));
  REQUIRE(bench.run_until([&] { return client.heard.size() == 1; }));
  cut(bench, bench.upstream);
  bench.open();
  REQUIRE(bench.run_until([&] { return client.heard.size() == 2; }));
  CHECK(client.heard.back() == "wire level joined");
  CHECK(released.empty());
  cut(bench, bench.upstream);
  device.put_thing("Motor");
  device.service->root().release("things", "1");
  bench.open();
  REQUIRE(bench.run_until([&] { return client.heard.size() == 3; }));
  CHECK(client.heard.back() == "released " + path);
  CHECK(released == std::vector{path});
  CHECK(bench.find(path)->to_text().value() == "test.bench.Motor");
}

TEST_CASE("a session hears that an object is of another type now though another session has found it") {
  const std::string path = "bench.things[1]";
  Counting device;
  device.put_thing("Motor");
  UpstreamBench bench(device.service);
  bench.open();
  std::vector<std::string> released;
  bench.upstream->on_released([&](const std::string& which) { released.push_back(which); });
  bench.upstream->note_object(path, "test.bench.Part");
  cut(bench, bench.upstream);
  bench.open();
  REQUIRE(bench.run_until([&] { return !released.empty(); }));
  CHECK(released == std::vector{path});
}

TEST_CASE("a request to an object that is of another type than its client was told is not passed on") {
  const std::string path = "bench.things[1]";
  Counting device;
  device.put_thing("Motor");
  UpstreamBench bench(device.service);
  bench.open();
  std::vector<std::string> released;
  bench.upstream->on_released([&](const std::string& which) { released.push_back(which); });
  HearingClient client(bench.upstream);
  const auto answer = peek_level(bench, client, path, "test.bench.Part");
  REQUIRE_FALSE(answer.has_value());
  CHECK(answer.error().code == rr::ErrorCode::object_not_found);
  CHECK(client.heard == std::vector{"released " + path});
  CHECK(released == std::vector{path});
}

TEST_CASE(
    "who has joined a wire or a pipe needs nothing of the definition by which a client that has left had joined it") {
  const std::string member = GENERATE("level", "news");
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  auto of_first = *bench.upstream->object_type("bench")->find_member(member);
  const auto own = of_first;
  auto first = std::make_unique<HearingClient>(bench.upstream);
  HearingClient second(bench.upstream);
  std::string received;
  second.on_wire = [&](const rr::WirePacket& packet) { received = packet.member().name; };
  const auto join = [&](HearingClient& client, const rr::MemberDefinition& definition_of_client) {
    if (member == "level") return bench.upstream->join_wire(client, "bench", definition_of_client);
    bench.upstream->join_pipe(client, 1, "bench", definition_of_client);
  };
  join(*first, of_first);
  join(second, own);
  REQUIRE(bench.run_until([&] { return second.heard.size() == 1; }));
  first.reset();
  of_first.name = "forgotten";
  cut(bench, bench.upstream);
  bench.open();
  REQUIRE(bench.run_until([&] { return second.heard.size() == 2; }));
  CHECK(second.heard.back() == second.heard.front());
  if (member == "news") return;
  device.service->set_wire("level", 2.5);
  REQUIRE(bench.run_until([&] { return !received.empty(); }));
  CHECK(received == "level");
}

TEST_CASE("what one login is refused after an outage stays with all others") {
  Counting device;
  device.put_thing("Part");
  UpstreamBench bench(device.service);
  bench.open();
  REQUIRE(bench.find("bench.things[1]").has_value());
  std::vector<std::string> released;
  bench.upstream->on_released([&](const std::string& which) { released.push_back(which); });
  HearingClient client(bench.upstream);
  cut(bench, bench.upstream);
  device.service->root().objref("things", [](std::string_view) -> std::shared_ptr<rr::Object> {
    throw rr::ServiceException("not for you", rr::ErrorCode::permission_denied);
  });
  device.service->root().release("things", "1");
  bench.open();
  REQUIRE(bench.run_until([&] { return !client.heard.empty(); }));
  CHECK(client.heard == std::vector<std::string>{"released bench.things[1]"});
  CHECK(released.empty());
}

TEST_CASE("a request whose client leaves while its object is looked for has failed") {
  const std::string path = "bench.things[1]";
  Counting device;
  device.put_thing("Motor");
  UpstreamBench bench(device.service);
  bench.open();
  REQUIRE(bench.find(path).has_value());
  const auto own = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(own->open()).has_value());
  std::optional<HearingClient> client(std::in_place, own);
  const auto asked = bench.ask_by(*own, *client, rr::CallKind::function, path, "stop");
  client.reset();
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  REQUIRE_FALSE((**asked).has_value());
  CHECK((*asked)->error().code == rr::ErrorCode::connection_error);
  CHECK(device.commands.empty());
  own->close();
}

TEST_CASE("who asks for a member whatever its object is releases nothing") {
  const std::string path = "bench.things[1]";
  Counting device;
  device.put_thing("Part");
  UpstreamBench bench(device.service);
  bench.open();
  std::vector<std::string> released;
  bench.upstream->on_released([&](const std::string& which) { released.push_back(which); });
  HearingClient client(bench.upstream);
  peek_level(bench, client, path, "");
  CHECK(released.empty());
  CHECK(client.heard.empty());
}

TEST_CASE("what a device was asked when its service ended is told to be lost with the connection") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  const auto asked = bench.ask(client, rr::CallKind::function, "bench", "wait");
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  bench.node.stop();
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  REQUIRE_FALSE((**asked).has_value());
  CHECK((*asked)->error().message == "connection_lost: device 'device': the service was closed");
}

TEST_CASE("an index of a plain objref is refused before the device is asked, which may ignore it") {
  Counting device;
  int asked = 0;
  device.service->root().objref("others", [&](std::string_view) {
    ++asked;
    return device.service->make_object("Bench");
  });
  UpstreamBench bench(device.service);
  bench.open();
  std::optional<rr::Result<rr::Value>> answer;
  const auto keep = [&](const rr::Result<rr::Value>& found) { answer = found; };
  const auto is_refused = [&] {
    return answer && !*answer && answer->error().message == "objref 'spare' has no index";
  };
  bench.upstream->find_object("bench.spare[7]", keep);
  CHECK(is_refused());
  answer.reset();
  bench.upstream->find_object("bench.others[1].spare[7]", keep);
  CHECK(bench.run_until([&] { return answer.has_value(); }));
  CHECK(is_refused());
  CHECK(asked == 1);
  for (const std::string path : {"bench.spare[7].others[1]", "bench.others[1].spare[7].spare"}) {
    answer.reset();
    bench.upstream->find_object(path, keep);
    CHECK(bench.run_until([&] { return answer.has_value(); }));
    CHECK(is_refused());
  }
  CHECK(asked == 1);
  answer.reset();
  bench.upstream->find_object("bench.others[%201]", keep);  // " 1"
  CHECK((answer && !*answer && answer->error().message.ends_with("expected a decimal int32")));
  answer.reset();
  bench.upstream->find_object("bench.others[1].others[2]", keep);
  CHECK(bench.run_until([&] { return answer.has_value(); }));
  CHECK(asked == 1);
  CHECK((answer && answer->has_error()));
}

TEST_CASE("a client that goes on as another user hears what has become of what it waits for") {
  Counting device;
  device.service->root().allow_monitor();
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient first(bench.upstream);
  HearingClient second(bench.upstream);
  std::vector<bool> answers;
  const auto enter = [&](HearingClient& client) {
    rr::LockWanted wanted;
    wanted.id = 1;
    wanted.command = rr::LockCommand::enter_monitor;
    wanted.path = "bench";
    wanted.timeout = -1ms;
    bench.upstream->lock(client, wanted, [&](const rr::Result<>& result) { answers.push_back(result.has_value()); });
  };
  enter(first);
  REQUIRE(bench.run_until([&] { return answers.size() == 1; }));
  enter(second);
  bench.upstream->change_user(second);
  CHECK(bench.run_until([&] { return answers.size() == 2; }));
  CHECK(answers == std::vector{true, false});
}

TEST_CASE("a client that has left is nobody's any more, as whatever user it would go on") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  bench.upstream->remove(client);
  bench.upstream->change_user(client);
  bool is_answered = false;
  rr::LockWanted wanted;
  wanted.command = rr::LockCommand::enter_monitor;
  wanted.path = "bench";
  bench.upstream->lock(client, wanted, [&](const rr::Result<>&) { is_answered = true; });
  bench.find("bench");
  CHECK_FALSE(is_answered);
}

TEST_CASE("a session that is lost because a lease has ended refuses whoever has found that out") {
  Counting device;
  LeaseConfig leases;
  leases.is_offered = true;
  UpstreamBench bench(device.service, leases);
  bench.open();
  HearingClient holder(bench.upstream);
  HearingClient other(bench.upstream);
  holder.on_lease_ended = [&] {
    bench.upstream->connection()->close(rr::make_error(rr::ErrorCode::connection_error, "the line was cut"));
    bench.run_until([&] { return !bench.upstream->is_open(); });
  };
  take_lease(bench, bench.upstream, holder, 100ms);
  std::this_thread::sleep_for(150ms);
  const auto asked = bench.ask(other, rr::CallKind::function, "bench", "stop");
  REQUIRE(asked->has_value());
  CHECK((*asked)->error().code == rr::ErrorCode::connection_error);
}

TEST_CASE("thousands who wait for monitors of a device that is lost are all told") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  constexpr std::size_t count = 6000;
  std::vector<std::unique_ptr<HearingClient>> clients;
  std::size_t answers = 0;
  for (std::size_t i = 0; i < count; ++i) {
    auto& client = *clients.emplace_back(std::make_unique<HearingClient>(bench.upstream));
    rr::LockWanted wanted;
    wanted.id = 1;
    wanted.command = rr::LockCommand::enter_monitor;
    wanted.path = i % 8 == 0 ? "bench" : "bench.others[" + std::to_string(i % 8) + "]";
    wanted.timeout = -1ms;
    bench.upstream->lock(client, wanted, [&](const rr::Result<>&) { ++answers; });
  }
  bench.upstream->break_off();
  CHECK(bench.run_until([&] { return answers == count; }));
}

TEST_CASE("a wire of an object that is looked for is connected for those who are there then") {
  Counting device;
  const auto part = device.service->make_object("Part");
  device.service->root().objref("parts", [&](std::string_view) { return part; });
  UpstreamBench bench(device.service);
  bench.open();
  const auto& level = *bench.upstream->object_type("bench")->find_member("level");
  HearingClient client(bench.upstream);
  bench.upstream->join_wire(client, "bench.parts[1]", level);
  bench.upstream->leave_wire(client, "bench.parts[1]", level);
  REQUIRE(bench.find("bench.parts[1]").has_value());
  REQUIRE(bench.find("bench").has_value());
  CHECK(client.heard.empty());
  bench.upstream->join_wire(client, "bench", level);
  bench.upstream->leave_wire(client, "bench", level);
  bench.upstream->join_wire(client, "bench", level);
  REQUIRE(bench.run_until([&] { return client.heard.size() == 1; }));
  bench.find("bench");
  CHECK(client.heard == std::vector<std::string>{"wire level joined"});
}

TEST_CASE("a client that has left asks the device for nothing") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  bench.upstream->remove(client);
  const auto asked = bench.ask(client, rr::CallKind::function, "bench", "stop");
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  REQUIRE_FALSE((**asked).has_value());
  CHECK((*asked)->error().code == rr::ErrorCode::operation_cancelled);
  bench.find("bench");
  CHECK(device.commands.empty());
}

/// Two clients of a device with an object below its root, and leases.
struct LockBench {
  Counting device;
  std::shared_ptr<rr::Object> part = device.service->make_object("Part");
  UpstreamBench bench;
  HearingClient first;
  HearingClient second;
  rr::LockRequestId last = 0;

  LockBench() : bench(with_part(), {.is_offered = true}), first(bench.upstream), second(bench.upstream) {
    bench.open();
    REQUIRE(bench.find("bench.parts[1]").has_value());
  }

  std::shared_ptr<rr::Service> with_part() {
    part->allow_monitor();
    device.service->root().objref("parts", [this](std::string_view) { return part; });
    return device.service;
  }

  /// The answer, once it is there.
  auto begin(HearingClient& client, rr::LockCommand command, const std::string& path) {
    rr::LockWanted wanted;
    wanted.id = ++last;
    wanted.command = command;
    wanted.path = path;
    wanted.timeout = 10s;
    const auto answer = std::make_shared<std::optional<rr::ErrorCode>>();
    bench.upstream->lock(client, wanted, [answer](const rr::Result<>& result) {
      *answer = result ? rr::ErrorCode::none : result.error().code;
    });
    return answer;
  }

  rr::ErrorCode ask(HearingClient& client, rr::LockCommand command, const std::string& path) {
    const auto answer = begin(client, command, path);
    REQUIRE(bench.run_until([&] { return answer->has_value(); }));
    return **answer;
  }
};

TEST_CASE("no lease is given above an object that another client has locked") {
  LockBench locks;
  CHECK(locks.ask(locks.first, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::none);
  CHECK(locks.ask(locks.second, rr::LockCommand::acquire_lease, "bench") == rr::ErrorCode::object_locked_error);
  CHECK(locks.ask(locks.first, rr::LockCommand::acquire_lease, "bench") == rr::ErrorCode::none);
}

TEST_CASE("who waits for a monitor gets none below a lease that its holder has taken meanwhile") {
  LockBench locks;
  auto& holder = locks.first;
  auto& waiter = locks.second;
  CHECK(locks.ask(holder, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::none);
  const auto waiting = locks.begin(waiter, rr::LockCommand::enter_monitor, "bench.parts[1]");
  CHECK(locks.ask(holder, rr::LockCommand::acquire_lease, "bench") == rr::ErrorCode::none);
  CHECK(locks.ask(holder, rr::LockCommand::exit_monitor, "bench.parts[1]") == rr::ErrorCode::none);
  REQUIRE(locks.bench.run_until([&] { return waiting->has_value(); }));
  CHECK(**waiting == rr::ErrorCode::object_locked_error);
  CHECK(locks.ask(waiter, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::object_locked_error);
  CHECK(locks.ask(holder, rr::LockCommand::release_lease, "bench") == rr::ErrorCode::none);
  CHECK(locks.ask(waiter, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::none);
}

TEST_CASE("reads are shared, but whoever reads behind a command hears what has come of it") {
  Counting device;
  UpstreamBench bench(device.service);
  auto config = bench.device->config();
  config.shares_reads = true;
  bench.device->become(config, bench.config);
  bench.open();
  HearingClient client(bench.upstream);
  HearingClient other(bench.upstream);
  const auto read = [&](HearingClient& by) { return bench.ask(by, rr::CallKind::property_get, "bench", "number"); };
  const auto first = read(client);
  const auto second = read(other);
  const auto written =
      bench.ask(client, rr::CallKind::property_set, "bench", "number", 0, {rr::Value(std::int32_t{2})});
  const auto third = read(client);
  const auto fourth = read(other);
  REQUIRE(bench.run_until([&] { return fourth->has_value() && third->has_value() && written->has_value(); }));
  const auto value_of = [](const auto& asked) { return asked->value()->template to<std::int32_t>().value(); };
  CHECK(value_of(first) == 1);
  CHECK(value_of(second) == 1);
  CHECK(value_of(third) == 2);
  CHECK(value_of(fourth) == 2);
  CHECK(device.reads == 2);
}

TEST_CASE("a client that is gone is not asked with all others, and the device has its answer") {
  Counting device;
  rr::ClientId session = 0;
  device.service->on_client_connected([&](rr::ClientId id) { session = id; });
  UpstreamBench bench(device.service);
  auto config = bench.device->config();
  config.callbacks = {{"bench.ask", CallbackPolicy::all}};
  bench.device->become(config, bench.config);
  bench.open();
  HearingClient first(bench.upstream);
  std::optional<HearingClient> second(std::in_place, bench.upstream);
  int asked = 0;
  second->on_callback = [&](const auto&) { ++asked; };
  first.on_callback = [&](const auto& answer) {
    second.reset();
    answer(rr::make_error(rr::ErrorCode::operation_failed, "not this one"));
  };
  std::optional<rr::Result<rr::Value>> heard;
  device.service->call_callback(session, "ask", {}, [&](rr::Result<rr::Value> answer) { heard = std::move(answer); });
  CHECK(bench.run_until([&] { return heard.has_value(); }));
  CHECK(asked == 0);
  CHECK((heard && !*heard));
}

TEST_CASE("a session that a client is about to use has its time without clients from then on") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.upstream->wake();
  bench.upstream->rest_unused(1s);
  bench.keep_open({10s, 20s, 10s});
  REQUIRE(bench.run_until([&] { return bench.upstream->is_open(); }));
  const auto end = std::chrono::steady_clock::now() + 1500ms;
  REQUIRE(bench.run_until([&] {
    bench.upstream->wake();
    return bench.upstream->is_resting() || std::chrono::steady_clock::now() > end;
  }));
  CHECK_FALSE(bench.upstream->is_resting());
  CHECK(bench.run_until([&] { return bench.upstream->is_resting(); }));
}

TEST_CASE("a session that is held does not rest until it is let go") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.upstream->hold(true);
  bench.upstream->rest_unused(20ms);
  bench.keep_open({10ms, 20ms, 10s});
  REQUIRE(bench.run_until([&] { return bench.upstream->is_open(); }));
  bool has_passed = false;
  boost::asio::steady_timer while_it_is_held(bench.io, 100ms);
  while_it_is_held.async_wait([&](const auto&) { has_passed = true; });
  REQUIRE(bench.run_until([&] { return has_passed; }));
  CHECK_FALSE(bench.upstream->is_resting());
  bench.upstream->hold(false);
  CHECK(bench.run_until([&] { return bench.upstream->is_resting(); }));
}
