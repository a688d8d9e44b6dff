// What anybody asks of a gateway with users, rights and a device: each request is answered by a whole response; who has
// no right gets nothing but what is for everybody; and nothing of the device is changed, called or told but by a right
// to it.
//
// Input: choices of who asks, of method, path, headers and body; up to eight requests, one connection each.
#include <set>

#include "node/service/memory.hpp"
#include "node/service/node.hpp"
#include "server/access/api_tokens.hpp"
#include "server/gateway/routes.hpp"
#include "test/fuzz/inside_gateway.hpp"
#include "test/fuzz/memory_bound.hpp"
#include "test/support/folder.hpp"

namespace {

using namespace rr::fuzz;
using rr::test::Choices;
using rr::test::require;
using rrgate::Verb;

const std::string definition = R"(service test.fuzz
stdver 0.10
object Part
  property int32 number
  property string secret
  function int32 twice(int32 n)
  function void move(int32 n)
  function int32{generator} count()
  event happened(int32 n)
  callback int32 ask(int32 n)
  pipe int32 orders [writeonly]
  pipe int32 packets
  wire int32 command [writeonly]
  wire int32 level
  memory uint8[] store
  objref Part{string} part
end
)";
const std::string secret_value = "only-for-admins-4711";
const std::string outside_value = "outside-of-the-page-4712";

/// What was done to the device so far.
struct Deeds {
  std::size_t number = 0;
  std::size_t secret = 0;
  std::size_t twice = 0;
  std::size_t move = 0;
  std::size_t count = 0;
  std::size_t orders = 0;
  std::size_t packets = 0;
  std::size_t command = 0;
  std::size_t level = 0;
  bool operator==(const Deeds&) const = default;
};

class Robot {
 public:
  Robot() {
    fill(service->root());
    part_ = service->make_object("Part");
    fill(*part_);
    part_->objref("part", [](std::string_view) { return std::shared_ptr<rr::Object>(); });
    service->objref("part", [this](std::string_view index) { return index == "a" ? part_ : nullptr; });
  }
  std::shared_ptr<rr::Service> service = rr::Service::from_text({definition}, "Robot", "Part");
  Deeds deeds;
  std::shared_ptr<rr::NumberMemory<std::uint8_t>> store = std::make_shared<rr::NumberMemory<std::uint8_t>>();

 private:
  template <class Part>
  void fill(Part& part) {
    part.property("number").get([] { return 1; }).set([this](std::int32_t) { ++deeds.number; });
    part.property("secret").get([] { return secret_value; }).set([this](const std::string&) { ++deeds.secret; });
    part.function("twice", [this](std::int32_t n) {
      ++deeds.twice;
      return static_cast<std::int32_t>(n % 1000 * 2);
    });
    part.function("move", [this](std::int32_t) { ++deeds.move; });
    part.generator("count", [this] {
      ++deeds.count;
      return [n = 0]() mutable { return n < 3 ? std::optional<std::int32_t>(++n) : std::nullopt; };
    });
    part.pipe("orders").on_packet([this](const rr::PipeEndpoint&, std::int32_t) { ++deeds.orders; });
    part.pipe("packets").on_packet([this](const rr::PipeEndpoint&, std::int32_t) { ++deeds.packets; });
    part.on_wire("command", [this](std::int32_t) { ++deeds.command; });
    part.on_wire("level", [this](std::int32_t) { ++deeds.level; });
    part.set_wire("level", 5);
    store->dimensions = {4};
    store->items = {1, 2, 3, 4};
    part.memory("store", store);
  }
  std::shared_ptr<rr::Object> part_;
};

/// Who asks, and what he may.
struct Asker {
  std::string_view name;
  std::string_view token;  ///< empty: he shows nothing
  bool is_known = true;    ///< the token is good
  bool is_admin = false;
};
constexpr Asker askers[] = {{"nobody", "", false},
                            {"stranger", "strange", false},
                            {"guest", "guest-token"},
                            {"reader", "reader-token"},
                            {"caller", "caller-token"},
                            {"writer", "writer-token"},
                            {"admin", "admin-token", true, true}};

class Site {
 public:
  Site() {
    rrgate::configure_log("error", "text");
    node_.add(robot.service);
    const auto port = node_.listen("rr+tcp://127.0.0.1:0");
    rrgate::Config config;
    rrgate::DeviceConfig device;
    device.name = "robot";
    device.mode = rrgate::DeviceMode::shared;
    device.url = rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=Robot").value();
    config.devices = {device};
    device.name = "raw";
    device.mode = rrgate::DeviceMode::relay;
    config.devices.push_back(device);
    std::string tokens;
    for (const auto& asker : askers)
      if (asker.is_known) {
        const std::string name(asker.name);
        tokens += name + " " + rrgate::hash_api_token(asker.token) + " " + (name == "guest" ? "_" : name) + " _\n";
      }
    config.access.tokens_file = files_.write("tokens", tokens);
    config.web_root = files_.path("page");
    files_.write("page/index.html", "<html></html>");
    files_.write("page-secret/outside.txt", outside_value);
    files_.write("outside.txt", outside_value);
    config.access.rules = {{.roles = {"reader"},
                            .devices = {"robot"},
                            .members = {"number", "twice", "move", "level", "packets", "store", "happened", "ask"},
                            .may = {Verb::read, Verb::subscribe}},
                           {.roles = {"caller"}, .devices = {"robot"}, .members = {"twice"}, .may = {Verb::call}},
                           {.roles = {"writer"}, .devices = {"robot"}, .members = {"number"}, .may = {Verb::write}},
                           {.roles = {"admin"}, .may = {std::begin(rrgate::all_verbs), std::end(rrgate::all_verbs)}}};
    config.mcp.is_enabled = true;
    config.mcp.longest_wait = config.mcp.longest_approval = std::chrono::milliseconds(10);
    config.serve.is_enabled = true;
    config.serve.max_devices = 1;
    gateway_.emplace(io, std::move(config));
    gateway_->start().value();
    for (auto& route : rrgate::list_routes(*gateway_)) routes.push_back(route.pattern);
    prove();
  }

  rrgate::Gateway& gateway() { return *gateway_; }
  boost::asio::io_context io{1};
  Robot robot;
  std::vector<std::string> routes;

 private:
  /// The rights are what the fuzzer takes them for.
  void prove() {
    const auto is_online = [this] { return gateway_->devices().find("robot")->state() == rrgate::DeviceState::online; };
    require(run_until(io, std::chrono::seconds(10), is_online, 10000), "the device is online");
    const auto status = [this](std::string_view token, const std::string& line, const std::string& body) {
      InsideClient client(io, *gateway_);
      const auto method = line.substr(0, line.find(' '));
      client.send(line + " HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer " + std::string(token) +
                  "\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" +
                  body);
      run_until(
          io, std::chrono::seconds(10), [&] { return read_answer(client.received(), method).is_whole; }, 1000);
      return read_answer(client.received(), method).status;
    };
    const std::string at = "/api/v1/devices/robot/Robot/";
    require(status("admin-token", "POST " + at + "move", R"({"n": 1})") / 100 == 2 && robot.deeds.move == 1,
            "admins move");
    require(status("reader-token", "GET " + at + "number", "") == 200, "readers read");
    require(status("caller-token", "POST " + at + "twice", R"({"n": 1})") == 200 && robot.deeds.twice == 1,
            "callers call");
    require(status("writer-token", "PUT " + at + "number", "1") / 100 == 2 && robot.deeds.number == 1, "writers write");
  }

  rr::Node node_{io, "fuzz.robot"};
  rrgate::test::Folder files_;
  std::optional<rrgate::Gateway> gateway_;
};

constexpr std::string_view methods[] = {"GET", "PUT", "POST", "DELETE", "HEAD", "OPTIONS", "PATCH", "TRACE"};
constexpr std::string_view words[] = {"robot",
                                      "Robot",
                                      "number",
                                      "secret",
                                      "twice",
                                      "move",
                                      "count",
                                      "happened",
                                      "ask",
                                      "orders",
                                      "packets",
                                      "command",
                                      "level",
                                      "store",
                                      "part",
                                      "a",
                                      "shape",
                                      "raw",
                                      "gateway",
                                      "api",
                                      "v1",
                                      "devices",
                                      "access",
                                      "requests",
                                      "session",
                                      "tickets",
                                      "agents",
                                      "approvals",
                                      "sessions",
                                      "stop",
                                      "approve",
                                      "deny",
                                      "claim",
                                      "recordings",
                                      "discovery",
                                      "openapi.json",
                                      "asyncapi.json",
                                      "thing-description.json",
                                      "types.d.ts",
                                      "test.fuzz.robdef",
                                      "subscriptions",
                                      "mcp",
                                      "serve",
                                      "docs",
                                      "index.html",
                                      "outside.txt",
                                      "page-secret",
                                      "..",
                                      ".",
                                      "",
                                      "%2e%2e",
                                      "%2f",
                                      "%00",
                                      "%",
                                      "Robot.part[a]",
                                      "part[a]",
                                      "lock",
                                      "lease",
                                      "metrics",
                                      "healthz",
                                      "readyz",
                                      "robot%20",
                                      "ROBOT",
                                      "number%2f..%2fsecret",
                                      ";x",
                                      "1",
                                      "-1"};
constexpr std::string_view bases[] = {"/api/v1/devices/robot/Robot/", "/api/v1/devices/robot/Robot/part/a/",
                                      "/api/v1/devices/"};
constexpr std::string_view queries[] = {
    "?as=mjpeg",   "?count=1",   "?offset=0&count=2",         "?service=Robot", "?nodename=robot",
    "?ticket=abc", "?key=1",     "?access_token=admin-token", "?generator=1",   "?a=%zz&&=",
    "?user=admin", "?format=csv"};
constexpr std::string_view lines[] = {"Accept: text/event-stream\r\n",
                                      "Accept: application/cbor\r\n",
                                      "Content-Type: application/cbor\r\n",
                                      "Content-Type: application/json\r\n",
                                      "Content-Type: text/plain\r\n",
                                      "If-None-Match: *\r\n",
                                      "Range: bytes=0-1\r\n",
                                      "Origin: http://evil.example\r\n",
                                      "Origin: http://localhost\r\n",
                                      "Sec-Fetch-Site: same-origin\r\n",
                                      "X-Forwarded-For: 192.0.2.1\r\n",
                                      "X-Forwarded-User: admin\r\n",
                                      "Forwarded: for=192.0.2.1;host=localhost\r\n",
                                      "X-HTTP-Method-Override: PUT\r\n",
                                      "Connection: close\r\n",
                                      "Expect: 100-continue\r\n",
                                      "Rrgate-Lease: 1\r\n",
                                      "Mcp-Session-Id: 1\r\n",
                                      "Accept: application/json, text/event-stream\r\n",
                                      "Last-Event-ID: 1\r\n",
                                      "Cookie: rrgate=admin\r\n",
                                      "Authorization: Basic YWRtaW46YWRtaW4=\r\n",
                                      "Access-Control-Request-Method: PUT\r\n",
                                      "MCP-Protocol-Version: 2025-06-18\r\n"};
constexpr std::string_view upgrades[] = {"rrgate.json.v1", "robotraconteur.robotraconteur.com", "rrgate.serve.v1"};
constexpr std::string_view bodies[] = {
    "",
    "1",
    "{}",
    "[]",
    R"({"n": 1})",
    R"("text")",
    "[1,2,3]",
    R"({"offset":[0],"value":[1]})",
    "null",
    "{\"n\": 1e99}",
    R"({"name":"agent","roles":["admin"]})",
    R"({"user":"admin","password":"x"})",
    R"({"token":"admin-token-"})",
    R"({"secret":"x"})",
    R"({"days":1,"roles":["admin"]})",
    R"({"allow":true})",
    R"({"device":"robot","service":"Robot"})",
    R"({"jsonrpc":"2.0","id":1,"method":"tools/call","params":{"name":"set","arguments":{"device":"robot","path":"Robot/number","value":7,"why":"x"}}})",
    R"({"jsonrpc":"2.0","id":1,"method":"tools/call","params":{"name":"call","arguments":{"device":"robot","path":"Robot/move","args":{"n":1},"why":"x"}}})",
    R"({"jsonrpc":"2.0","id":1,"method":"tools/call","params":{"name":"read","arguments":{"device":"robot","path":"Robot/secret"}}})",
    R"({"jsonrpc":"2.0","id":1,"method":"tools/list"})",
    R"({"jsonrpc":"2.0","id":1,"method":"initialize","params":{}})",
    R"({"jsonrpc":"2.0","id":1,"method":"tools/call","params":{"name":"stop","arguments":{"device":"robot","path":"Robot"}}})",
    R"({"jsonrpc":"2.0","id":1,"method":"resources/read","params":{"uri":"robot://robot/Robot"}})"};
constexpr std::string_view operations[] = {
    "describe", "get",    "set",   "call", "open",  "next", "close",  "abort", "subscribe", "unsubscribe", "send",
    "callback", "answer", "shape", "read", "write", "lock", "unlock", "lease", "renew",     "release",     "login"};
constexpr std::string_view places[] = {
    "number",  "secret",          "twice",   "move",          "count", "happened",      "ask",           "orders",
    "packets", "command",         "level",   "store",         "",      "part/a/number", "part/a/secret", "part/a/move",
    "part/a",  "../Robot/secret", "number/", "part[a]/number"};

struct Asked {
  const Asker* who = &askers[0];
  std::string method;
  std::string path;  ///< as it is sent, without its query
  std::string text;
  bool is_json_socket = false;
};

class Asking {
 public:
  Asking(Site& site, Choices choices) : site_(site), choices_(choices) {}

  void run() {
    for (int count = 0; count < 8 && !choices_.empty(); ++count) {
      const auto asked = make_request();
      const auto before = site_.robot.deeds;
      const auto items = site_.robot.store->items;
      ask(asked);
      check_device(asked, before, items);
    }
  }

 private:
  std::string make_path() {
    std::string out;
    const auto kind = choices_.byte();
    if (kind < 0x60) {
      const auto& route = site_.routes[choices_.byte() % site_.routes.size()];
      out = route.ends_with('*') ? route.substr(0, route.size() - 1) : route;
      if (!route.ends_with('*') && kind < 0x40) return out;
    } else if (kind < 0xc0) {
      out = bases[kind % std::size(bases)];
    } else {
      out = "/";
    }
    for (auto left = choices_.byte() % 5; left > 0; --left) {
      out += choices_.word(words);
      if (left > 1) out += '/';
    }
    // A target ends where a blank is, a line where it ends: neither is of the path.
    std::erase_if(out, [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '?' || c == '#'; });
    return out;
  }

  Asked make_request() {
    Asked out;
    out.who = &askers[choices_.byte() % std::size(askers)];
    out.method = methods[choices_.byte() % std::size(methods)];
    out.path = make_path();
    const auto extras = choices_.byte();
    auto target = out.path;
    if (extras & 1) target += choices_.word(queries);
    std::erase_if(target, [](char c) { return static_cast<unsigned char>(c) <= ' '; });
    std::string headers;
    if (!out.who->token.empty()) headers += "Authorization: Bearer " + std::string(out.who->token) + "\r\n";
    for (auto left = (extras >> 1) % 4; left > 0; --left) {
      const auto line = lines[choices_.byte() % std::size(lines)];
      // Two proofs: which one counts is not asked here.
      if (!line.starts_with("Authorization") || out.who->token.empty()) headers += line;
    }
    std::string body;
    if (extras & 0x20) {
      const auto protocol = upgrades[choices_.byte() % std::size(upgrades)];
      out.method = "GET";
      out.is_json_socket = protocol == upgrades[0];
      headers += "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n";
      headers +=
          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: " + std::string(protocol) + "\r\n";
    } else if (out.method != "GET" && out.method != "HEAD") {
      body = extras & 0x40 ? std::string(choices_.text(choices_.byte()))
                           : std::string(bodies[choices_.byte() % std::size(bodies)]);
      if (headers.find("Content-Type") == std::string::npos) headers += "Content-Type: application/json\r\n";
      headers += "Content-Length: " + std::to_string(body.size()) + "\r\n";
    }
    out.text = out.method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n" + body;
    return out;
  }

  void ask(const Asked& asked) {
    InsideClient client(site_.io, site_.gateway());
    client.send(asked.text);
    const auto is_over = [&] {
      const auto answer = read_answer(client.received(), asked.method);
      return client.has_ended() || answer.is_whole || (answer.status != 0 && answer.is_stream);
    };
    run_until(site_.io, std::chrono::milliseconds(300), is_over, 300);  // threads of the gateway may be at work
    settle(site_.io);
    const auto answer = read_answer(client.received(), asked.method);
    require(answer.status != 0 || client.has_ended(), "a request is answered");
    check(asked, answer);
    if (answer.status == 101 && asked.is_json_socket) talk(client);
    if (!asked.who->is_admin)
      require(client.received().find(secret_value) == std::string::npos, "who may not read it is not told");
    require(client.received().find(outside_value) == std::string::npos, "no file beside the page is served");
  }

  /// What is asked on a JSON socket.
  void talk(InsideClient& client) {
    for (auto left = choices_.byte() % 4; left > 0; --left) {
      std::string text = "{\"id\": 1, \"op\": \"" + std::string(operations[choices_.byte() % std::size(operations)]) +
                         "\", \"path\": \"";
      text += places[choices_.byte() % std::size(places)];
      text +=
          "\", \"value\": 1, \"args\": {\"n\": 1}, \"offset\": [0], \"count\": [1], \"generator\": 1, "
          "\"subscription\": 1}";
      if (choices_.byte() > 0xf0) text = choices_.text(choices_.byte());
      client.send(text_frame(text));
      settle(site_.io);
    }
  }

  /// Whether it is for everybody.
  static bool is_public(const Asked& asked) {
    const std::string_view path = asked.path;
    const bool is_look = asked.method == "GET" || asked.method == "HEAD";
    if (!path.starts_with("/api/") && !path.starts_with("/devices/") && path != "/mcp" && path != "/metrics")
      return true;
    if (asked.method == "OPTIONS") return true;
    if (is_look && (path == "/api/v1/access" || path == "/api/v1/openapi.json")) return true;
    // Lists have what one may see; check() holds them to that.
    if (is_look && (path == "/api/v1/devices" || path == "/api/v1/discovery" || path == "/api/v1/recordings"))
      return true;
    if (asked.method == "POST" && path.starts_with("/api/v1/access/requests")) return true;
    // What one has begun oneself, of which there is nothing.
    return asked.method == "DELETE" && (path == "/api/v1/session" || path == "/mcp");
  }

  static void check(const Asked& asked, const Answer& answer) {
    const auto status = answer.status;
    require(status != 500, "no request is answered by 500");
    const auto name = asked.who->name;
    const bool has_no_rights = !asked.who->is_known || name == "guest";
    const bool is_granted = status / 100 == 2 || (status == 101 && asked.is_json_socket);
    if (!has_no_rights || !is_granted) return;
    require(answer.body.find("\"robot\"") == std::string_view::npos, "who has no right is not told of the device");
    if (is_public(asked)) return;
    // Who has shown something may sign in with it.
    const bool is_for_known = asked.path == "/api/v1/session" || asked.path == "/api/v1/tickets";
    if (asked.who->is_known && is_for_known && asked.method == "POST") return;
    std::fprintf(stderr, "%.*s was answered %u: %s\n", static_cast<int>(name.size()), name.data(), status,
                 asked.text.c_str());
    require(false, "who has no right gets nothing");
  }

  void check_device(const Asked& asked, Deeds before, const std::vector<std::uint8_t>& items) {
    const auto name = asked.who->name;
    const bool is_agent = asked.path == "/mcp";
    auto& deeds = site_.robot.deeds;
    if (asked.who->is_admin && !is_agent) return;
    if (name == "caller" && !is_agent) before.twice = deeds.twice;
    if (name == "writer" && !is_agent) before.number = deeds.number;
    if (deeds == before && site_.robot.store->items == items) return;
    std::fprintf(stderr, "by %.*s: %s\n", static_cast<int>(name.size()), name.data(), asked.text.c_str());
    require(false, "nothing of the device is changed or called without a right to it");
  }

  Site& site_;
  Choices choices_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto& site = *new Site;  // it goes with the program
  const MemoryBound bound(size, 16u << 20, 64);
  Asking(site, {data, size}).run();
  return 0;
}
