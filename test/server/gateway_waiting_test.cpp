// A handler of a device that takes its time, behind the gateway: it delays nobody but who has called it.
#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"
#include "test/server/support/test_gateway.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

struct SlowDevice {
  std::promise<void> entered;
  std::promise<void> released;
  std::shared_future<void> release = released.get_future();
  rr::RunningNode node;

  SlowDevice()
      : node([this](rr::Node& made) {
          auto service = rr::Service::from_text({"service test.slow\nobject Slow\nfunction int32 block(int32 "
                                                 "number)\nfunction int32 quick(int32 number)\n"
                                                 "property int32 level [readonly]\nend\n"},
                                                "Slow", "Slow");
          service->function("block", rr::blocking([this](std::int32_t number) {
                              entered.set_value();
                              release.wait();
                              return number;
                            }));
          service->function("quick", [](std::int32_t number) { return number; });
          service->property("level").get([] { return 3; });
          made.add(service);
        }) {}
};

}  // namespace

TEST_CASE("a handler that blocks delays no other client behind the gateway, relayed or shared") {
  const auto mode = GENERATE(DeviceMode::relay, DeviceMode::shared);
  SlowDevice device;
  TestGateway gateway(0, [&](Config& config) {
    DeviceConfig slow;
    slow.name = "slow";
    slow.url = rr::parse_url(device.node.url("Slow")).value();
    slow.mode = mode;
    config.devices.push_back(slow);
  });
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
