// Agents of a device that answers: what they may read, what becomes of long answers, and stops where no memory is left.
#include <catch2/catch.hpp>

#include "server/access/api_tokens.hpp"
#include "server/json/json.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

constexpr const char* definition = R"(service test.agents
stdver 0.10
struct Image
  field uint32 width
  field uint32 height
  field string encoding
  field uint8[] data
end
object Robot
  property double speed
  function void halt(double[] how)
  function string say(uint32 count)
  function string{generator} talk(uint32 count)
  function Image look()
  memory uint8[] store
end
)";

std::string text_of(std::uint32_t count) {
  return std::string(count, 'x');
}

bool comes_to(const std::function<bool()>& is_so) {
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (!is_so())
    if (std::chrono::steady_clock::now() > end) return false;
  return true;
}

/// A shared device, an agent that may write its memory and call what answers at length, and a person who may do all.
struct AgentsRobot {
  rr::RunningNode node{[](rr::Node& into) {
    const auto service = rr::Service::from_text({definition}, "Robot", "Robot");
    service->property("speed").get([] { return 0.0; }).set([](double) {});
    service->function("halt", [](const std::vector<double>&) {});
    service->function("say", text_of);
    service->generator(
        "talk", [](std::uint32_t count) { return [count]() -> std::optional<std::string> { return text_of(count); }; });
    service->function("look", [] {
      return rr::Value(rr::Structure{"test.agents.Image",
                                     {{"width", std::uint32_t{1000}},
                                      {"height", std::uint32_t{1000}},
                                      {"encoding", "mono8"},
                                      {"data", rr::Value(std::vector<std::uint8_t>{7})}}});
    });
    const auto store = std::make_shared<rr::NumberMemory<std::uint8_t>>();
    store->dimensions = {2};
    store->items = {1, 2};
    service->memory("store", store);
    into.add(service);
  }};
  Folder files;
  std::string agent = make_api_token();
  std::string person = make_api_token();
  TestGateway gateway{
      0, [this](Config& config) {
        config.mcp.is_enabled = true;
        config.limits.memory = 1'000'000;
        config.limits.header_timeout = 60s;  // of bodies, too
        DeviceConfig robot;
        robot.name = "robot";
        robot.url = rr::parse_url(node.url("Robot")).value();
        robot.mode = DeviceMode::shared;
        robot.leases.is_offered = true;
        robot.leases.members = {{"Robot.halt", LeaseNeed::never}};
        robot.leases.safe = {{.kind = SafeAction::Kind::property, .path = "Robot", .member = "speed", .json = "0"}};
        config.devices.push_back(robot);
        config.access.tokens_file = files.write(
            "tokens", "mind " + hash_api_token(agent) + " agent _\nroot " + hash_api_token(person) + " admin _\n");
        const AgentTerms terms{.needs_approval = false, .hold = 0s};
        config.access.rules = {
            {.roles = {"admin"}, .may = {std::begin(all_verbs), std::end(all_verbs)}},
            {.roles = {"agent"}, .members = {"store"}, .may = {Verb::write}, .agent = terms},
            {.roles = {"agent"}, .members = {"say", "talk", "look"}, .may = {Verb::call}, .agent = terms}};
      }};

  std::string request(const std::string& first, const std::string& token, const std::string& body = {},
                      const std::string& lines = {}) const {
    return first + " HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer " + token +
           "\r\nContent-Type: application/json\r\nConnection: close\r\nContent-Length: " + std::to_string(body.size()) +
           "\r\n" + lines + "\r\n" + body;
  }
  TestClient::HttpResponse ask(const std::string& first, const std::string& token, const std::string& body = {},
                               const std::string& lines = {}) const {
    TestClient client(gateway.port());
    client.send(request(first, token, body, lines));
    return client.receive_response();
  }
  static std::string message(const std::string& method, const rr::OrderedJson& params) {
    return rr::write_json({{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}});
  }
  static std::string use(const std::string& tool, const std::string& path, const rr::OrderedJson& more = nullptr) {
    rr::OrderedJson arguments{{"device", "robot"}, {"path", path}};
    if (!more.is_null()) arguments.update(more);
    return message("tools/call", {{"name", tool}, {"arguments", arguments}});
  }
  /// The answer to a message, which may come as an event of a stream.
  rr::Json tell(const std::string& body) const {
    TestClient client(gateway.port());
    client.send(request("POST /mcp", agent, body));
    const auto text = client.receive_all();
    const auto at = text.rfind("data: {");
    const auto json = at == std::string::npos ? text.substr(text.find("\r\n\r\n") + 4)
                                              : text.substr(at + 6, text.find("\n\n", at) - at - 6);
    return rr::Json::parse(json, nullptr, false);
  }
  rr::Json read(const std::string& path) const { return tell(use("read", path))["result"]["structuredContent"]; }
  /// The result of a call.
  rr::Json call(const std::string& function, const rr::OrderedJson& args, const rr::OrderedJson& more = {}) const {
    rr::OrderedJson arguments{{"args", args}, {"why", "to hear"}};
    if (!more.is_null()) arguments.update(more);
    return tell(use("call", "Robot/" + function, arguments))["result"];
  }
  bool is_online() const {
    return comes_to([&] { return read("Robot/store/shape").contains("from_device"); });
  }
};

}  // namespace

TEST_CASE("agents: a right to write a memory tells how large it is, and nothing of what is in it") {
  const AgentsRobot robot;
  REQUIRE(robot.is_online());
  CHECK(robot.read("Robot/store/shape")["from_device"] == rr::Json::parse("[2]"));
  CHECK(robot.read("Robot/store")["error"]["name"] == "RobotRaconteur.PermissionDenied");
  const auto resource =
      robot.tell(AgentsRobot::message("resources/read", {{"uri", "rrgate://robot/Robot/store/shape"}}));
  CHECK(rr::Json::parse(resource["result"]["contents"][0]["text"].get<std::string>())["from_device"] ==
        rr::Json::parse("[2]"));
}

TEST_CASE("agents: what a device has done is told as done, under its lease, however long the answer is") {
  const AgentsRobot robot;
  REQUIRE(robot.is_online());
  const auto is_done = [](const rr::Json& result, const rr::Json& sent) {
    const auto& told = result["structuredContent"];
    INFO(told.dump().substr(0, 500));
    CHECK(result["isError"] == false);
    CHECK(told["member"].is_string());
    CHECK(told.value("sent", rr::Json()) == sent);
    CHECK(told.contains("made_safe"));
    CHECK_FALSE(told.contains("error"));
    return told;
  };
  CHECK(is_done(robot.call("say", {{"count", 3}}), {{"count", 3}})["from_device"] == "xxx");
  for (const auto count : {300'000, 2'000'000}) {  // too long for an answer; for the gateway to look at
    const auto told = is_done(robot.call("say", {{"count", count}}), {{"count", count}});
    CHECK_FALSE(told.contains("from_device"));
    CHECK(told.value("result_left_out", "").find("bytes") != std::string::npos);
  }
  const auto none = rr::OrderedJson::object();
  CHECK(is_done(robot.call("look", none), rr::Json::object()).value("result_left_out", "") != "");

  const auto some = is_done(robot.call("talk", {{"count", 3}}, {{"most", 2}}), {{"count", 3}});
  CHECK(some["from_device"] == rr::Json::parse(R"(["xxx", "xxx"])"));
  CHECK_FALSE(some.contains("result_left_out"));
  const auto large = is_done(robot.call("talk", {{"count", 2'000'000}}), {{"count", 2'000'000}});
  CHECK(large["from_device"] == rr::Json::array());
  CHECK(large.value("result_left_out", "").find("1048576 bytes") != std::string::npos);
  const auto many = is_done(robot.call("talk", {{"count", 200'000}}, {{"most", 3}}), {{"count", 200'000}});
  CHECK_FALSE(many.contains("from_device"));
  CHECK(many.value("result_left_out", "").find("262144 bytes") != std::string::npos);
}

TEST_CASE("what stops something is taken where an address has used up its memory") {
  const AgentsRobot robot;
  REQUIRE(robot.is_online());
  const std::string service = "/api/v1/devices/robot/Robot";
  const auto lease =
      rr::Json::parse(robot.ask("POST " + service + "?lease=acquire&deadman=60000", robot.person).body)["lease"]
          .get<std::string>();
  TestClient socket(robot.gateway.port());
  REQUIRE(
      socket
          .upgrade(service, "Sec-WebSocket-Protocol: rrgate.json.v1\r\nAuthorization: Bearer " + robot.person + "\r\n")
          .status == 101);
  const auto say = [&](const rr::OrderedJson& json) {
    socket.send_frame(1, rr::as_bytes(rr::write_json(json)));
    return rr::Json::parse(rr::as_text(socket.receive_frame().payload));
  };
  CHECK(say({{"id", 1}, {"op", "get"}, {"path", "speed"}})["result"] == 0.0);

  TestClient hog(robot.gateway.port());  // half of the account, but for a thousand bytes
  hog.send("PUT " + service + "/speed HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer " + robot.person +
           "\r\nContent-Type: application/json\r\nContent-Length: 499000\r\nRrgate-Lease: " + lease + "\r\n\r\n ");
  REQUIRE(comes_to([&] { return robot.ask("GET /api/v1/devices", robot.person).status == 503; }));

  const std::string spaces(2000, ' ');
  std::string numbers = "0";
  for (int i = 0; i < 200; ++i) numbers += ",0";
  const auto halt = R"({"how": [)" + numbers + "]}";
  CHECK(robot.ask("PUT " + service + "/speed", robot.person, "1").status == 503);
  CHECK(robot.ask("POST " + service + "/halt", robot.person, halt).status == 200);
  CHECK(robot.ask("POST " + service + "/halt", robot.person, halt + spaces).status == 200);
  CHECK(robot.ask("POST " + service + "/halt", robot.person, halt + spaces + spaces).status == 503);
  CHECK(robot.ask("POST " + service + "/halt", robot.agent, halt).status == 503);  // it may not
  CHECK(robot.ask("POST /api/v1/agents/stop", robot.person, spaces + R"({"minutes": 0})").status == 200);
  CHECK(robot.ask("POST /api/v1/agents/stop", robot.agent, R"({"minutes": 0})").status == 503);

  CHECK(robot.ask("POST /mcp", robot.agent, AgentsRobot::use("devices", "")).status == 503);
  const auto stop = robot.ask("POST /mcp", robot.agent, AgentsRobot::use("stop", "Robot") + spaces);
  CHECK(stop.status == 200);
  CHECK(rr::Json::parse(stop.body)["result"]["isError"] == false);
  CHECK(robot.ask("POST /mcp", robot.agent, AgentsRobot::use("stop", "Robot") + spaces + spaces).status == 503);
  const auto cancel = R"({"jsonrpc": "2.0", "method": "notifications/cancelled", "params": {"requestId": 1}})";
  CHECK(robot.ask("POST /mcp", robot.agent, cancel).status == 202);
  CHECK(robot.ask("DELETE /mcp", robot.agent, {}, "Mcp-Session-Id: none\r\n").status == 204);

  const auto refused = say({{"id", 2}, {"op", "get"}, {"path", "speed"}});
  CHECK(refused["id"] == 2);
  CHECK(refused["error"]["message"].get<std::string>().find("no memory left") != std::string::npos);
  const auto args = rr::OrderedJson::parse(halt);
  CHECK(say({{"id", 3}, {"op", "call"}, {"path", "halt"}, {"args", args}}).value("error", rr::Json()) == nullptr);

  CHECK(robot.ask("POST " + service + "?lease=release", robot.person, {}, "Rrgate-Lease: another\r\n").status == 503);
  CHECK(robot.ask("POST " + service + "?lease=release", robot.person, {}, "Rrgate-Lease: " + lease + "\r\n").status ==
        204);
}
