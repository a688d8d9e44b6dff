// Rights are the same by every face of the gateway: what one grants, all grant; what one refuses, all refuse. By seed:
// random rules, users and strangers, all members and objects of a device, each by every way there is.
#include <atomic>
#include <catch2/catch.hpp>
#include <random>

#include "node/client/client.hpp"
#include "node/service/password_hash.hpp"
#include "node/tls/base64.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

const std::string definition = R"(service test.rights
stdver 0.10
struct Frame
  field uint32 width
  field uint32 height
  field string format
  field uint8[] data
end
object Part
  property int32 number
  function int32 twice(int32 n)
  function int32{generator} count()
  function void fence()
  event happened(int32 n)
  callback int32 ask(int32 n)
  pipe int32 packets
  pipe int32 orders [writeonly]
  wire int32 level
  wire int32 command [writeonly]
  wire Frame live [readonly]
  memory uint8[] store
  objref Part{string} part
end
)";

using PartPtr = std::shared_ptr<rr::Object>;

/// What was sent to the device so far, by what it was sent on.
struct Received {
  std::atomic<int> packets = 0;
  std::atomic<int> orders = 0;
  std::atomic<int> command = 0;
  std::atomic<rr::ClientId> client = 0;  ///< who called fence() last
};

template <class Part>
void fill(Part& part, const std::shared_ptr<rr::Service>& service, Received& received) {
  part.property("number").get([] { return 1; }).set([](std::int32_t) {});
  part.function("twice", [](std::int32_t n) { return 2 * n; });
  part.generator("count",
                 [] { return [n = 0]() mutable { return n < 3 ? std::optional<std::int32_t>(++n) : std::nullopt; }; });
  part.function("fence", [&received, service = service.get()] { received.client = service->current_client(); });
  part.pipe("packets").on_packet([&received](const rr::PipeEndpoint&, std::int32_t) { ++received.packets; });
  part.pipe("orders").on_packet([&received](const rr::PipeEndpoint&, std::int32_t) { ++received.orders; });
  part.on_wire("command", [&received](std::int32_t) { ++received.command; });
  part.on_wire("level", [](std::int32_t) {});
  part.set_wire("level", 5);
  part.set_wire("live", rr::Structure{"test.rights.Frame",
                                      {{"width", std::uint32_t{1}},
                                       {"height", std::uint32_t{1}},
                                       {"format", "mono8"},
                                       {"data", rr::Value(std::vector<std::uint8_t>{7})}}});
  const auto store = std::make_shared<rr::NumberMemory<std::uint8_t>>();
  store->dimensions = {2};
  store->items = {1, 2};
  part.memory("store", store);
}

/// A node with two services, "Robot" and "Other", of a root object and the parts "a" and "b".
struct Robot {
  Received received;
  std::map<std::string, PartPtr> parts;
  std::vector<std::shared_ptr<rr::Service>> services;
  rr::RunningNode node{[this](rr::Node& into) {
    for (const auto* name : {"Robot", "Other"}) {
      const auto service = rr::Service::from_text({definition}, name, "Part");
      fill(service->root(), service, received);
      parts[name] = service->root().shared_from_this();
      for (const auto* index : {"a", "b"}) {
        const auto part = service->make_object("Part");
        fill(*part, service, received);
        part->objref("part", [](std::string_view) { return PartPtr(); });
        parts[std::string(name) + ".part[" + index + "]"] = part;
      }
      service->objref("part", [this, name = std::string(name)](std::string_view index) {
        const auto found = parts.find(name + ".part[" + std::string(index) + "]");
        return found == parts.end() ? PartPtr() : found->second;
      });
      services.push_back(service);
      into.add(service);
    }
  }};
};

/// Something that is done to an object or a member, and what it takes.
struct Deed {
  std::string name;
  std::string member;
  std::vector<Verb> verbs;
};

const std::vector<Deed> deeds{
    {"look", "", {Verb::read}},
    {"get", "number", {Verb::read}},
    {"set", "number", {Verb::write}},
    {"call", "twice", {Verb::call}},
    {"generate", "count", {Verb::call}},
    {"hear", "happened", {Verb::subscribe}},
    {"answer", "ask", {Verb::subscribe}},
    {"follow pipe", "packets", {Verb::subscribe}},
    {"follow wire", "level", {Verb::subscribe}},
    {"watch", "live", {Verb::subscribe}},
    {"peek", "level", {Verb::read}},
    {"poke", "level", {Verb::write}},
    {"send pipe", "packets", {Verb::subscribe, Verb::write}},
    {"send pipe", "orders", {Verb::write}},
    {"send wire", "command", {Verb::write}},
    {"read", "store", {Verb::read}},
    {"write", "store", {Verb::write}},
    {"measure", "store", {Verb::read}},
    {"lock", "", {Verb::lock}},
};

/// nullopt: the face has no way to do so.
using Outcome = std::optional<bool>;

struct Door {
  virtual ~Door() = default;
  virtual Outcome does(const Deed& deed, const std::string& path) = 0;
};

struct Login {
  std::string role;
  std::string user;  ///< empty: nobody

  std::string header() const {
    if (user.empty()) return {};
    const auto pair = user + ":secret";
    return "Authorization: Basic " + rr::encode_base64(rr::as_bytes(pair)) + "\r\n";
  }
};

/// Whether `work` is done; false where there is no right to it. Every other error is thrown on.
template <class F>
bool is_granted(F&& work) {
  try {
    work();
  } catch (const rr::Exception& exception) {
    const auto code = exception.error().code;
    if (code == rr::ErrorCode::permission_denied || code == rr::ErrorCode::authentication_error) return false;
    throw;
  }
  return true;
}

constexpr std::chrono::seconds patience{10};

/// A Robot Raconteur client of service "Robot".
class SessionDoor final : public Door {
 public:
  SessionDoor(Robot& robot, rr::RemoteObject root) : robot_(robot), root_(std::move(root)) {}

  Outcome does(const Deed& deed, const std::string& path) override {
    bool done = true;
    const bool was_let = is_granted([&] { done = try_it(deed, object(path)); });
    return was_let && done;
  }

 private:
  rr::RemoteObject object(const std::string& path) const {
    const auto open = path.find('[');
    return open == std::string::npos ? root_ : root_.object("part", path.substr(open + 1, path.find(']') - open - 1));
  }
  bool try_it(const Deed& deed, const rr::RemoteObject& at) {
    const auto& member = deed.member;
    if (deed.name == "get") at.get(member);
    if (deed.name == "set") at.set(member, 2);
    if (deed.name == "call") at.call(member, 4);
    if (deed.name == "generate") return at.generator(member).next().has_value();
    if (deed.name == "follow pipe") at.connect_pipe(member, [](const rr::Value&) {}).close();
    if (deed.name == "follow wire" || deed.name == "watch") {
      at.connect_wire(member, [](const rr::Value&, rr::TimeSpec) {});
      at.disconnect_wire(member);
    }
    if (deed.name == "peek") at.peek_in(member);
    if (deed.name == "poke") at.poke_out(member, 3);
    if (deed.name == "read") at.memory(member).read({0}, {1});
    if (deed.name == "write")
      at.connection().wait_for([&](rr::ClientConnection& connection, auto done) {
        connection.write_memory(at.path(), member, rr::MemoryShape{0}, rr::Value(std::vector<std::uint8_t>{9}),
                                std::move(done));
      });
    if (deed.name == "measure") at.memory(member).dimensions();
    if (deed.name == "lock") lock(at);
    if (deed.name == "hear") return hears(at);
    if (deed.name == "answer") return answers(at);
    if (deed.name == "send pipe") {
      auto& count = member == "orders" ? robot_.received.orders : robot_.received.packets;
      const auto before = count.load();
      const auto endpoint = at.connect_pipe(member, [](const rr::Value&) {});
      is_granted([&] { endpoint.send(1); });
      root_.call("fence");
      const bool has_come = count != before;
      if (endpoint.is_open()) endpoint.close();
      return has_come;
    }
    if (deed.name == "send wire") {
      const auto before = robot_.received.command.load();
      at.connect_wire(member, [](const rr::Value&, rr::TimeSpec) {});
      at.send_wire(member, 1);
      root_.call("fence");
      at.disconnect_wire(member);
      return robot_.received.command != before;
    }
    return true;
  }
  /// A service without users has no locks: the device's refusal is none of the gateway.
  static void lock(const rr::RemoteObject& at) {
    try {
      at.lock();
      at.unlock();
    } catch (const rr::Exception& exception) {
      if (exception.error().code != rr::ErrorCode::invalid_operation) throw;
    }
  }
  /// The answer to fence() comes behind all that the device has said before.
  bool hears(const rr::RemoteObject& at) {
    bool has_heard = false;
    const auto registration = at.on_event("happened", [&](std::span<const rr::Value>) { has_heard = true; });
    robot_.node.ask([&](rr::Node&) { return robot_.parts.at(at.path())->fire("happened", 1), 0; });
    root_.call("fence");
    at.connection().run_for(std::chrono::milliseconds(0));
    return has_heard;
  }
  bool answers(const rr::RemoteObject& at) {
    at.on_callback("ask", [](std::int32_t n) { return n + 1; });
    root_.call("fence");
    std::atomic<int> answer = -1;
    robot_.node.ask([&](rr::Node&) {
      robot_.parts.at(at.path())->call_callback(
          robot_.received.client, "ask", {1},
          [&](const rr::Result<rr::Value>& result) { answer = result ? result->to<std::int32_t>().value() : 0; });
      return 0;
    });
    // The device hears it on a thread of its own.
    const auto give_up = std::chrono::steady_clock::now() + patience;
    while (answer == -1 && std::chrono::steady_clock::now() < give_up)
      at.connection().run_for(std::chrono::milliseconds(1));
    REQUIRE(answer != -1);
    return answer == 2;
  }

  Robot& robot_;
  rr::RemoteObject root_;
};

std::string url_path(const std::string& path) {
  const auto open = path.find('[');
  return open == std::string::npos ? "" : "/part/" + path.substr(open + 1, path.find(']') - open - 1);
}

/// REST, event streams and image streams.
class HttpDoor final : public Door {
 public:
  HttpDoor(std::uint16_t port, const Login& login) : port_(port), login_(login) {}

  Outcome does(const Deed& deed, const std::string& path) override {
    const auto target = "/api/v1/devices/robot/Robot" + url_path(path) + (deed.member.empty() ? "" : "/" + deed.member);
    const std::string events = "Accept: text/event-stream\r\n";
    if (deed.name == "look" || deed.name == "get") return ask("GET", target);
    if (deed.name == "peek") {
      const auto plain = ask("GET", target);
      CHECK(ask("GET", target + "?as=mjpeg") == plain);  // no images: one value
      return plain;
    }
    if (deed.name == "read") return ask("GET", target + "?count=1");
    if (deed.name == "measure") return ask("GET", target + "/shape");
    if (deed.name == "set" || deed.name == "poke") return ask("PUT", target, "7");
    if (deed.name == "write") return ask("PUT", target, "[7]");
    if (deed.name == "call") return ask("POST", target, R"({"n": 4})");
    if (deed.name == "generate") return ask("POST", target, "{}");
    if (deed.name == "hear" || deed.name == "follow pipe" || deed.name == "follow wire")
      return ask("GET", target, "", events);
    if (deed.name == "watch") return ask("GET", target + "?as=mjpeg");
    return std::nullopt;
  }
  /// Whether the answer is no refusal.
  bool ask(const std::string& method, const std::string& target, const std::string& body = {},
           const std::string& lines = {}) const {
    return answer(method, target, body, lines).status / 100 == 2;
  }
  TestClient::HttpResponse answer(const std::string& method, const std::string& target, const std::string& body = {},
                                  const std::string& lines = {}, bool has_body = false) const {
    TestClient client(port_);
    const auto length = "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
    client.send(method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" + login_.header() + lines +
                (body.empty() ? "" : length) + "\r\n" + body);
    auto response = client.receive_response(has_body);
    INFO(method << " " << target << ": " << response.head);
    const bool is_refused = response.status == 401 || response.status == 403;
    REQUIRE((is_refused || response.status / 100 == 2));
    return response;
  }

 private:
  std::uint16_t port_;
  Login login_;
};

/// JSON over a WebSocket.
class JsonDoor final : public Door {
 public:
  JsonDoor(std::uint16_t port, const Login& login, Robot& robot) : client_(port), robot_(robot) {
    REQUIRE(open(client_, login, "Robot") == 101);
  }
  static unsigned open(TestClient& client, const Login& login, const std::string& service) {
    return client
        .upgrade("/api/v1/devices/robot/" + service, "Sec-WebSocket-Protocol: rrgate.json.v1\r\n" + login.header())
        .status;
  }

  Outcome does(const Deed& deed, const std::string& path) override {
    auto at = url_path(path);
    if (!at.empty()) at.erase(0, 1);
    if (!deed.member.empty()) at += (at.empty() ? "" : "/") + deed.member;
    const auto& name = deed.name;
    if (name == "look") return ask({{"op", "describe"}, {"path", at}});
    if (name == "get" || name == "peek") return ask({{"op", "get"}, {"path", at}});
    if (name == "set" || name == "poke") return ask({{"op", "set"}, {"path", at}, {"value", 7}});
    if (name == "measure") return ask({{"op", "shape"}, {"path", at}});
    if (name == "call") return ask({{"op", "call"}, {"path", at}, {"args", {{"n", 4}}}});
    if (name == "read") return ask({{"op", "read"}, {"path", at}, {"offset", {0}}, {"count", {1}}});
    if (name == "write") return ask({{"op", "write"}, {"path", at}, {"offset", {0}}, {"value", {7}}});
    if (name == "generate") {
      const bool is_open = ask({{"op", "open"}, {"path", at}});
      if (is_open) CHECK(ask({{"op", "next"}, {"generator", last_}}));
      return is_open;
    }
    if (name == "hear" || name == "follow pipe" || name == "follow wire" || name == "watch" || name == "answer") {
      const bool is_open = ask({{"op", name == "answer" ? "callback" : "subscribe"}, {"path", at}});
      if (is_open) CHECK(ask({{"op", "unsubscribe"}, {"subscription", last_}}));
      return is_open;
    }
    if (name == "lock") {
      return ask({{"op", "lock"}, {"path", at}});
    }
    // Sent on a wire or a pipe.
    auto& count = deed.member == "orders"    ? robot_.received.orders
                  : deed.member == "command" ? robot_.received.command
                                             : robot_.received.packets;
    const auto before = count.load();
    const bool is_sent = ask({{"op", "send"}, {"path", at}, {"value", 1}});
    CHECK(ask({{"op", "call"}, {"path", "fence"}}));
    CHECK((count != before) == is_sent);
    return is_sent;
  }

 private:
  bool ask(nlohmann::json request) {
    request["id"] = ++number_;
    last_ = number_;
    const auto text = request.dump();
    client_.send_frame(0x1, rr::as_bytes(text));
    for (;;) {
      const auto frame = client_.receive_frame();
      const auto answer = nlohmann::json::parse(frame.payload.begin(), frame.payload.end());
      if (answer.value("id", 0) != number_) continue;
      if (!answer.contains("error")) return true;
      INFO(text << ": " << answer.dump());
      const std::string name = answer["error"]["name"];
      if (request["op"] == "lock" && name == "RobotRaconteur.InvalidOperation") return true;
      REQUIRE((name == "RobotRaconteur.PermissionDenied" || name == "RobotRaconteur.AuthenticationError"));
      return false;
    }
  }

  TestClient client_;
  Robot& robot_;
  int number_ = 0;
  int last_ = 0;
};

/// The Model Context Protocol.
class McpDoor final : public Door {
 public:
  McpDoor(std::uint16_t port, const Login& login) : port_(port), login_(login) {}

  Outcome does(const Deed& deed, const std::string& path) override {
    const auto at = "Robot" + url_path(path) + (deed.member.empty() ? "" : "/" + deed.member);
    const auto& name = deed.name;
    if (name == "look") return tool("describe", {{"path", at}});
    if (name == "get" || name == "peek") return tool("read", {{"path", at}});
    if (name == "read") return tool("read", {{"path", at}, {"offset", {0}}, {"count", {1}}});
    if (name == "set") return tool("set", {{"path", at}, {"value", 7}, {"why", ""}});
    if (name == "call") return tool("call", {{"path", at}, {"args", {{"n", 4}}}, {"why", ""}});
    if (name == "hear" || name == "follow pipe") return tool("wait_for_event", {{"path", at}, {"seconds", 0.01}});
    return std::nullopt;
  }

 private:
  bool tool(const std::string& name, nlohmann::json arguments) const {
    arguments["device"] = "robot";
    const nlohmann::json request{{"jsonrpc", "2.0"},
                                 {"id", 1},
                                 {"method", "tools/call"},
                                 {"params", {{"name", name}, {"arguments", arguments}}}};
    const auto body = request.dump();
    TestClient client(port_);
    client.send("POST /mcp HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: " +
                std::to_string(body.size()) + "\r\n" + login_.header() + "\r\n" + body);
    auto response = client.receive_response();
    const bool is_stream = response.status == 200 && response.head.find("text/event-stream") != std::string::npos;
    if (is_stream) response.body = client.receive_until("\r\n0\r\n\r\n");  // it had to wait
    INFO(body << ": " << response.head << response.body);
    if (response.status == 401 || response.status == 403) return false;
    REQUIRE(response.status == 200);
    const auto begin = response.body.find('{');
    const auto end = response.body.rfind('}');
    REQUIRE(end != std::string::npos);
    const auto result = nlohmann::json::parse(response.body.substr(begin, end + 1 - begin))["result"];
    if (result["isError"] == false) return true;
    const std::string error = result["structuredContent"]["error"]["name"];
    REQUIRE((error == "RobotRaconteur.PermissionDenied" || error == "RobotRaconteur.AuthenticationError"));
    return false;
  }

  std::uint16_t port_;
  Login login_;
};

class RandomRules {
 public:
  explicit RandomRules(unsigned seed) : random_(seed) {}

  std::vector<AccessRule> rules() {
    // For everybody, so that there is a session in which all else may be refused.
    std::vector<AccessRule> out{{.roles = {"*", "guest"},
                                 .devices = {"robot"},
                                 .services = {"Robot"},
                                 .paths = {"Robot"},
                                 .members = {"fence"},
                                 .may = {Verb::call}}};
    for (std::size_t count = 3 + pick(4); count > 0; --count) {
      AccessRule rule;
      rule.roles = some({"viewer", "operator", "guest", "*"}, 2);
      rule.devices = some({"robot", "raw", "gate*", "*"}, 3);
      rule.services = some({"Robot", "O*", "gateway", "*"}, 3);
      rule.paths = some({"Robot", "Robot.*", "*[[]a]", "Robot.part[?]", "*.part[b]", "Oth*"}, 3);
      rule.members = some({"", "number", "t*", "*e*", "packets", "level", "orders", "[a-k]*", "*s*"}, 3);
      for (const auto verb : device_verbs)
        if (pick(2)) rule.may.push_back(verb);
      if (pick(3) == 0) {  // what agents read, all others read too
        rule.agent = AgentTerms{.needs_approval = false, .needs_lease = false};
        std::erase_if(rule.may, [](Verb verb) { return verb == Verb::read || verb == Verb::subscribe; });
      }
      out.push_back(std::move(rule));
    }
    for (const auto verb : {Verb::metrics, Verb::admin})
      out.push_back({.roles = some({"viewer", "operator", "guest"}, 3), .may = {verb}});
    return out;
  }

 private:
  std::size_t pick(std::size_t below) { return random_() % below; }
  /// One of so many; none is everything.
  std::vector<std::string> some(const std::vector<std::string>& from, std::size_t one_of) {
    std::vector<std::string> out;
    for (const auto& each : from)
      if (pick(one_of) == 0) out.push_back(each);
    return out;
  }

  std::mt19937 random_;
};

struct Site {
  Robot robot;
  Folder files;
  std::vector<AccessRule> rules;
  TestGateway gateway;

  explicit Site(std::vector<AccessRule> its_rules)
      : rules(std::move(its_rules)), gateway(0, [this](Config& config) {
          const auto line = [](const std::string& name) {
            const auto hash = rr::PasswordHash::make_scrypt("secret", {.ln = 4}).value().text();
            return name + " " + hash + " " + name + "\n";
          };
          config.access.users_file = files.write("users", line("viewer") + line("operator"));
          config.access.anonymous_role = "guest";
          config.access.rules = rules;
          config.mcp.is_enabled = true;
          for (const auto* name : {"robot", "raw"}) {
            DeviceConfig device;
            device.name = name;
            device.url = rr::parse_url(robot.node.url("Robot")).value();
            device.mode = device.name == "robot" ? DeviceMode::shared : DeviceMode::relay;
            config.devices.push_back(std::move(device));
          }
        }) {}

  std::string native_url(const std::string& service) const {
    return "rr+tcp://127.0.0.1:" + std::to_string(gateway.port()) +
           "/?nodename=" + (service == "gateway" ? "rrgate" : "robot") + "&service=" + service;
  }
  std::string websocket_url(const std::string& service) const {
    return "rr+ws://127.0.0.1:" + std::to_string(gateway.port()) + (service == "gateway" ? "/" : "/devices/robot") +
           "?service=" + service;
  }
};

rr::RemoteObject connect_as(const Login& login, const std::string& url) {
  return login.user.empty() ? rr::connect(url) : rr::connect(url, login.user, "secret");
}

/// What the gateway tells somebody about his rights, against the rules.
void check_told_rights(const HttpDoor& http, const AccessRules& rules, const Identity& who) {
  const auto told = nlohmann::json::parse(http.answer("GET", "/api/v1/access", {}, {}, true).body);
  auto may = nlohmann::json::array();
  for (const auto verb : {Verb::metrics, Verb::admin})
    if (rules.check(who, {.verb = verb})) may.push_back(to_string(verb));
  CHECK(told["may"] == may);
  for (const std::string device : {"robot", "raw"}) {
    INFO(device << ": " << told.dump());
    CHECK(told["devices"].contains(device) == rules.sees(who, device));
    if (!told["devices"].contains(device)) continue;
    for (const auto verb : device_verbs) {
      const auto extent = told["devices"][device].value(std::string(to_string(verb)), "none");
      CHECK(extent == to_string(rules.extent(who, device, verb)));
    }
  }
}

}  // namespace

TEST_CASE("rights are the same by every face: what one grants all grant, what one refuses all refuse") {
  const auto seed = GENERATE(range(1u, 13u));
  INFO("seed " << seed);
  Site site(RandomRules(seed).rules());
  const AccessRules rules(site.rules, true);
  const auto port = site.gateway.port();
  for (const Login& login : {Login{"viewer", "viewer"}, Login{"operator", "operator"}, Login{"guest", ""}}) {
    INFO("as " << login.role);
    Identity who;
    who.name = login.user;
    who.roles = {login.role};
    who.proof = login.user.empty() ? Proof::none : Proof::password;
    const HttpDoor http(port, login);

    // Services: whether there is a session, and whether they are told of.
    for (const std::string service : {"Robot", "Other", "gateway"}) {
      const std::string device = service == "gateway" ? "gateway" : "robot";
      const bool sees = rules.sees(who, device, service);
      INFO(service << (sees ? " may" : " may not") << " be used");
      CHECK(is_granted([&] { connect_as(login, site.websocket_url(service)); }) == sees);
      CHECK(is_granted([&] { connect_as(login, site.native_url(service)); }) == sees);
      if (service == "gateway") continue;
      CHECK(http.ask("GET", "/api/v1/devices/robot/" + service) == sees);
      TestClient socket(port);
      CHECK((JsonDoor::open(socket, login, service) == 101) == sees);
    }
    // The gateway itself.
    check_told_rights(http, rules, who);
    const bool is_admin = rules.check(who, {.verb = Verb::admin}).has_value();
    for (const auto* target : {"/api/v1/audit", "/api/v1/audit?user=root", "/api/v1/access/requests",
                               "/api/v1/agents/approvals", "/api/v1/agents/sessions"})
      CHECK(http.ask("GET", target) == is_admin);
    CHECK(http.ask("GET", "/metrics") == rules.check(who, {.verb = Verb::metrics}).has_value());
    // A device whose bytes pass unread.
    TestClient relayed(port);
    const auto status = relayed.upgrade("/devices/raw", login.header()).status;
    CHECK((status == 101) == rules.check_whole_device(who, "raw").has_value());

    // Members and objects, one face after the other: callbacks are for the one client that can answer.
    const auto walk = [&](const char* name, Door& face, Face by = Face::none) {
      auto asker = who;
      asker.face = by;
      for (const std::string path : {"Robot", "Robot.part[a]", "Robot.part[b]"})
        for (const auto& deed : deeds) {
          const bool expected = std::all_of(deed.verbs.begin(), deed.verbs.end(), [&](Verb verb) {
            return rules.check(asker, {"robot", "Robot", path, deed.member, verb, deed.name == "measure"}).has_value();
          });
          INFO(name << ": " << deed.name << " " << deed.member << " of " << path);
          const auto outcome = face.does(deed, path);
          if (outcome) CHECK(*outcome == expected);
        }
    };
    {
      SessionDoor native(site.robot, connect_as(login, site.native_url("Robot")));
      walk("native", native);
    }
    {
      SessionDoor websocket(site.robot, connect_as(login, site.websocket_url("Robot")));
      walk("WebSocket", websocket);
    }
    HttpDoor rest(port, login);
    walk("HTTP", rest);
    JsonDoor json(port, login, site.robot);
    walk("JSON", json);
    McpDoor mcp(port, login);
    walk("MCP", mcp, Face::mcp);
  }
}
