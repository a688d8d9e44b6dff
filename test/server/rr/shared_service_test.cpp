// Objects of a shared service that are of another type once the device is back, whichever session had found them.
#include "server/rr/shared_service.hpp"

#include "test/server/upstream/upstream_bench.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

constexpr const char* definition = R"(service test.shelf
stdver 0.10
object Lamp
    property int32 light
end
object Shelf
    objref varobject{int32} things
end
)";

const std::string path = "shelf.things[1]";

/// A node that offers everything and judges nobody.
class Offering final : public ServiceBoard {
 public:
  std::shared_ptr<const rr::Authenticator> authenticator() const override { return nullptr; }
  void publish(const std::shared_ptr<rr::HostedService>&, SharedService&) override {}
  void withdraw(const rr::HostedService&) override {}
};

/// A shared service, and a client with a login whose session has found an object of it.
struct Shelf {
  std::shared_ptr<rr::Service> device = rr::Service::from_text({definition}, "shelf", "Shelf");
  std::string type = "Lamp";
  Offering board;
  UpstreamBench bench;
  std::shared_ptr<SharedService> service;
  std::shared_ptr<Upstream> own;

  Shelf() : bench(prepared()) {
    auto config = bench.device->config();
    bench.config.retry = {10s, 10s, 10s};
    bench.device->become(config, bench.config);
    service = std::make_shared<SharedService>(bench.device, "shelf", std::vector<ServiceBoard*>{&board});
    service->start(0ms);
    REQUIRE(bench.run_until([&] { return service->hosted() != nullptr; }));
    own = service->make_own_upstream({});
    REQUIRE(bench.wait_for(own->open()).has_value());
    std::optional<bool> found;
    service->find_object(*own, path, [&](const rr::Result<>& result) { found = result.has_value(); });
    REQUIRE(bench.run_until([&] { return found.has_value(); }));
    REQUIRE(*found);
    REQUIRE(service->hosted()->has_object(path));
  }
  ~Shelf() {
    own->close();
    service->stop();
  }
  Shelf(const Shelf&) = delete;
  Shelf& operator=(const Shelf&) = delete;

  std::shared_ptr<rr::Service> prepared() {
    device->root().objref("things", [this](std::string_view) { return device->make_object(type); });
    return device;
  }
  /// The device is lost to both sessions, and comes back with a shelf in the place of the lamp.
  void replace() {
    for (const auto& upstream : {own, service->upstream()}) {
      upstream->break_off();
      REQUIRE(bench.run_until([&] { return !upstream->is_open(); }));
    }
    type = "Shelf";
    device->root().release("things", "1");
  }
};

}  // namespace

TEST_CASE(
    "an object that a session of one client had found is not offered as what it was, though the client has left") {
  Shelf shelf;
  shelf.replace();
  shelf.own->close();
  CHECK(shelf.service->hosted()->has_object(path));
  REQUIRE(shelf.bench.wait_for(shelf.service->upstream()->opened()).has_value());
  CHECK(shelf.bench.run_until([&] { return !shelf.service->hosted()->has_object(path); }));
}

TEST_CASE("an object that a session of one client finds to be another one is not offered as what it was") {
  Shelf shelf;
  shelf.replace();
  REQUIRE(shelf.bench.wait_for(shelf.own->open()).has_value());
  CHECK(shelf.bench.run_until([&] { return !shelf.service->hosted()->has_object(path); }));
  CHECK_FALSE(shelf.service->upstream()->is_open());
}
