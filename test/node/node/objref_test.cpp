// Objects behind objrefs: the root behind one of them, others in their place, those of other services.
#include <catch2/catch.hpp>

#include "node/service/node.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;

namespace {

constexpr const char* definition = R"(service test.crew
stdver 0.10

object Arm
    objref Robot owner
    property int32 number
end

object Robot
    wire int32 pose [readonly]
    event moved(int32 pose)
    callback double ask(string question)
    objref Arm arm
    objref Arm{int32} arms
    function void move(int32 pose)
end
)";

struct Robot {
  explicit Robot(Node& node) {
    service->function("move", [this](std::int32_t pose) {
      service->set_wire("pose", pose);
      service->fire("moved", pose);
    });
    service->objref("arm", [this] { return arm; });
    service->objref("arms", [this](std::string_view) { return arm; });
    arm = make_arm(1);
    node.add(service);
  }
  std::shared_ptr<Object> make_arm(std::int32_t number) {
    auto made = service->make_object("Arm");
    made->property("number").get([number] { return number; }).set([](std::int32_t) {});
    made->objref("owner", [this] { return service->root().shared_from_this(); });
    return made;
  }

  std::shared_ptr<Service> service = Service::from_text({definition}, "crew", "Robot");
  std::shared_ptr<Object> arm;
};

struct RobotNode {
  std::unique_ptr<Robot> robot;
  RunningNode node{[this](Node& made) { robot = std::make_unique<Robot>(made); }};
  RemoteObject connect() { return rr::connect(node.url("crew")); }
};

}  // namespace

TEST_CASE("a root that is found by an objref, too, sends its wires and events by both paths") {
  RobotNode device;
  const auto robot = device.connect();
  const auto owner = robot.object("arm").object("owner");
  std::vector<Value> poses, moves, moves_of_root;
  owner.connect_wire("pose", [&](const Value& value, TimeSpec) { poses.push_back(value); });
  owner.on_event("moved", [&](std::span<const Value> values) { moves.push_back(values[0]); });
  robot.on_event("moved", [&](std::span<const Value> values) { moves_of_root.push_back(values[0]); });
  robot.call("move", 5);
  owner.call("move", 6);
  REQUIRE(robot.connection().run_until([&] { return poses.size() == 2 && moves.size() == 2; }, 5s));
  CHECK(poses == std::vector<Value>{Value(5), Value(6)});
  CHECK(moves == std::vector<Value>{Value(5), Value(6)});
  CHECK(moves_of_root == moves);
}

TEST_CASE("clients look up again what release() names, and what a new function finds") {
  RobotNode device;
  const auto robot = device.connect();
  const auto arm = robot.object("arm");
  const auto third = robot.object("arms", "3");
  CHECK(arm.get("number") == Value(1));
  const auto change = [&](const auto& how) {
    device.node.ask([&](Node&) {
      auto& service = *device.robot->service;
      how(*device.robot, service);
      return 0;
    });
    robot.call("move", 0);  // behind the release
  };
  change([](Robot& made, Service& service) {
    made.arm = made.make_arm(2);
    service.root().release("arm");
  });
  CHECK(error_of([&] { arm.get("number"); }).code == ErrorCode::object_not_found);
  CHECK(robot.object("arm").get("number") == Value(2));
  CHECK(third.get("number") == Value(1));
  change([](Robot&, Service& service) { service.root().release("arms", "3"); });
  CHECK(robot.object("arms", "3").get("number") == Value(2));
  change([](Robot& made, Service& service) { service.objref("arm", [other = made.make_arm(4)] { return other; }); });
  CHECK(robot.object("arm").get("number") == Value(4));
  change([](Robot&, Service& service) {
    CHECK_THROWS_WITH(service.root().release("arms"), Catch::Contains("release() takes an index"));
    CHECK_THROWS_WITH(service.root().release("arm", "1"), Catch::Contains("has no index"));
  });
}

TEST_CASE("a function that finds objects keeps what it has; so do those that hear of clients") {
  RobotNode device;
  std::vector<int> came, went;
  device.node.ask([&](Node&) {
    auto& robot = *device.robot;
    robot.service->objref("arms", [&robot, n = 0](std::string_view) mutable { return robot.make_arm(++n); });
    robot.service->on_client_connected([&came, n = 0](ClientId) mutable { came.push_back(++n); });
    robot.service->on_client_gone([&went, n = 0](ClientId) mutable { went.push_back(++n); });
    return 0;
  });
  for (int round = 0; round < 2; ++round) {
    const auto robot = device.connect();
    CHECK(robot.object("arms", std::to_string(2 * round)).get("number") == Value(2 * round + 1));
    CHECK(robot.object("arms", std::to_string(2 * round + 1)).get("number") == Value(2 * round + 2));
  }  // says goodbye, and waits for the answer
  CHECK(device.node.ask([&](Node&) { return came; }) == std::vector{1, 2});
  CHECK(device.node.ask([&](Node&) { return went; }) == std::vector{1, 2});
}

TEST_CASE("an object of another service is no object of this one") {
  RobotNode device;
  auto other = Service::from_text({definition}, "other", "Robot");
  device.node.ask([&](Node&) {
    device.robot->arm = other->make_object("Arm");
    return 0;
  });
  const auto refused = error_of([robot = device.connect()] { robot.object("arm"); });
  CHECK(refused.code == ErrorCode::internal_error);
  CHECK_THAT(refused.message, Catch::Contains("another service, 'other'"));
}
