// HEAD is answered as GET is, but for the body: each route, and each kind of thing below a device.
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "server/gateway/routes.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

constexpr const char* definition = R"(service test.head
stdver 0.10
struct Image
  field uint32 width
  field uint32 height
  field string encoding
  field uint8[] data
end
object Robot
  property int32 number [readonly]
  function int32 twice(int32 n)
  event happened(int32 n)
  pipe int32 packets [readonly]
  wire int32 level
  wire Image live [readonly]
  memory uint8[] store
end
)";

struct HeadRobot {
  rr::RunningNode node{[](rr::Node& into) {
    const auto service = rr::Service::from_text({definition}, "Robot", "Robot");
    service->property("number").get([] { return 1; });
    service->function("twice", [](std::int32_t n) { return 2 * n; });
    service->on_wire("level", [](std::int32_t) {});
    service->set_wire("level", 5);
    service->set_wire("live", rr::Structure{"test.head.Image",
                                            {{"width", std::uint32_t{1}},
                                             {"height", std::uint32_t{1}},
                                             {"encoding", "mono8"},
                                             {"data", rr::Value(std::vector<std::uint8_t>{7})}}});
    const auto store = std::make_shared<rr::NumberMemory<std::uint8_t>>();
    store->dimensions = {2};
    store->items = {1, 2};
    service->memory("store", store);
    into.add(service);
  }};
};

/// What is asked for where a route has a "*".
const std::map<std::string, std::vector<std::string>> below{
    {"/api/v1/devices/*",
     {"robot",
      "robot/subscriptions",
      "robot/openapi.json",
      "robot/asyncapi.json",
      "robot/thing-description.json",
      "robot/types.d.ts",
      "robot/test.head.robdef",
      "robot/Robot",
      "robot/Robot/number",
      "robot/Robot/twice",
      "robot/Robot/happened",
      "robot/Robot/packets",
      "robot/Robot/level",
      "robot/Robot/live",
      "robot/Robot/live?as=mjpeg",
      "robot/Robot/live?as=jpeg",
      "robot/Robot/store",
      "robot/Robot/store/shape",
      "robot/Robot/none",
      "robot/None",
      "none"}},
    {"/api/v1/recordings/*", {"none"}},
    {"/api/*", {"none"}},
    {"/devices/*", {"robot", "none"}},
    {"/docs/*", {"", "none.html"}},
    {"/*", {"", "style.css", "none"}},
};

/// The patterns that GET has; of a gateway of their own, since the other one lives on another thread.
std::vector<std::string> patterns() {
  boost::asio::io_context io;
  Config config;
  config.mcp.is_enabled = true;
  Gateway gateway(io, config);
  std::vector<std::string> out;
  for (const auto& route : list_routes(gateway))
    if (route.method == http::verb::get) out.push_back(route.pattern);
  return out;
}

struct Head {
  unsigned status = 0;
  std::set<std::string> lines;
  bool operator==(const Head&) const = default;
};

/// `is_measured`  false: how long the body is differs from one answer to the next.
Head head_of(TestClient& client, const std::string& method, const std::string& target, const std::string& headers,
             bool is_measured) {
  client.send(method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
  const auto response = client.receive_response(false);
  Head out{response.status, {}};
  for (std::size_t at = 0, end = 0; (end = response.head.find("\r\n", at)) != std::string::npos; at = end + 2) {
    auto line = response.head.substr(at, end - at);
    if (!is_measured && line.starts_with("Content-Length: ")) line = "Content-Length: ";
    out.lines.insert(std::move(line));
  }
  return out;
}

std::string etag_of(const Head& head) {
  constexpr std::string_view name = "ETag: ";
  for (const auto& line : head.lines)
    if (line.starts_with(name)) return line.substr(name.size());
  return "\"none\"";
}

}  // namespace

TEST_CASE("HEAD is answered on every route as GET is, with the same headers and without a body") {
  HeadRobot device;
  Folder files;
  files.write("page/index.html", "<html></html>");
  files.write("page/style.css", "a {}");
  TestGateway gateway(0, [&](Config& config) {
    DeviceConfig robot;
    robot.name = "robot";
    robot.mode = DeviceMode::shared;
    robot.url = rr::parse_url(device.node.url("Robot")).value();
    config.devices = {robot};
    config.web_root = files.path("page");
    config.mcp.is_enabled = true;
  });
  gateway.wait_for_state("online");
  std::set<unsigned> statuses;
  for (const auto& pattern : patterns()) {
    const bool is_open = pattern.back() == '*';
    REQUIRE(below.contains(pattern) == is_open);
    for (const auto& rest : is_open ? below.at(pattern) : std::vector<std::string>{""})
      for (std::string headers : {"", "Accept: text/event-stream\r\n", "If-None-Match: "}) {
        const auto target = pattern.substr(0, pattern.size() - is_open) + rest;
        INFO(target << " " << headers);
        const bool is_measured = target != "/metrics" && target != "/api/v1/devices";  // they have counters
        TestClient asking(gateway.port());
        if (headers.starts_with("If-None-Match"))  // what the document is now
          headers += etag_of(head_of(asking, "HEAD", target, "", true)) + "\r\n";
        TestClient getting(gateway.port());
        const auto got = head_of(getting, "GET", target, headers, is_measured);
        TestClient client(gateway.port());
        const auto head = head_of(client, "HEAD", target, headers, is_measured);
        CHECK(head.lines == got.lines);
        statuses.insert(head.status);
        // Nothing stands between the head and the next response.
        if (!head.lines.contains("Connection: close"))
          CHECK(head_of(client, "HEAD", "/healthz", "", true).status == 200);
      }
  }
  CHECK(statuses.contains(200));
  CHECK(statuses.contains(304));
  CHECK(statuses.contains(404));
}
