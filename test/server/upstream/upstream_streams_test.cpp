// Wires of a session with a device that many clients share.
#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

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

TEST_CASE("a device is held back on a pipe by whoever is behind, as soon as it joins, and no packet asks for that") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  const auto& pipe = *bench.upstream->object_type("bench")->find_member("news");
  const auto has_heard = [&](const HearingClient& client, std::size_t count) {
    return bench.run_until([&] { return client.heard.size() == count; });
  };
  // An endpoint takes no packet while the one before it is not acknowledged.
  const auto send = [&] { return device.service->pipe("news").broadcast(rr::Value(1), 0) == 1; };
  // Acknowledgements that are not held are with the device when it has answered.
  const auto read = [&](HearingClient& client) {
    const auto answer = bench.ask(client, rr::CallKind::property_get, "bench", "number");
    REQUIRE(bench.run_until([&] { return answer->has_value(); }));
  };
  HearingClient first(bench.upstream);
  bench.upstream->join_pipe(first, 1, "bench", pipe);
  REQUIRE(has_heard(first, 1));
  first.times_asked = 0;
  REQUIRE(send());
  REQUIRE(has_heard(first, 2));
  CHECK(first.times_asked == 0);
  HearingClient second(bench.upstream);
  second.reads_slowly = true;
  bench.upstream->join_pipe(second, 1, "bench", pipe);
  read(first);
  REQUIRE(send());
  REQUIRE(has_heard(second, 2));
  read(first);
  CHECK_FALSE(send());
  second.reads_slowly = false;
  bench.upstream->pace(second);
  bool is_sent = false;
  CHECK(bench.run_until([&] { return is_sent = is_sent || send(); }));
}

TEST_CASE("the clocks are read once for an event or a packet, however many clients hear of it") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  std::vector<std::unique_ptr<HearingClient>> clients;
  for (int i = 0; i < 20; ++i) {
    auto& client = *clients.emplace_back(std::make_unique<HearingClient>(bench.upstream));
    bench.upstream->join_pipe(client, 1, "bench", *bench.upstream->object_type("bench")->find_member("news"));
  }
  REQUIRE(bench.run_until([&] { return clients.back()->heard.size() == 1; }));
  device.service->fire("struck", 1);
  device.service->pipe("news").broadcast(rr::Value(1));
  REQUIRE(bench.run_until([&] { return clients.back()->told_at.size() == 2; }));
  for (const auto& client : clients) CHECK(client->told_at == clients.front()->told_at);
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
