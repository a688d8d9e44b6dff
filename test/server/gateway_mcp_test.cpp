// The Model Context Protocol, with requests as any client may send them.
#include <catch2/catch.hpp>
#include <limits>
#include <set>

#include "server/access/api_tokens.hpp"
#include "server/http/shrink_image.hpp"
#include "server/json/json.hpp"
#include "server/mcp/mcp_describe.hpp"
#include "server/mcp/mcp_summary.hpp"
#include "server/mcp/mcp_tools.hpp"
#include "server/mcp/value_hash.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

struct Told {
  unsigned status = 0;
  rr::Json json = {};
};

Told tell(TestGateway& gateway, const std::string& body, const std::string& lines = {}) {
  TestClient client(gateway.port());
  client.send("POST /mcp HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: " +
              std::to_string(body.size()) + "\r\n" + lines + "\r\n" + body);
  const auto response = client.receive_response();
  return {static_cast<unsigned>(response.status), rr::Json::parse(response.body, nullptr, false)};
}

std::string request(const std::string& method, const std::string& params = "{}") {
  return R"({"jsonrpc": "2.0", "id": 7, "method": ")" + method + R"(", "params": )" + params + "}";
}

void enable(Config& config) {
  config.mcp.is_enabled = true;
}

}  // namespace

TEST_CASE("agents: tools are the same whatever devices there are, and say whether they only read") {
  TestGateway none(0, enable);
  TestGateway two(2, enable);
  const auto tools = tell(none, request("tools/list")).json["result"]["tools"];
  CHECK(tools == tell(two, request("tools/list")).json["result"]["tools"]);
  REQUIRE(tools.size() == 8);
  for (const auto& tool : tools) {
    const auto name = tool["name"].get<std::string>();
    const bool is_command = name == "call" || name == "set";
    CHECK(tool["annotations"]["readOnlyHint"] == !(is_command || name == "stop"));
    CHECK(tool["annotations"].value("destructiveHint", false) == is_command);
  }
}

TEST_CASE("agents: a message that is none is refused with what was expected, and its id is told") {
  TestGateway gateway(0, enable);
  const auto code = [](const Told& told) { return told.json["error"]["code"].get<int>(); };
  CHECK(code(tell(gateway, "{")) == -32700);
  CHECK(code(tell(gateway, "[]")) == -32600);
  CHECK(code(tell(gateway, R"({"jsonrpc": "2.0", "id": {}, "method": "ping"})")) == -32600);
  CHECK(code(tell(gateway, request("nothing"))) == -32601);
  const auto with_token = [](std::size_t size) {
    return request("ping", R"({"_meta": {"progressToken": ")" + std::string(size, 'x') + R"("}})");
  };
  CHECK(tell(gateway, with_token(256)).json.contains("result"));
  CHECK(code(tell(gateway, with_token(257))) == -32602);
  CHECK(code(tell(gateway, request("tools/call", R"({"name": "nothing"})"))) == -32602);
  CHECK(code(tell(gateway, request("tools/call", R"({"name": "devices", "arguments": []})"))) == -32602);
  CHECK(code(tell(gateway, request("resources/read", R"({"uri": "file:///etc/passwd"})"))) == -32002);
  CHECK(tell(gateway, request("nothing")).json["id"] == 7);
  const auto modern = "MCP-Protocol-Version: 2026-07-28\r\n";
  const auto mismatch = tell(gateway, request("ping"), std::string(modern) + "Mcp-Method: tools/list\r\n");
  CHECK(mismatch.status == 400);
  CHECK(code(mismatch) == -32020);
  CHECK(tell(gateway, request("ping"), std::string(modern) + "Mcp-Method: ping\r\n").json["result"]["resultType"] ==
        "complete");
}

TEST_CASE("agents: who has no right to anything is refused, and others see what they have a right to") {
  const Folder files;
  const auto token = make_api_token();
  const auto stranger = make_api_token();
  const auto tokens = files.write(
      "tokens", "mind " + hash_api_token(token) + " agent _\nother " + hash_api_token(stranger) + " nobody _\n");
  TestGateway gateway(2, [&](Config& config) {
    enable(config);
    config.access.tokens_file = tokens;
    config.access.rules = {{.roles = {"agent"}, .devices = {"x"}, .may = {Verb::read}}};
  });
  const auto shows = [](const std::string& secret) { return "Authorization: Bearer " + secret + "\r\n"; };
  CHECK(tell(gateway, request("ping")).status == 401);
  CHECK(tell(gateway, request("ping"), shows(stranger)).status == 403);
  const auto devices = tell(gateway, request("tools/call", R"({"name": "devices"})"), shows(token));
  const auto& list = devices.json["result"]["structuredContent"]["devices"];
  REQUIRE(list.size() == 1);
  CHECK(list[0]["name"] == "x");
  // The same words whether the device is there or not.
  const auto refused = [&](const std::string& device) {
    const auto arguments = R"({"name": "read", "arguments": {"device": ")" + device + R"(", "path": "a/b"}})";
    return tell(gateway, request("tools/call", arguments), shows(token))
        .json["result"]["structuredContent"]["error"]["name"];
  };
  CHECK(refused("y") == "RobotRaconteur.PermissionDenied");
  CHECK(refused("z") == "RobotRaconteur.PermissionDenied");
}

TEST_CASE("agents: lists come in pages, and long texts of devices are cut between characters") {
  CHECK(page_of(120, "").next == "50");
  CHECK(page_of(120, "100").last == 120);
  CHECK(page_of(120, "100").next.empty());
  CHECK(page_of(50, "").next.empty());
  for (const auto* wrong : {"x", "-1", "121", "5x"}) CHECK_THROWS(page_of(120, wrong));
  CHECK(bounded_text("short") == "short");
  std::string long_text = "a";
  for (int i = 0; i < 1000; ++i) long_text += "\xC3\xA4";
  const auto cut = bounded_text(long_text);
  CHECK(cut.size() < 1050);
  CHECK(cut.substr(0, 999) == long_text.substr(0, 999));
  CHECK(cut.find("bytes more") != std::string::npos);
  CHECK(bounded_text("a\xFF\xC3") == "a\xEF\xBF\xBD\xEF\xBF\xBD");
}

TEST_CASE("agents: a device whose name is no UTF-8 is listed all the same") {
  boost::asio::io_context io;
  const auto work = boost::asio::make_work_guard(io);
  std::thread thread([&io] { io.run(); });
  {
    const FakeDevice evil(io, "ev\xFFil");
    TestGateway gateway(0, [&](Config& config) {
      enable(config);
      config.devices.push_back({"evil", rr::parse_url(evil.url()).value(), 0});
    });
    const auto name = [&] {
      const auto told = tell(gateway, request("tools/call", R"({"name": "devices"})"));
      return told.json["result"]["structuredContent"]["devices"][0]["from_device"].value("node_name", "");
    };
    gateway.wait_for("/api/v1/devices", [](const auto& seen) { return seen["devices"][0]["state"] == "online"; });
    CHECK(name() == "ev\xEF\xBF\xBDil");
  }
  io.stop();
  thread.join();
}

TEST_CASE("agents: values that differ have other hashes, and equal ones the same") {
  const auto text = [](const char* name, const char* value) {
    return rr::Value(rr::MapString{{{name, rr::Value(value)}}});
  };
  const std::vector<rr::Value> values{
      {},
      rr::Value(1),
      rr::Value(1.0),
      rr::Value("a"),
      rr::Value(std::vector<double>{1, 2}),
      rr::Value(std::vector<double>{2, 1}),
      rr::Value(rr::List{{rr::Value(1), rr::Value(2)}}),
      rr::Value(rr::List{{rr::Value(2), rr::Value(1)}}),
      text("a", "b"),
      text("b", "a"),
      rr::Value(rr::Structure{"s", {{"x", rr::Value(1)}, {"y", rr::Value(2)}}}),
      rr::Value(rr::Structure{"s", {{"x", rr::Value(2)}, {"y", rr::Value(1)}}}),
      rr::Value(rr::MultiDimArray{{1, 2}, rr::Array::take(std::vector<double>{1, 2})}),
      rr::Value(rr::MultiDimArray{{2, 1}, rr::Array::take(std::vector<double>{1, 2})}),
  };
  std::set<std::size_t> hashes;
  for (const auto& value : values) {
    hashes.insert(hash_of(value));
    CHECK(hash_of(value) == hash_of(rr::Value(value)));
  }
  CHECK(hashes.size() == values.size());
}

TEST_CASE("agents: the age of a wire's value is told of any time that a device says") {
  const std::chrono::system_clock::time_point now(std::chrono::seconds(1'900'000'000));
  CHECK(age_ms({1'900'000'000, 0}, now) == 0);
  CHECK(age_ms({1'899'999'998, 500'000'000}, now) == 1500);
  CHECK(age_ms({std::numeric_limits<std::int64_t>::max(), 0}, now) < -1'000'000'000'000);
  CHECK(age_ms({std::numeric_limits<std::int64_t>::min(), 0}, now) > 1'000'000'000'000);
}

TEST_CASE("agents: what is watched is summarised by its numbers, wherever they stand") {
  McpSummary summary;
  summary.add(rr::OrderedJson::parse(R"({"at": {"x": 1, "y": [2, -2]}, "name": "a", "big": "9007199254740993"})"));
  summary.add(rr::OrderedJson::parse(R"({"at": {"x": 4, "y": []}, "is_on": true})"));
  const auto told = summary.to_json();
  REQUIRE(told.size() == 3);
  CHECK(told["at.x"] == rr::OrderedJson::parse(R"({"min": 1.0, "max": 4.0, "mean": 2.5})"));
  CHECK(told["at.y.1"]["mean"] == -2.0);
  McpSummary number;
  number.add(5);
  CHECK(number.to_json()[""]["max"] == 5.0);
  McpSummary many;
  auto wide = rr::OrderedJson::object();
  for (int i = 0; i < 1000; ++i) wide["n" + std::to_string(i)] = i;
  many.add(wide);
  CHECK(many.to_json().size() == 100);
}

TEST_CASE("a smaller image has the mean of each square of pixels") {
  const rr::Bytes rows{0, 10, 20, 30, 99, /**/ 10, 20, 30, 40, 99, /**/ 200, 200, 7, 9, 99};
  PixelImage image{4, 3, 5, PixelFormat::mono8, rows};
  const auto half = shrink_image(image, 2);
  CHECK(half.image.width == 2);
  CHECK(half.image.height == 2);
  CHECK(half.pixels == rr::Bytes{10, 30, 200, 8});
  const auto same = shrink_image(image, 4);
  CHECK(same.pixels == rr::Bytes{0, 10, 20, 30, 10, 20, 30, 40, 200, 200, 7, 9});
  const rr::Bytes wide{1, 2, 3, 3, 4, 5};
  CHECK(shrink_image({2, 1, 6, PixelFormat::rgb8, wide}, 1).pixels == rr::Bytes{2, 3, 4});
  const rr::Bytes sixteen{0xff, 10, 0xff, 20};
  const auto higher = shrink_image({2, 1, 4, PixelFormat::mono16, sixteen}, 1);
  CHECK(higher.image.format == PixelFormat::mono8);
  CHECK(higher.pixels == rr::Bytes{15});
}
