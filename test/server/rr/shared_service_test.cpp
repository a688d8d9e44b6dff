// Objects of a shared service that are of another type once the device is back, or whose type is defined anew,
// whichever session had found them.
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

constexpr const char* box_definition = R"(service test.box
stdver 0.10
object Box
    objref varobject{int32} things
end
)";

/// It comes with the first lamp that is found in the box.
std::string lamp_definition(const std::string& type) {
  return "service test.lamp\nstdver 0.10\nobject Lamp\n    property " + type + " light\nend\n";
}

std::shared_ptr<rr::Service> box_of_lamps(const std::string& type) {
  const auto box = rr::Service::from_text({box_definition, lamp_definition(type)}, "box", "test.box.Box");
  box->root().objref(
      "things", [weak = std::weak_ptr(box)](std::string_view) { return weak.lock()->make_object("test.lamp.Lamp"); });
  return box;
}

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

TEST_CASE("a definition behind a varobject that the device has changed is offered as it is now") {
  const std::string lamp = "box.things[1]";
  UpstreamBench bench(box_of_lamps("int32"));
  auto config = bench.device->config();
  bench.config.retry = {10s, 10s, 10s};
  bench.device->become(config, bench.config);
  Offering board;
  const auto service = std::make_shared<SharedService>(bench.device, "box", std::vector<ServiceBoard*>{&board});
  service->start(0ms);
  REQUIRE(bench.run_until([&] { return service->hosted() != nullptr; }));
  const auto upstream = service->upstream();
  bool is_found = false;
  service->find_object(*upstream, lamp, [&](const rr::Result<>& found) { is_found = found.has_value(); });
  REQUIRE(bench.run_until([&] { return is_found; }));
  const auto text = [&] { return service->hosted()->types().find_service("test.lamp")->text; };
  REQUIRE_THAT(text(), Catch::Matchers::Contains("int32 light"));
  bench.replace_device(box_of_lamps("double"));
  REQUIRE(bench.run_until([&] { return !upstream->is_open(); }));
  REQUIRE(bench.wait_for(upstream->opened()).has_value());
  REQUIRE(bench.run_until([&] {
    const auto* known = upstream->types()->find_service("test.lamp");
    return known && known->text == lamp_definition("double");
  }));
  const auto is_new = [&] {
    const auto* offered = service->hosted()->types().find_service("test.lamp");
    return offered && offered->text == lamp_definition("double");
  };
  CHECK(bench.run_until(is_new));
  CHECK(upstream->is_open());
  service->stop();
}
