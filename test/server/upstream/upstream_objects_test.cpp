// Objects of a device: how they are found, and what becomes of them after an outage.
#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

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
