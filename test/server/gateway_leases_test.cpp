// Leases over HTTP: who may give one back, and when, and who loses one.
#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

/// A shared device with leases, and three tokens: "ann" and "olga" may do all, "vera" may read.
struct LeasedRobot {
  Rates rates = {};
  rr::RunningNode node{[](rr::Node& made) {
    const auto service =
        rr::Service::from_text({"service test.leased\nobject Robot\nproperty double speed\nend\n"}, "Robot", "Robot");
    service->property("speed").get([] { return 0.0; }).set([](double) {});
    made.add(service);
  }};
  Folder files;
  std::string ann = make_api_token();
  std::string olga = make_api_token();
  std::string vera = make_api_token();
  TestGateway gateway{0, [this](Config& config) {
                        DeviceConfig robot;
                        robot.name = "robot";
                        robot.url = rr::parse_url(node.url("Robot")).value();
                        robot.mode = DeviceMode::shared;
                        robot.leases.is_offered = true;
                        robot.leases.safe = {{SafeAction::Kind::property, "Robot", "speed", "0"}};
                        robot.leases.takeover = {"*"};
                        config.devices.push_back(robot);
                        config.rates = rates;
                        config.access.tokens_file = files.write("tokens", tokens("operator"));
                        const std::vector<Verb> all{std::begin(all_verbs), std::end(all_verbs)};
                        config.access.rules = {{.roles = {"operator"}, .may = all},
                                               {.roles = {"viewer"}, .may = {Verb::read, Verb::write}},
                                               {.roles = {"keeper"}, .may = {Verb::read, Verb::lock}}};
                      }};

  std::string tokens(const std::string& role_of_ann) const {
    return "ann " + hash_api_token(ann) + " " + role_of_ann + " _\nolga " + hash_api_token(olga) +
           " operator _\nvera " + hash_api_token(vera) + " viewer _\n";
  }
  static std::string request(const std::string& first, const std::string& token, const std::string& lease = {},
                             const std::string& body = {}) {
    const auto shown = lease.empty() ? std::string() : "Rrgate-Lease: " + lease + "\r\n";
    return first + " HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer " + token + "\r\n" + shown +
           "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
  }
  TestClient::HttpResponse ask(const std::string& first, const std::string& token, const std::string& lease = {},
                               const std::string& body = {}) const {
    TestClient client(gateway.port());
    client.send(request(first, token, lease, body));
    return client.receive_response();
  }
  unsigned set_speed(const std::string& token) const {
    return ask("PUT /api/v1/devices/robot/Robot/speed", token, {}, "1").status;
  }
  unsigned end_lease(const std::string& token, const std::string& lease) const {
    return ask("POST /api/v1/devices/robot/Robot?lease=release", token, lease).status;
  }
  std::string lease(const std::string& token) const {
    std::string key;
    REQUIRE(comes_to([&] {
      const auto answer = ask("POST /api/v1/devices/robot/Robot?lease=acquire&deadman=60000", token);
      if (answer.status == 200) key = nlohmann::json::parse(answer.body)["lease"];
      return !key.empty();
    }));
    return key;
  }
  static bool comes_to(const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + 10s;
    while (!is_so())
      if (std::chrono::steady_clock::now() > end) return false;
    return true;
  }
};

}  // namespace

TEST_CASE("who loses the right to it loses the lease that he has taken over HTTP") {
  LeasedRobot robot;
  robot.lease(robot.ann);
  CHECK(robot.set_speed(robot.olga) == 423);
  robot.files.write("tokens", robot.tokens("viewer"));
  CHECK(LeasedRobot::comes_to([&] { return robot.set_speed(robot.olga) == 204; }));
}

TEST_CASE("who has the key of a lease may release it, whatever rights he has left") {
  LeasedRobot robot;
  const auto key = robot.lease(robot.ann);
  CHECK(robot.end_lease(robot.vera, {}) == 403);
  CHECK(robot.end_lease(robot.vera, "another") == 403);
  CHECK(robot.set_speed(robot.vera) == 423);
  CHECK(robot.end_lease(robot.vera, key) == 204);
  CHECK(robot.set_speed(robot.vera) == 204);
  CHECK(robot.end_lease(robot.vera, key) == 403);
}

TEST_CASE("a lease is given back however much was asked for") {
  static constexpr RateLimit few{.per_second = 5};
  const auto rates = GENERATE(Rates{.client = few}, Rates{.user = few}, Rates{.device = few});
  const LeasedRobot robot{rates};
  const auto key = robot.lease(robot.ann);
  const auto is_too_much = [&](const std::string& first, const std::string& lease) {
    return LeasedRobot::comes_to([&] { return robot.ask(first, robot.ann, lease).status == 429; });
  };
  const std::string service = "/api/v1/devices/robot/Robot";
  CHECK(is_too_much("POST " + service + "?lease=renew", key));
  CHECK(is_too_much("POST " + service + "/speed?lease=release", key));  // of something else
  CHECK(is_too_much("POST " + service + "?lease=release", "another"));
  CHECK(robot.end_lease(robot.ann, key) == 204);
  CHECK(is_too_much("POST " + service + "?lease=release", key));  // it is over
}

TEST_CASE("a lease that makes the device safe is taken, and given back, however much was asked for") {
  static constexpr RateLimit few{.per_second = 5};
  const auto rates = GENERATE(Rates{.client = few}, Rates{.user = few}, Rates{.device = few});
  const LeasedRobot robot{rates};
  robot.lease(robot.olga);
  const std::string object = "POST /api/v1/devices/robot/Robot";
  const auto use_up = [&](const std::string& first) {
    return LeasedRobot::comes_to([&] { return robot.ask(first, robot.ann).status == 429; });
  };
  CHECK(use_up(object + "?lease=renew"));
  const auto taken = robot.ask(object + "?lease=take&deadman=1000", robot.ann);
  REQUIRE(taken.status == 200);
  CHECK(robot.end_lease(robot.ann, nlohmann::json::parse(taken.body)["lease"]) == 204);
  CHECK(use_up(object + "/speed?lease=take&deadman=1000"));  // of something else
  if (!rates.device.is_bound())
    CHECK(LeasedRobot::comes_to([&] {  // who may lock nothing
      return robot.ask(object + "?lease=take&deadman=1000", robot.vera).status == 429;
    }));
}

TEST_CASE("a lease ends when its holder may not command any more, though he may lock") {
  LeasedRobot robot;
  robot.lease(robot.ann);
  CHECK(robot.set_speed(robot.olga) == 423);
  robot.files.write("tokens", robot.tokens("keeper"));
  CHECK(LeasedRobot::comes_to([&] { return robot.set_speed(robot.olga) == 204; }));
}
