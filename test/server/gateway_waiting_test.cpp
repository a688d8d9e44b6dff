// A handler of a device that takes its time, behind the gateway: it delays nobody but who has called it.
#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/sandbox.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

struct SlowDevice {
  std::promise<void> entered;
  std::promise<void> released;
  std::atomic<std::int32_t> reads = 0;
  std::shared_future<void> release = released.get_future();
  rr::RunningNode node;

  SlowDevice()
      : node([this](rr::Node& made) {
          auto service = rr::Service::from_text({"service test.slow\nobject Slow\nfunction int32 block(int32 "
                                                 "number)\nfunction int32 quick(int32 number)\n"
                                                 "property int32 level [readonly]\n"
                                                 "property int32 slow_level [readonly]\nend\n"},
                                                "Slow", "Slow");
          service->function("block", rr::blocking([this](std::int32_t number) {
                              entered.set_value();
                              release.wait();
                              return number;
                            }));
          service->function("quick", [](std::int32_t number) { return number; });
          service->property("level").get([] { return 3; });
          service->property("slow_level").get(rr::blocking([this] {
            const auto number = ++reads;
            release.wait();
            return number;
          }));
          made.add(service);
        }) {}

  std::function<void(Config&)> behind(DeviceMode mode, bool shares_reads = false) {
    return [this, mode, shares_reads](Config& config) {
      DeviceConfig slow;
      slow.name = "slow";
      slow.url = rr::parse_url(node.url("Slow")).value();
      slow.mode = mode;
      slow.shares_reads = shares_reads;
      config.devices.push_back(slow);
    };
  }
};

}  // namespace

TEST_CASE("a handler that blocks delays no other client behind the gateway, relayed or shared") {
  const auto mode = GENERATE(DeviceMode::relay, DeviceMode::shared);
  SlowDevice device;
  TestGateway gateway(0, device.behind(mode));
  const auto url = "rr+ws://127.0.0.1:" + std::to_string(gateway.port()) + "/devices/slow?service=Slow";
  const auto one = rr::connect(url);
  const auto two = rr::connect(url);
  std::optional<rr::Result<rr::Value>> answer;
  const std::array<rr::Value, 1> number{rr::Value(7)};
  one.connection().asynchronous().call("Slow", "block", number,
                                       [&](rr::Result<rr::Value> result) { answer = std::move(result); });
  const auto entered = device.entered.get_future();
  const bool has_entered =
      one.connection().run_until([&] { return entered.wait_for(0s) == std::future_status::ready; }, 10s);
  if (has_entered) {
    for (std::int32_t i = 0; i < 100; ++i) CHECK(two.call("quick", i) == rr::Value(i));
    CHECK(one.call("quick", 1) == rr::Value(1));
    CHECK(gateway.wait_for("/api/v1/devices/slow/Slow/level", [](const auto&) { return true; }) == 3);
    CHECK_FALSE(answer);
  }
  device.released.set_value();
  REQUIRE(has_entered);
  REQUIRE(one.connection().run_until([&] { return answer.has_value(); }, 10s));
  CHECK(answer->value() == rr::Value(7));
}

TEST_CASE("clients of a shared device that read a property at once are one read to it, where that is wanted") {
  const bool shares_reads = GENERATE(true, false);
  SlowDevice device;
  TestGateway gateway(0, device.behind(DeviceMode::shared, shares_reads));
  const auto url = "rr+tcp://127.0.0.1:" + std::to_string(gateway.port()) + "/?service=Slow";
  std::vector<rr::RemoteObject> clients;
  std::vector<std::int32_t> values;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(rr::connect(url));
    clients.back().connection().asynchronous().get("Slow", "slow_level", [&](const rr::Result<rr::Value>& value) {
      values.push_back(value ? value->to<std::int32_t>().value() : 0);
    });
    CHECK(clients.back().call("quick", i) == rr::Value(i));  // the read is on its way before it
  }
  device.released.set_value();
  for (auto& client : clients)
    client.connection().run_until([&, before = values.size()] { return values.size() > before; }, 10s);
  std::sort(values.begin(), values.end());
  CHECK(values == (shares_reads ? std::vector{1, 1, 1} : std::vector{1, 2, 3}));
  CHECK(clients.front().get("slow_level") == rr::Value(shares_reads ? 2 : 4));  // the next one is asked for anew
}

TEST_CASE("a request that was at work when its sign-in ended is answered, and gives no cookie back") {
  const rr::Sandbox folders;
  SlowDevice device;
  const Folder files;
  const std::string key = "a key of thirty-two bytes or more";
  const auto token = make_api_token();
  TestGateway gateway(0, [&](Config& config) {
    device.behind(DeviceMode::shared)(config);
    config.access.tokens_file = files.write("tokens", "ci " + hash_api_token(token) + " admin _\n");
    config.access.ticket_key_file = files.write("key", key);
  });
  gateway.wait_for("/readyz", [](const auto& ready) { return ready["devices_online"] == 1; });
  Identity who;
  who.name = "ci";
  who.roles = who.proven_roles = {"admin"};
  who.proof = Proof::token;
  who.credential = hash_api_token(token);
  const auto long_ago = std::chrono::system_clock::now() - SignIns::lifetime / 2 - 1min;
  const auto cookie = SignIns(rr::Bytes(key.begin(), key.end())).begin(who, long_ago).value();
  const auto lines = " HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\nCookie: rrgate=" + cookie + "\r\n";
  TestClient slow(gateway.port());
  slow.send("POST /api/v1/devices/slow/Slow/block" + lines +
            "Content-Type: application/json\r\nContent-Length: 13\r\n\r\n{\"number\": 7}");
  const bool has_entered = device.entered.get_future().wait_for(10s) == std::future_status::ready;
  TestClient other(gateway.port());
  other.send("DELETE /api/v1/session" + lines + "\r\n");
  CHECK(other.receive_response(false).status == 204);
  device.released.set_value();
  REQUIRE(has_entered);
  const auto answer = slow.receive_response();
  CHECK(answer.status == 200);
  CHECK_THAT(answer.head, !Catch::Contains("Set-Cookie"));
}
