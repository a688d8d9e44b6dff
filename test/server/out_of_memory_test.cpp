// A gateway that gets no memory for one request: the request fails, the gateway goes on; and what takes memory only as
// long as it is used. It replaces operator new, so it is a program of its own.
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <nlohmann/json.hpp>

#include "server/upstream/service_locks.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/server/support/test_gateway.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

std::atomic<std::size_t> failing_from = SIZE_MAX;  ///< bytes that are not to be had
std::atomic<long> live = 0;                        ///< pieces of memory that are held

}  // namespace

void* operator new(std::size_t size) {
  void* memory = size < failing_from ? std::malloc(size == 0 ? 1 : size) : nullptr;
  if (!memory) throw std::bad_alloc();
  ++live;
  return memory;
}
void operator delete(void* memory) noexcept {
  if (memory) --live;
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  ::operator delete(memory);
}

namespace {

constexpr std::size_t items = 200'000;  // bytes at the device, 16 bytes each as JSON

struct Camera {
  rr::RunningNode node;
  Camera()
      : node([](rr::Node& made) {
          auto service = rr::Service::from_text({"service test.camera\nobject Camera\nproperty int8[] pixels "
                                                 "[readonly]\nproperty int32 one [readonly]\nend\n"},
                                                "Camera", "Camera");
          service->property("pixels").get([] { return std::vector<std::int8_t>(items, 1); });
          service->property("one").get([] { return 1; });
          made.add(service);
        }) {}
};

/// Asks for a property, and returns the answer.
nlohmann::json get(TestClient& client, int id, const std::string& property) {
  const auto request = nlohmann::json{{"id", id}, {"op", "get"}, {"path", property}}.dump();
  client.send_frame(1, rr::as_bytes(request));
  std::string answer;
  for (bool is_first = true;; is_first = false) {
    const auto frame = client.receive_frame();
    REQUIRE((frame.first & 0x0f) == (is_first ? 1 : 0));
    answer += rr::as_text(frame.payload);
    if (frame.first & 0x80) return nlohmann::json::parse(answer);
  }
}

}  // namespace

TEST_CASE(
    "a request of a JSON socket for which there is no memory is answered with an error, and leaves nothing behind") {
  Camera camera;
  TestGateway gateway(0, [&](Config& config) {
    DeviceConfig device;
    device.name = "camera";
    device.url = rr::parse_url(camera.node.url("Camera")).value();
    config.devices.push_back(device);
  });
  TestClient client(gateway.port());
  REQUIRE(client.upgrade("/api/v1/devices/camera/Camera", "Sec-WebSocket-Protocol: rrgate.json.v1\r\n").status == 101);
  int id = 0;
  REQUIRE(get(client, ++id, "one")["result"] == 1);
  failing_from = items * 8;
  for (int i = 0; i < 100; ++i) {  // more than may be unanswered at a time
    const auto answer = get(client, ++id, "pixels");
    REQUIRE(answer["id"] == id);
    REQUIRE(answer["error"]["message"] == "the gateway could not do it");
  }
  failing_from = SIZE_MAX;
  CHECK(get(client, ++id, "one")["result"] == 1);
}

TEST_CASE("services that clients have named, or a device has offered, and nobody uses any more take no memory") {
  boost::asio::io_context io;
  const Config config;
  const auto device = std::make_shared<Device>(io.get_executor(), DeviceConfig{}, config);
  device->locks_of("the first");
  device->share("the first", {});
  const auto before = live.load();
  for (int i = 0; i < 1000; ++i) {
    const auto name = "service" + std::to_string(i);
    device->locks_of(name);
    device->share(name, {});
  }
  CHECK(live.load() - before < 100);
}
