// Listeners of values: what they hear while a member of the device is joined, and when it ends.
#include "server/upstream/value_clients.hpp"

#include <boost/asio/ip/tcp.hpp>

#include "test/server/upstream/upstream_bench.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

constexpr const char* definition = R"(service test.rack
stdver 0.10
object Part
    pipe int32 news [readonly]
    wire int32 level [readonly]
end
object Rack
    objref Part{int32} parts
end
)";

const std::string part = "rack.parts[1]";

/// The same with other types.
constexpr const char* newer_definition = R"(service test.rack
stdver 0.10
object Part
    pipe double news [readonly]
    wire double level [readonly]
end
object Rack
    objref Part{int32} parts
end
)";

struct Rack {
  std::shared_ptr<rr::Service> service = rr::Service::from_text({definition}, "rack", "Rack");
  std::shared_ptr<rr::Object> newest_part;
  UpstreamBench bench;
  std::shared_ptr<ValueClient> client;
  std::vector<std::string> heard;
  std::vector<double> values;

  Rack() : bench(prepared()) {
    bench.open();
    REQUIRE(bench.find(part).has_value());
    client = std::make_shared<ValueClient>(bench.upstream, Subject(), Device::Seat(*bench.device),
                                           MemoryBudget(1'000'000).charge(""));
  }
  std::shared_ptr<rr::Service> prepared() {
    service->objref("parts", [this](std::string_view) { return newest_part = service->make_object("Part"); });
    return service;
  }
  /// The device restarts with the newer definition.
  void redefine() {
    service = rr::Service::from_text({newer_definition}, "rack", "Rack");
    bench.replace_device(prepared());
    bench.open();
  }
  auto listen(const std::string& member) {
    const auto types = bench.upstream->types();
    MemberPlace place{part, types->find_entity("test.rack.Part")->find_member(member), types};
    return bench.begin(client->listen(std::move(place), 0, [this](const SamplePtr& sample, const rr::Error* error) {
      heard.push_back(sample ? "value" : error ? error->message : "back");
      if (sample) values.push_back(sample->values.front().to<double>().value());
    }));
  }
};

}  // namespace

TEST_CASE("joining a member of an object that the device replaces meanwhile fails, and can be tried again") {
  const std::string member = GENERATE("news", "level");
  Rack rack;
  const auto first = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return rack.client->is_used(); }));
  REQUIRE_FALSE(first->has_value());
  rack.service->root().release("parts", "1");  // before it hears of the request
  REQUIRE(rack.bench.run_until([&] { return first->has_value(); }));
  REQUIRE_FALSE((**first).has_value());
  CHECK_FALSE((*first)->error().message.empty());
  CHECK_FALSE(rack.client->is_used());
  REQUIRE(rack.bench.find(part).has_value());
  const auto second = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return second->has_value(); }));
  CHECK((**second).has_value());
}

TEST_CASE("a member that the device closes is told to its listeners, and joined again by the next one") {
  const std::string member = GENERATE("news", "level");
  Rack rack;
  const auto first = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return first->has_value(); }));
  REQUIRE((**first).has_value());
  rack.service->root().release("parts", "1");
  REQUIRE(rack.bench.run_until([&] { return !rack.heard.empty(); }));
  CHECK(rack.heard.size() == 1);
  REQUIRE(rack.bench.find(part).has_value());
  const auto second = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return second->has_value(); }));
  CHECK((**second).has_value());
}

TEST_CASE("a wire's value of before an outage is given to nobody who comes in it") {
  Rack rack;
  const auto first = rack.listen("level");
  REQUIRE(rack.bench.run_until([&] { return first->has_value(); }));
  rack.newest_part->set_wire("level", 5);
  REQUIRE(rack.bench.run_until([&] { return !rack.heard.empty(); }));
  rack.bench.upstream->connection()->close(rr::make_error(rr::ErrorCode::connection_error, "the line was cut"));
  REQUIRE(rack.bench.run_until([&] { return rack.heard.size() == 2; }));
  const auto second = rack.listen("level");
  REQUIRE(rack.bench.run_until([&] { return second->has_value(); }));
  CHECK(rack.heard == std::vector<std::string>{"value", "connection_lost: device 'device': the line was cut"});
}

TEST_CASE("who joins a member that the device defines anew has the new definition, and those of before are let go") {
  const std::string member = GENERATE("news", "level");
  Rack rack;
  auto first = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return first->has_value(); }));
  const std::weak_ptr<const rr::TypeRegistry> before = rack.bench.upstream->types();
  rack.redefine();
  REQUIRE(rack.bench.upstream->types() != before.lock());
  REQUIRE(rack.bench.find(part).has_value());
  const auto second = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return second->has_value(); }));
  REQUIRE((**second).has_value());
  CHECK(before.expired());
  first->reset();
  if (member == "level")
    rack.newest_part->set_wire("level", 2.5);
  else
    rack.newest_part->pipe("news").broadcast(2.5);
  REQUIRE(rack.bench.run_until([&] { return !rack.values.empty(); }));
  CHECK(rack.values.back() == 2.5);
}

TEST_CASE("a client that leaves while it joins a member waits no longer, and joins nothing any more") {
  const std::string member = GENERATE("news", "level");
  Rack rack;
  const auto first = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return rack.client->is_used(); }));
  rack.client->leave();
  REQUIRE(rack.bench.run_until([&] { return first->has_value(); }));
  REQUIRE_FALSE((**first).has_value());
  CHECK((*first)->error().code == rr::ErrorCode::operation_cancelled);
  CHECK_FALSE(rack.bench.upstream->has_clients());
  const auto second = rack.listen(member);
  REQUIRE(rack.bench.run_until([&] { return second->has_value(); }));
  REQUIRE_FALSE((**second).has_value());
  CHECK((*second)->error().code == rr::ErrorCode::operation_cancelled);
}

TEST_CASE("a login that is judged for a device that has been replaced is given up") {
  Rack rack;
  auto& bench = rack.bench;
  boost::asio::ip::tcp::acceptor silent(bench.io, {boost::asio::ip::address_v4::loopback(), 0});
  auto config = bench.device->config();
  config.url =
      rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(silent.local_endpoint().port()) + "/?service=rack").value();
  const auto before = std::make_shared<Device>(bench.io.get_executor(), config, bench.config);
  ValueClients clients(bench.io.get_executor(), MemoryBudget(1'000'000).charge(""));
  const SessionKey key{"rack", "alice", "secret"};
  const auto first = bench.begin(clients.open(before, key));
  const auto begin = std::chrono::steady_clock::now();
  const auto second = bench.begin(clients.open(bench.device, key));
  REQUIRE(bench.run_until([&] { return first->has_value(); }));
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(2));
  CHECK_FALSE((**first).has_value());
  clients.stop();
  before->stop();
  silent.close();
  CHECK(bench.run_until([&] { return second->has_value(); }));
}

TEST_CASE("what somebody listens by is idle only from when nobody does") {
  Rack rack;
  auto& bench = rack.bench;
  auto config = bench.device->config();
  config.mode = DeviceMode::relay;
  const auto device = std::make_shared<Device>(bench.io.get_executor(), config, bench.config);
  constexpr std::chrono::milliseconds idle_time(600);
  ValueClients clients(bench.io.get_executor(), MemoryBudget(1'000'000).charge(""), idle_time);
  const SessionKey key{"rack"};
  auto used = bench.wait_for(clients.open(device, key)).value();
  const std::weak_ptr<ValueClient> same = used;
  const auto wait = [&](std::chrono::milliseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    (void)bench.run_until([&] { return std::chrono::steady_clock::now() >= end; });
  };
  wait(idle_time * 3 / 2);
  used.reset();
  wait(idle_time / 2);
  CHECK(same.lock() == bench.wait_for(clients.open(device, key)).value());
  REQUIRE(bench.run_until([&] { return same.expired(); }));
  clients.stop();
  device->stop();
}
