// What a device says and what its readers leave waiting, as clients by HTTP see it: statuses of errors, event streams.
#include <catch2/catch.hpp>
#include <thread>

#include "test/node/node/node_fixture.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

struct Robot {
  std::shared_ptr<rr::Service> service;
  bool is_closed = false;  ///< the generator whose values come late, or are none for JSON
  int spelled = 0;         ///< texts that JSON has no form for
  std::vector<std::shared_ptr<rr::LateCall>> late;
  rr::RunningNode node;

  explicit Robot(const rr::SecurityPolicy& policy = {})
      : service(rr::Service::from_text({"service test.robot\nobject Robot\nproperty int32 one [readonly]\n"
                                        "function void fail(uint16 code)\nfunction int32{generator} hang()\n"
                                        "function string spell()\nfunction string{generator} spells()\n"
                                        "function int32[]{generator} rows()\n"
                                        "function int32[]{generator} long_rows(uint32 count)\n"
                                        "event news(string text)\nend\n"},
                                       "Robot", "Robot")),
        node([this, &policy](rr::Node& made) {
          service->property("one").get([] { return 1; });
          service->function("fail", [](std::uint16_t code) {
            throw rr::ServiceException("as asked", static_cast<rr::ErrorCode>(code));
          });
          service->generator("hang", [this] {
            rr::Generator generator;
            generator.close = [this] { is_closed = true; };
            generator.start = [this](rr::Value, const std::shared_ptr<rr::LateCall>& call) { late.push_back(call); };
            return generator;
          });
          service->set_security(policy);
          const std::string latin = "\xfc";  // no UTF-8
          service->function("spell", [this, latin] {
            ++spelled;
            return latin;
          });
          service->generator("spells", [this, latin] {
            rr::Generator generator;
            generator.next = [latin](const rr::Value&) -> rr::Result<std::optional<rr::Value>> {
              return rr::Value(latin);
            };
            generator.close = [this] { is_closed = true; };
            return generator;
          });
          service->generator("rows", [] {
            return [left = 2]() mutable -> std::optional<std::vector<std::int32_t>> {
              if (left-- == 0) return std::nullopt;
              return std::vector<std::int32_t>{1, left};
            };
          });
          service->generator("long_rows", [](std::uint32_t count) {
            return [count]() -> std::optional<std::vector<std::int32_t>> {
              return std::vector<std::int32_t>(count, 1'000'000'000);
            };
          });
          made.add(service);
        }) {}

  void fire(int count, const std::string& text) {
    node.ask([&](rr::Node&) {
      for (int i = 0; i < count; ++i) service->fire("news", text);
      return 0;
    });
  }
};

std::function<void(Config&)> with(Robot& robot) {
  return [&robot](Config& config) {
    DeviceConfig device;
    device.name = "robot";
    device.url = rr::parse_url(robot.node.url("Robot")).value();
    config.devices.push_back(device);
  };
}

/// `headers` are whole lines with their line ends.
void call(TestClient& client, const std::string& function, const std::string& body, const std::string& headers = {}) {
  client.send("POST /api/v1/devices/robot/Robot/" + function +
              " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: " +
              std::to_string(body.size()) + "\r\n" + headers + "\r\n" + body);
}

unsigned status_of_failure(TestClient& client, rr::ErrorCode code) {
  call(client, "fail", nlohmann::json{{"code", static_cast<int>(code)}}.dump());
  return client.receive_response().status;
}

void begin_stream(TestClient& client) {
  client.send("GET /api/v1/devices/robot/Robot/news HTTP/1.1\r\nHost: localhost\r\nAccept: text/event-stream\r\n\r\n");
  client.receive_until(": connected\n\n");
}

}  // namespace

TEST_CASE("errors of a device have the status of their kind over HTTP") {
  Robot robot;
  TestGateway gateway(0, with(robot));
  TestClient client(gateway.port());
  using enum rr::ErrorCode;
  for (const auto& [status, codes] : std::initializer_list<std::pair<unsigned, std::vector<rr::ErrorCode>>>{
           {400, {invalid_argument, data_type_mismatch, out_of_range, null_value}},
           {403, {permission_denied, system_resource_permission_denied}},
           {404, {object_not_found, member_not_found, key_not_found, resource_not_found}},
           {405, {read_only_member, write_only_member}},
           {409, {invalid_operation, invalid_state, member_busy, value_not_set, operation_aborted}},
           {413, {buffer_limit_violation}},
           {422, {operation_failed, remote_error}},
           {423, {object_locked_error}},
           {501, {not_implemented_error}},
           {503, {out_of_system_resource}},
           {504, {request_timeout, operation_timeout}},
           {502, {internal_error, io_error}}}) {
    for (const auto code : codes) {
      INFO(static_cast<int>(code));
      CHECK(status_of_failure(client, code) == status);
    }
  }
}

TEST_CASE("a generator whose value comes too late for HTTP is ended at the device") {
  Robot robot;
  TestGateway gateway(0, [&](Config& config) {
    with(robot)(config);
    config.timeouts.request = 200ms;
  });
  TestClient client(gateway.port());
  call(client, "hang", "{}");
  CHECK_THAT(client.receive_until("\n\r\n0\r\n\r\n"), Catch::Contains("RequestTimeout"));
  const auto end = std::chrono::steady_clock::now() + 10s;
  const auto is_closed = [&] {
    return robot.node.ask([&](rr::Node&) {
      for (const auto& call : std::exchange(robot.late, {})) call->answer(rr::Value(std::int32_t{1}));
      return robot.is_closed;
    });
  };
  while (!is_closed() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  CHECK(is_closed());
}

TEST_CASE("the lines of a generator are JSON for clients that take CBOR, too") {
  Robot robot;
  TestGateway gateway(0, with(robot));
  TestClient client(gateway.port());
  call(client, "rows", "{}", "Accept: application/cbor\r\n");
  const auto answer = client.receive_until("\r\n0\r\n\r\n");
  CHECK_THAT(answer, Catch::Contains("application/x-ndjson"));
  CHECK_THAT(answer, Catch::Contains("\n[1,1]\n") && Catch::Contains("\n[1,0]\n"));
}

TEST_CASE(
    "values of a generator that wait for a slow client are counted, and those for which there is no memory end it") {
  constexpr std::size_t text_bytes = 11'000'000;  // of a million numbers: more than sockets hold
  Robot robot;
  TestGateway gateway(0, [&](Config& config) {
    with(robot)(config);
    config.limits.memory = 64'000'000;
  });
  TestClient reader(gateway.port()), asker(gateway.port());
  call(reader, "long_rows", R"({"count":1000000})");
  reader.receive_until("[1000000000,");
  const auto used = [&] {
    asker.send("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
    const auto text = asker.receive_response().body;
    constexpr std::string_view name = "\nrrgate_memory_budget_used_bytes ";
    return std::stoul(text.substr(text.find(name) + name.size()));
  };
  CHECK(used() >= text_bytes);
  CHECK(used() < 2 * text_bytes);  // nothing but the text waits
  TestClient other(gateway.port());
  call(other, "long_rows", R"({"count":3000000})");
  CHECK_THAT(other.receive_until("\r\n0\r\n\r\n"), Catch::Contains("RobotRaconteur.OutOfSystemResource"));
}

TEST_CASE("what a device has done is not told as refused because JSON has no form for its answer") {
  Robot robot;
  TestGateway gateway(0, with(robot));
  TestClient client(gateway.port());
  call(client, "spell", "{}");
  const auto answer = client.receive_response();
  CHECK(answer.status == 502);
  CHECK_THAT(answer.body, Catch::Contains("RobotRaconteur.ProtocolError") && Catch::Contains("is not UTF-8"));
  CHECK(robot.node.ask([&](rr::Node&) { return robot.spelled; }) == 1);
  call(client, "spells", "{}");
  CHECK_THAT(client.receive_until("\n\r\n0\r\n\r\n"), Catch::Contains("RobotRaconteur.ProtocolError"));
  const auto end = std::chrono::steady_clock::now() + 10s;
  const auto is_closed = [&] { return robot.node.ask([&](rr::Node&) { return robot.is_closed; }); };
  while (!is_closed() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  CHECK(is_closed());
}

TEST_CASE("an event stream without news says that it lives") {
  Robot robot;
  TestGateway gateway(0, with(robot));
  TestClient reader(gateway.port());
  begin_stream(reader);
  const auto begin = std::chrono::steady_clock::now();
  std::string comment;
  while (comment.empty() && std::chrono::steady_clock::now() - begin < 30s) try {
      comment = reader.receive_until(": \n\n");
    } catch (const std::runtime_error&) {  // nothing for 10 s
    }
  const auto silence = std::chrono::steady_clock::now() - begin;
  CHECK_THAT(comment, Catch::EndsWith(": \n\n"));
  CHECK(silence > 14s);
  CHECK(silence < 20s);
  robot.fire(1, "after it");
  CHECK_THAT(reader.receive_until("\n\n"), Catch::Contains("after it"));
}

TEST_CASE("a reader of an event stream that falls behind is told, and its stream ends") {
  constexpr int rounds = 10, events = 16;
  Robot robot;
  TestGateway gateway(0, with(robot));
  TestClient reader(gateway.port());
  begin_stream(reader);
  for (int round = 0; round < rounds; ++round) {  // 10 MB: more than may wait, and the sockets between take
    robot.fire(events, std::string(65536, 'x'));
    gateway.wait_for("/api/v1/devices/robot/Robot/one", [](const auto&) { return true; });  // they have come there
  }
  const auto received = reader.receive_until("\r\n0\r\n\r\n");
  CHECK(received.size() < 8'000'000);
  CHECK_THAT(received.substr(received.size() - 200), Catch::Contains("too slow: values were lost, so the stream ends"));
  TestClient again(gateway.port());
  begin_stream(again);
  robot.fire(1, "as ever");
  CHECK_THAT(again.receive_until("as ever"), Catch::Contains("as ever"));
}

namespace {

/// Lets nobody in, or everybody.
struct Doorkeeper final : rr::Authenticator {
  rr::Result<rr::AuthenticatedUser> authenticate(const rr::LoginAttempt& attempt) const override {
    if (lets_in) return rr::AuthenticatedUser{attempt.username};
    return rr::make_error(rr::ErrorCode::authentication_error, "come back later");
  }
  std::atomic<bool> lets_in = false;
};

rr::Error refusal_of(const std::string& url) {
  return rr::error_of([&] { (void)rr::connect(url); });
}

}  // namespace

TEST_CASE("who comes while a device refuses the gateway hears why, and not that there is no such service") {
  const auto doorkeeper = std::make_shared<Doorkeeper>();
  rr::SecurityPolicy policy;
  policy.require_valid_user = true;
  policy.authenticator = doorkeeper;
  Robot robot(policy);
  const TestGateway gateway(0, [&](Config& config) {
    with(robot)(config);
    auto& device = config.devices.front();
    device.mode = DeviceMode::shared;
    device.login.username = "gateway";
    config.retry = Retry{milliseconds(50), milliseconds(50), milliseconds(50)};
  });
  const auto port = std::to_string(gateway.port());
  const std::vector<std::string> ways{"rr+tcp://127.0.0.1:" + port + "/?nodename=robot&service=Robot",
                                      "rr+tcp://127.0.0.1:" + port + "/?service=Robot"};
  for (const auto& way : ways) {
    INFO(way);
    const auto refusal = refusal_of(way);
    CHECK(refusal.code == rr::ErrorCode::connection_error);
    CHECK_THAT(refusal.message,
               Catch::Contains("'Robot' of device 'robot': the device refuses the gateway's login: ") &&
                   Catch::Contains("Authentication Failed"));
  }
  CHECK(refusal_of("rr+tcp://127.0.0.1:" + port + "/?nodename=robot&service=Another").code ==
        rr::ErrorCode::service_not_found);
  doorkeeper->lets_in = true;
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (refusal_of(ways.front()).code != rr::ErrorCode::none && std::chrono::steady_clock::now() < end)
    std::this_thread::yield();
  for (const auto& way : ways) CHECK(rr::connect(way).get("one") == rr::Value(1));
}

TEST_CASE("who comes to a shared device that is away hears so") {
  std::string url;
  {
    const Robot robot;
    url = robot.node.url("Robot");
  }
  const TestGateway gateway(0, [&](Config& config) {
    DeviceConfig device;
    device.name = "robot";
    device.url = rr::parse_url(url).value();
    device.mode = DeviceMode::shared;
    config.devices.push_back(device);
  });
  const auto refusal =
      refusal_of("rr+tcp://127.0.0.1:" + std::to_string(gateway.port()) + "/?nodename=robot&service=Robot");
  CHECK(refusal.code == rr::ErrorCode::connection_error);
  CHECK_THAT(refusal.message, Catch::Contains("device 'robot' is offline"));
}

TEST_CASE("Basic credentials that can't be read are refused, whether they are for the gateway or for the device") {
  const bool are_for_gateway = GENERATE(false, true);
  Robot robot;
  const Folder files;
  TestGateway gateway(0, [&](Config& config) {
    with(robot)(config);
    if (are_for_gateway) config.access.users_file = files.write("users", "");
  });
  gateway.wait_for("/readyz", [](const auto& ready) { return ready["devices_online"] == 1; });
  const std::string place = "/api/v1/devices/robot/Robot";
  const std::string no_base64 = "Authorization: Basic !\r\n", no_colon = "Authorization: Basic YWxpY2U=\r\n";
  for (const auto& lines : {no_base64, no_colon}) {
    TestClient client(gateway.port());
    for (const auto& path : {place + "/one", std::string("/api/v1/devices/robot/openapi.json")}) {
      client.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + lines + "\r\n");
      const auto refused = client.receive_response();
      CHECK(refused.status == 401);
      CHECK_THAT(refused.head, Catch::Contains("WWW-Authenticate: Basic "));
      CHECK_THAT(refused.body, Catch::Contains("Basic credentials can't be read"));
    }
    TestClient socket(gateway.port());
    CHECK(socket.upgrade(place, "Sec-WebSocket-Protocol: rrgate.json.v1\r\n" + lines).status == 401);
  }
}
