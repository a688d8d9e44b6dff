// A service of a class that was generated in compat mode: the paper's definition, as it was printed.
#include <catch2/catch.hpp>

#include "experimental__create.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;
using namespace experimental::create;

namespace {

class Robot : public CreateService {
 public:
  void Drive(std::int16_t velocity, std::int16_t radius) override {
    distance_ = velocity + radius;
    Bump();
  }
  void StartStreaming() override {}
  void StopStreaming() override {}
  std::int32_t get_DistanceTraveled() override { return distance_; }
  void set_DistanceTraveled(std::int32_t value) override { distance_ = value; }
  std::int32_t get_AngleTraveled() override { return 0; }
  void set_AngleTraveled(std::int32_t) override {}
  std::uint8_t get_Bumpers() override { return 0; }
  void set_Bumpers(std::uint8_t) override {}

 private:
  std::int32_t distance_ = 0;
};

}  // namespace

TEST_CASE("generated in compat mode: the service is used by a client of the same definition") {
  RunningNode node([](Node& owner) { owner.add(make_service("create", std::make_shared<Robot>())); });
  const CreateClient client(connect(node.url("create")));
  int bumps = 0;
  client.Bump().on([&] { ++bumps; });
  client.Drive(Create::SPIN_COUNTERCLOCKWISE, 41);
  CHECK(client.DistanceTraveled().get() == 42);
  CHECK(client.rr_object.connection().run_until([&] { return bumps == 1; }, 5s));
}
