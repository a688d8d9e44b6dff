#include "server/config/config.hpp"
#include "server/config/cautions.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

using namespace rrgate;

namespace {

constexpr std::string_view smallest =
    R"({"listen": ["127.0.0.1:8080"], "devices": [{"name": "create", "url": "rr+tcp://127.0.0.1:52222/?service=Create"}]})";

std::vector<std::string> findings_of(std::string_view text) {
  std::vector<std::string> out;
  for (const auto& finding : parse_config(text).findings) out.push_back(format_finding("gateway.json", finding));
  return out;
}

/// One finding, that begins and continues so.
void finds(std::string_view text, const std::string& begin, const std::string& contains = {}) {
  const auto findings = findings_of(text);
  INFO(text);
  REQUIRE(findings.size() == 1);
  CHECK_THAT(findings[0], Catch::StartsWith(begin));
  CHECK_THAT(findings[0], Catch::Contains(contains));
}

std::string with(std::string_view more) {
  return R"({"listen": ["127.0.0.1:0"], "devices": [], )" + std::string(more) + "}";
}

std::string with_device(std::string_view device) {
  return R"({"listen": ["127.0.0.1:0"], "devices": [)" + std::string(device) + "]}";
}

const std::filesystem::path config_folder = RRGATE_CONFIG_DIR;

/// The schema's options as the parser would list them.
void list_schema(const nlohmann::json& schema, const std::string& path, bool is_required,
                 std::vector<OptionInfo>& options) {
  if (!path.empty()) {
    OptionInfo info;
    info.path = path;
    info.type = schema.value("type", "any");
    info.is_required = is_required;
    if (schema.contains("minimum")) info.minimum = schema["minimum"];
    if (schema.contains("maximum")) info.maximum = schema["maximum"];
    if (schema.contains("enum")) info.choices = schema["enum"].get<std::vector<std::string>>();
    if (schema.contains("default")) info.default_value = schema["default"].dump();
    options.push_back(std::move(info));
  }
  if (schema.contains("items")) list_schema(schema["items"], path + "/*", false, options);
  if (!schema.contains("properties")) return;
  INFO(path);
  CHECK(schema.at("additionalProperties") == false);
  const auto required = schema.value("required", std::vector<std::string>());
  for (const auto& [key, member] : schema["properties"].items())
    list_schema(member, path + "/" + key, std::find(required.begin(), required.end(), key) != required.end(), options);
}

}  // namespace

TEST_CASE("certificates, and how devices are checked") {
  const auto parsed = parse_config(
      R"({"listen": ["127.0.0.1:0"], "devices": [{"name": "a", "url": "rrs+tcp://h:1/?service=s", "tls": {"ca": ["x"]}}],
          "tls": {"certificates": [{"cert": "c", "key": "k"}], "hsts_seconds": 7}})");
  REQUIRE(parsed.findings.empty());
  CHECK(parsed.config.tls.certificates == std::vector<rr::WebCertificate>{{"c", "k"}});
  CHECK(parsed.config.tls.hsts_seconds == 7);
  CHECK(parsed.config.devices[0].tls.ca == std::vector<std::string>{"x"});
  finds(with(R"("tls": {"certificates": [{"cert": "c", "key": ""}]})"),
        "gateway.json: /tls/certificates/0/key: ", "empty");
  finds(with(R"("tls": {"certificates": [{"cert": "c"}]})"), "gateway.json: /tls/certificates/0/key: ");
  finds(with(R"("tls": {"certificate": []})"), "gateway.json: /tls/certificate: ");
  finds(with(R"("tls": {"required": true})"), "gateway.json: /tls/required: ", "expected tls.certificates");
  CHECK(findings_of(with(R"("tls": {"required": true}, "trusted_proxies": ["127.0.0.1"])")).empty());
}

TEST_CASE("recordings: a folder, and what is recorded") {
  finds(with(R"("recordings": {})"), "gateway.json: /recordings/folder: ", "missing");
  finds(with(R"("recordings": {"folder": ""})"), "gateway.json: /recordings/folder: ", "empty");
  finds(with(R"("recordings": {"folder": "f", "record": [{"device": "a"}]})"),
        "gateway.json: /recordings/record/0/service: ", "missing");
  finds(with(R"("recordings": {"folder": "f", "record": [{"device": "a", "service": "s", "kept_files": 2}]})"),
        "gateway.json: /recordings/record/0/kept_files: ", "max_file_bytes");
}

TEST_CASE("leases: what a device needs, and what makes it safe") {
  const auto leases = [](const std::string& text, const std::string& mode = "shared") {
    return R"({"listen": ["127.0.0.1:0"], "devices": [{"name": "a", "url": "rr+tcp://h:1/?service=s", "mode": ")" +
           mode + R"(", "leases": )" + text + "}]}";
  };
  CHECK(findings_of(leases("{}")).empty());
  finds(leases("{}", "relay"), "gateway.json: /devices/0/leases: ", "\"mode\": \"shared\"");
  finds(leases(R"({"safe": [{}]})"), "gateway.json: /devices/0/leases/safe/0/call: ", "one of call, wire and property");
  finds(leases(R"({"safe": [{"call": "s.Stop", "wire": "s.v", "value": 1}]})"),
        "gateway.json: /devices/0/leases/safe/0/call: ");
  finds(leases(R"({"safe": [{"call": "Stop"}]})"), "gateway.json: /devices/0/leases/safe/0/call: ", "path.member");
  finds(leases(R"({"safe": [{"call": "s.Stop", "value": 1}]})"), "gateway.json: /devices/0/leases/safe/0/value: ");
  finds(leases(R"({"safe": [{"wire": "s.v"}]})"), "gateway.json: /devices/0/leases/safe/0/value: ", "missing");
  finds(leases(R"({"safe": [{"call": "s.Stop", "arguments": 1}]})"),
        "gateway.json: /devices/0/leases/safe/0/arguments: ");
  finds(leases(R"({"members": [{"member": "*", "lease": "yes"}]})"),
        "gateway.json: /devices/0/leases/members/0/lease: ", "required, covered, never");
}

TEST_CASE("pages that are devices") {
  CHECK_FALSE(parse_config(with(R"("insecure": false)")).config.serve.is_enabled);
  CHECK(parse_config(with(R"("serve": {})")).config.serve == ServeConfig{true, 16, DeviceMode::shared});
  CHECK(parse_config(with(R"("serve": {"max_devices": 3, "mode": "relay"})")).config.serve ==
        ServeConfig{true, 3, DeviceMode::relay});
  finds(with(R"("serve": {"max_devices": 0})"), "gateway.json: /serve/max_devices: ", "expected");
}

TEST_CASE("who may do what") {
  const auto parsed = parse_config(R"({
    "listen": ["127.0.0.1:0"], "devices": [], "trusted_proxies": ["127.0.0.1"],
    "tls": {"certificates": [{"cert": "c", "key": "k"}]},
    "access": {
      "users_file": "users", "tokens_file": "tokens", "client_ca": ["ca.pem"], "anonymous_role": "guest",
      "jwt": {"jwks_file": "keys", "issuer": "i", "audience": "a", "user_claim": "u", "roles_claim": "r"},
      "identity_headers": {"user": "X-User", "roles": "X-Roles"}, "audit_file": "audit",
      "grants": [{"users": ["*@lab"], "roles": ["viewer"]}],
      "rules": [{"roles": ["*"], "devices": ["a"], "services": ["s"], "paths": ["s.*"], "members": [""],
                 "may": ["read", "lock"]},
                {"roles": ["ops"], "may": ["metrics", "admin"]},
                {"roles": ["staff"], "devices": ["phone-*"], "may": ["serve"]}]}})");
  REQUIRE(parsed.findings.empty());
  const auto& access = parsed.config.access;
  CHECK(access.users_file == "users");
  CHECK(access.jwt == JwtConfig{"keys", "", {"i", "a", "u", "r"}});
  CHECK(access.identity_headers == IdentityHeaders{"X-User", "X-Roles"});
  CHECK(access.anonymous_role == "guest");
  CHECK(access.grants == std::vector<RoleGrant>{{{"*@lab"}, {"viewer"}}});
  CHECK(access.rules == std::vector<AccessRule>{{{"*"}, {"a"}, {"s"}, {"s.*"}, {""}, {Verb::read, Verb::lock}},
                                                {{"ops"}, {}, {}, {}, {}, {Verb::metrics, Verb::admin}},
                                                {{"staff"}, {"phone-*"}, {}, {}, {}, {Verb::serve}}});
  CHECK(access.audit.file == "audit");
  CHECK(access.has_users());
  const auto audit =
      parse_config(with(R"("audit": {"file": "a", "max_bytes": 1000, "keep": 3, "fsync": true, "fail_closed": true})"));
  CHECK(audit.config.access.audit == AuditConfig{"a", 1000, 3, true, true});
  finds(with(R"("audit": {"file": "a"}, "access": {"audit_file": "b"})"),
        "gateway.json: /access/audit_file: ", "expected one of the two");
  const auto access_finds = [](const std::string& part, const std::string& path, const std::string& contains) {
    finds(with(R"("access": {)" + part + "}"), "gateway.json: /access" + path + ": ", contains);
  };
  access_finds(R"("rules": [{"roles": ["a"], "may": ["reed"]}])", "/rules/0/may/0", "expected one of");
  access_finds(R"("rules": [{"roles": ["a"], "devices": ["d"], "may": ["admin"]}])", "/rules/0/may",
               "names no devices");
  access_finds(R"("rules": [{"roles": ["a"], "paths": ["s"], "may": ["serve"]}])", "/rules/0/may",
               "names no services, paths or members");
  const std::string agent = R"("rules": [{"roles": ["a"], "may": ["call"], "agent": )";
  access_finds(agent + R"({"limits": {"v": 3}}}])", "/rules/0/agent/limits/v", "[LEAST, MOST]");
  access_finds(agent + R"({"limits": {"v": [1, 0]}}}])", "/rules/0/agent/limits/v", "[LEAST, MOST]");
  access_finds(agent + R"({"limits": {"v": ["1", 2]}}}])", "/rules/0/agent/limits/v", "[LEAST, MOST]");
  access_finds(agent + R"({"approval": "never"}}])", "/rules/0/agent/approval", "expected one of");
  access_finds(R"("rules": [{"roles": ["a"], "may": ["lock"], "agent": {}}])", "/rules/0/may", "agent");
  access_finds(R"("rules": [{"may": ["read"]}])", "/rules/0/roles", "missing");
  access_finds(R"("rules": [{"roles": ["a b"], "may": ["read"]}])", "/rules/0/roles/0", "role");
  access_finds(R"("rules": [{"roles": ["a"], "devices": ["d"], "may": ["admin"]}])", "/rules/0/may", "as a whole");
  access_finds(R"("jwt": {})", "/jwt/jwks_file", "either");
  access_finds(R"("jwt": {"jwks_file": "a", "secret_file": "b"})", "/jwt/jwks_file", "either");
  access_finds(R"("jwt": {"jwks_file": "a", "discover": true, "issuer": "https://i"})", "/jwt/jwks_file", "either");
  access_finds(R"("jwt": {"discover": true, "issuer": "http://i"})", "/jwt/issuer", "https://");
  access_finds(R"("jwt": {"jwks_file": "a", "ca": ["b"]})", "/jwt/ca", "discover");
  access_finds(R"("identity_headers": {"user": "X-User"})", "/identity_headers", "trusted_proxies");
  access_finds(R"("client_ca": ["ca.pem"])", "/client_ca", "tls.certificates");
  access_finds(R"("anonymous_role": "guest")", "/anonymous_role", "rules");
}

TEST_CASE("what may not be meant is no mistake, but is told") {
  const auto cautions = [](const std::string& more, const std::string& devices = "") {
    const auto parsed = parse_config(R"({"listen": ["127.0.0.1:0"], "devices": [)" + devices + "]" + more + "}");
    CHECK(parsed.findings.empty());
    std::string out;
    for (const auto& caution : find_cautions(parsed.config)) out += caution.path + " ";
    return out;
  };
  const std::string jwt = R"(, "access": {"jwt": {"jwks_file": "k")";
  CHECK(cautions("").empty());
  CHECK(cautions(jwt + "}}") == "/access/jwt/issuer /access/jwt/audience ");
  CHECK(cautions(jwt + R"(, "issuer": "i"}})") == "/access/jwt/audience ");
  CHECK(cautions(jwt + R"(, "issuer": "i", "audience": "a"}})").empty());
  const std::string plain = R"({"name": "a", "url": "rr+tcp://h:1/?service=s"})";
  const std::string by_tls = R"({"name": "b", "url": "rrs+tcp://h:1/?nodename=n&service=s"})";
  const std::string by_id =
      R"({"name": "c", "url": "rrs+tcp://h:1/?nodeid=82301bf1-e1ef-4e89-8d8f-0848291587ac&service=s"})";
  CHECK(cautions("", plain + "," + by_tls + "," + by_id) == "/devices/1/url ");
  const std::string audit = R"(, "audit": {"file": "a"})";
  CHECK(cautions("", plain).empty());
  CHECK(cautions(audit, R"({"name": "d", "url": "rr+tcp://h:1/?service=s", "mode": "shared"},)" + plain) ==
        "/devices/1/mode ");
  CHECK(cautions(audit + R"(, "discover": {})") == "/discover/mode ");
  CHECK(cautions(audit + R"(, "discover": {"mode": "shared"})").empty());
  const std::string proxies = R"(, "trusted_proxies": ["127.0.0.1"])";
  CHECK(cautions(proxies) == "/access/rules ");
  CHECK(cautions(proxies + R"(, "access": {"rules": [{"roles": ["a"], "may": ["read"]}]})").empty());
  const std::string tls = R"(, "access": {"users_file": "u"}, "tls": {"certificates": [{"cert": "c", "key": "k"}])";
  const auto agents = [&](const std::string& rule) {
    return cautions(R"(, "access": {"tokens_file": "t", "rules": [)" + rule +
                    R"({"roles": ["agent"], "may": ["call"], "agent": {}}]}, "mcp": {})");
  };
  CHECK(agents("").empty());
  CHECK(agents(R"({"roles": ["agent", "*"], "may": ["read", "subscribe"]},)").empty());
  CHECK(agents(R"({"roles": ["operator"], "may": ["call"]},)").empty());
  CHECK(agents(R"({"roles": ["agent"], "may": ["call"]},)") == "/access/rules/0/may ");
  CHECK(agents(R"({"roles": ["*"], "may": ["admin"]},)") == "/access/rules/0/may ");
  CHECK(cautions(R"(, "access": {"tokens_file": "t"}, "mcp": {})") == "/access/rules ");
  CHECK(cautions(tls + "}") == "/tls/required ");
  CHECK(cautions(tls + R"(, "required": true})").empty());
}

TEST_CASE("who lets other machines in without TLS or users must say so") {
  const auto config = [](const std::string& address, const std::string& more) {
    return R"({"listen": [")" + address + R"("], "devices": [])" + more + "}";
  };
  const std::string tls = R"(, "tls": {"certificates": [{"cert": "c", "key": "k"}]})";
  const std::string users = R"(, "access": {"users_file": "u"})";
  for (const auto* address : {"127.0.0.1:1", "127.8.0.1:1", "[::1]:1", "localhost:1"})
    CHECK(findings_of(config(address, "")).empty());
  for (const auto* address : {"0.0.0.0:1", "[::]:1", "192.0.2.1:1", "gateway.example:1"}) {
    finds(config(address, ""), "gateway.json: /insecure: ", "without TLS");
    finds(config(address, tls), "gateway.json: /insecure: ", "without users");
    finds(config(address, users), "gateway.json: /insecure: ", "without TLS");
    CHECK(findings_of(config(address, tls + users)).empty());
    CHECK(findings_of(config(address, R"(, "insecure": true)")).empty());
  }
}

TEST_CASE("what stands between the gateway and a device") {
  const auto device = [](const std::string& url, const std::string& more) {
    return R"({"listen": ["127.0.0.1:0"], "devices": [{"name": "a", "url": ")" + url + R"(", )" + more + "}]}";
  };
  const auto parsed =
      parse_config(device("rr+ws://h/d?service=s",
                          R"("proxy": "[::1]:3128", "headers": [{"name": "Authorization", "value": "Bearer x"}])"));
  REQUIRE(parsed.findings.empty());
  CHECK(parsed.config.devices[0].proxy == rr::HostPort{"::1", 3128});
  CHECK(parsed.config.devices[0].headers == rr::HttpHeaders{{"Authorization", "Bearer x"}});
  finds(device("rr+ws://h/?service=s", R"("proxy": "nowhere")"), "gateway.json: /devices/0/proxy: ");
  finds(device("rr+ws://h/?service=s", R"("tls": {"ca": ["ca.pem"]})"), "gateway.json: /devices/0/tls: ", "no TLS");
  finds(device("rr+local:///?nodename=n&service=s", R"("proxy": "p:1")"),
        "gateway.json: /devices/0/proxy: ", "rr+local");
  finds(device("rr+ws://h/?service=s", R"("headers": [{"name": "Host", "value": "x"}])"),
        "gateway.json: /devices/0/headers/0/name: ", "'Host' can't be added");
  finds(device("rr+ws://h/?service=s", R"("headers": [{"name": "X-A", "value": "x\r\nEvil: 1"}])"),
        "gateway.json: /devices/0/headers/0/name: ");
}

TEST_CASE("the smallest configuration works, with the defaults") {
  const auto parsed = parse_config(smallest);
  CHECK(parsed.findings.empty());
  REQUIRE(parsed.config.listen.size() == 1);
  CHECK(parsed.config.listen[0] == rr::HostPort{"127.0.0.1", 8080});
  REQUIRE(parsed.config.devices.size() == 1);
  CHECK(parsed.config.devices[0].name == "create");
  CHECK(parsed.config.devices[0].url.service == "Create");
  CHECK(parsed.config.limits == Limits());
  CHECK(parsed.config.limits.header_bytes == 8192);
  CHECK(parsed.config.timeouts.send_stall == std::chrono::seconds(15));
}

TEST_CASE("every option arrives") {
  const auto parsed = parse_config(R"(/* all of them */ {
    "$schema": "gateway.schema.json",
    "listen": ["[::1]:1", "localhost:2"],
    "devices": [{"name": "a", "url": "rr+tcp://h:1/?service=s", "max_clients": 3, "mode": "shared", "shares_reads": true,
                 "login": {"username": "u", "password": "p"},
                 "callbacks": [{"member": "s.ask*", "answer": "all"}, {"member": "*", "answer": "first"}],
                 "leases": {"members": [{"member": "s.Stop", "lease": "never"}, {"member": "s.*", "lease": "required"}],
                            "safe": [{"call": "s.Drive", "arguments": [0, 0]}, {"wire": "s.arm[1].velocity", "value": 0.5},
                                     {"property": "s.speed", "value": {"x": 0}}],
                            "takeover": ["operator"]}}],
    "node": {"name": "lab.gateway", "id": "82301bf1-e1ef-4e89-8d8f-0848291587ac"},
    "discover": {"scopes": ["node_local", "ipv4_broadcast"], "max_devices": 7, "local": false, "hardware": false, "mode": "shared",
                 "tls": {"ca": ["lab.pem"]},
                 "allow": [{"node_name": "lab.*", "node_id": "{82301bf1-e1ef-4e89-8d8f-0848291587ac}",
                            "service_type": "com.x.Arm"}]},
    "base_path": "/lab", "trusted_proxies": ["10.0.0.0/8", "::1"], "proxy_headers": "forwarded",
    "proxy_protocol": "required",
    "web_root": "web", "allowed_origins": ["https://a.example", "http://*.b.example:81"],
    "allowed_hosts": ["mybox.local", "*.lab.example"],
    "limits": {"max_message_size": 20000, "header_bytes": 2000, "body_bytes": 3000, "header_timeout_ms": 300, "outbox_bytes": 40000,
               "clients": 5, "clients_per_address": 6, "memory": 50000000, "client_queue_bytes": 70000, "opaque_rate": 7000},
    "timeouts": {"connect_ms": 101, "drain_ms": 102, "send_stall_ms": 103, "idle_ms": 104, "unused_session_ms": 105,
                 "request_ms": 106},
    "retry": {"min_ms": 51, "max_ms": 52, "online_ms": 53},
    "recordings": {"folder": "recordings", "max_bytes": 5000000, "at_once": 2,
                   "record": [{"device": "a", "service": "s", "members": ["x", "y/*"], "interval_ms": 50,
                               "max_file_bytes": 1000000, "kept_files": 3}, {"device": "a", "service": "t"}]},
    "log": {"level": "debug", "format": "json"} // the end
  })");
  CHECK(parsed.findings.empty());
  const auto& config = parsed.config;
  CHECK(config.listen == std::vector<rr::HostPort>{{"::1", 1}, {"localhost", 2}});
  const auto& device = config.devices.at(0);
  CHECK(device.max_clients == 3);
  CHECK(device.mode == DeviceMode::shared);
  CHECK(device.shares_reads);
  CHECK(device.login.username == "u");
  CHECK(*device.login.credentials.find("password") == rr::Value("p"));
  CHECK(device.callbacks == std::vector<CallbackRule>{{"s.ask*", CallbackPolicy::all}, {"*", CallbackPolicy::first}});
  CHECK(device.leases == LeaseConfig{true,
                                     {{"s.Stop", LeaseNeed::never}, {"s.*", LeaseNeed::required}},
                                     {{SafeAction::Kind::call, "s", "Drive", "[0,0]"},
                                      {SafeAction::Kind::wire, "s.arm[1]", "velocity", "0.5"},
                                      {SafeAction::Kind::property, "s", "speed", R"({"x":0})"}},
                                     {"operator"}});
  const auto id = rr::parse_node_id("82301bf1-e1ef-4e89-8d8f-0848291587ac").value();
  CHECK(config.discover == Discover{true,
                                    {"node_local", "ipv4_broadcast"},
                                    {{"lab.*", id, "com.x.Arm"}},
                                    7,
                                    false,
                                    false,
                                    {{"lab.pem"}},
                                    DeviceMode::shared});
  CHECK(config.node == NodeConfig{"lab.gateway", id});
  CHECK(config.base_path == "/lab");
  CHECK(config.proxy ==
        ProxyConfig{{{*parse_address_range("10.0.0.0/8"), *parse_address_range("::1")}, ForwardedBy::forwarded}, true});
  CHECK(config.web_root == "web");
  CHECK(config.allowed_origins.size() == 2);
  CHECK(config.allowed_hosts == std::vector<std::string>{"mybox.local", "*.lab.example"});
  CHECK(config.limits == Limits{20000, 2000, 3000, milliseconds(300), 40000, 5, 6, 50000000, 70000, 7000});
  CHECK(config.timeouts == Timeouts{milliseconds(101), milliseconds(102), milliseconds(103), milliseconds(104),
                                    milliseconds(105), milliseconds(106)});
  CHECK(config.recordings.folder == "recordings");
  CHECK(config.recordings.max_bytes == 5'000'000);
  CHECK(config.recordings.at_once == 2);
  const RecordingWish wish{"a", "s", {"x", "y/*"}, milliseconds(50), milliseconds(0), 1'000'000, 3};
  CHECK(config.recordings.standing == std::vector<RecordingWish>{wish, {"a", "t"}});
  CHECK(config.retry == Retry{milliseconds(51), milliseconds(52), milliseconds(53)});
  CHECK(config.log == LogConfig{"debug", "json"});
}

TEST_CASE("proxies before the gateway") {
  finds(with(R"("base_path": "robots")"), "gateway.json: /base_path: ", "expected a path");
  finds(with(R"("base_path": "/robots/")"), "gateway.json: /base_path: ");
  finds(with(R"("trusted_proxies": ["10.0.0.1/8"])"), "gateway.json: /trusted_proxies/0: ", "no bits set behind it");
  finds(with(R"("proxy_protocol": "required")"), "gateway.json: /proxy_protocol: ", "trusted_proxies");
}

TEST_CASE("what only shared devices have") {
  const auto device = [](const std::string& more) {
    return R"({"listen": ["127.0.0.1:0"], "devices": [{"name": "a", "url": "rr+tcp://h:1/", )" + more + "}]}";
  };
  finds(device(R"("mode": "both")"), "gateway.json: /devices/0/mode: found 'both', expected one of: relay, shared");
  finds(device(R"("login": {"username": "u", "password": "p"})"), "gateway.json: /devices/0/mode: ", "shared");
  finds(device(R"("mode": "shared", "login": {"username": "u"})"), "gateway.json: /devices/0/login/password: missing");
  finds(device(R"("mode": "shared", "callbacks": [{"answer": "all"}])"),
        "gateway.json: /devices/0/callbacks/0/member: missing");
  finds(with(R"("node": {"name": "9"})"), "gateway.json: /node/name: found '9'");
  finds(with(R"("node": {"id": "x"})"), "gateway.json: /node/id: found 'x', expected a UUID");
}

TEST_CASE("mistakes are named by path, with what was found and expected") {
  finds("", "gateway.json: not JSON");
  finds("{", "gateway.json: not JSON", "line 1");
  finds(R"({"listen": 1e400})", "gateway.json: not JSON", "1e400");
  for (std::size_t after = 60; after < 110; ++after) {  // the token of an error has the comment before it
    const auto comment = "// " + std::string(3000, 'x') + "\xc3\xa4" + std::string(after, 'y') + "\n";
    const auto found = parse_config(comment + "{l").findings;
    REQUIRE(found.size() == 1);
    CHECK(found[0].text.size() < 300);
    CHECK_THAT(found[0].text, Catch::Contains("line 2, column 2") && Catch::Contains("...") && Catch::Contains("{l"));
    CHECK_NOTHROW(nlohmann::json(found[0].text).dump());  // no half of a character
  }
  finds("[]", "gateway.json: ", "found array, expected an object");
  finds(R"({"devices": []})", "gateway.json: /listen: missing; expected an array");
  finds(R"({"listen": ["127.0.0.1:0"]})", "gateway.json: /devices: missing");
  finds(R"({"listen": [], "devices": []})", "gateway.json: /listen: empty");
  finds(with(R"("listn": 1)"), "gateway.json: /listn: unknown option; known here: $schema, listen, devices, discover");
  finds(with(R"("a/b~c": 1)"), "gateway.json: /a~1b~0c: unknown");
  finds(with(R"("limits": {"clents": 1})"), "gateway.json: /limits/clents: unknown option", "clients_per_address");
  finds(with(R"("limits": 3)"), "gateway.json: /limits: found integer 3, expected an object");
  finds(with(R"("limits": {"clients": "many"})"),
        "gateway.json: /limits/clients: found string 'many', expected an integer");
  finds(with(R"("limits": {"clients": 1.5})"), "gateway.json: /limits/clients: found number 1.5, expected an integer");
  finds(with(R"("limits": {"clients": true})"), "gateway.json: /limits/clients: found boolean true");
  finds(with(R"("limits": {"clients": null})"), "gateway.json: /limits/clients: found null");
  finds(with(R"("limits": {"clients": 0})"), "gateway.json: /limits/clients: found 0, expected 1 to");
  finds(with(R"("limits": {"clients": -1})"), "gateway.json: /limits/clients: found -1, expected 1 to");
  finds(with(R"("limits": {"clients": 18446744073709551615})"),
        "gateway.json: /limits/clients: found 18446744073709551615");
  finds(with(R"("log": {"level": "loud"})"), "gateway.json: /log/level: found 'loud', expected one of: trace, debug");
  finds(with(R"("retry": {"min_ms": 9000, "max_ms": 8000})"), "gateway.json: /retry/min_ms: found 9000");
  finds(with(R"("allowed_origins": ["lab.example"])"), "gateway.json: /allowed_origins/0: found 'lab.example'");
  finds(with(R"("allowed_origins": [7])"), "gateway.json: /allowed_origins/0: found integer 7, expected a string");
  finds(with(R"("allowed_hosts": ["http://mybox.local:8080"])"),
        "gateway.json: /allowed_hosts/0: found 'http://mybox.local:8080', expected a name as \"mybox.local\"");
  finds(with(R"("web_root": "a", "web_root": "b")"), "gateway.json: key 'web_root' appears twice");
  finds(R"({"listen": ["8080"], "devices": []})", "gateway.json: /listen/0: address '8080'", "host:port");
}

TEST_CASE("mistakes in devices are named by their index") {
  finds(with_device("7"), "gateway.json: /devices/0: found integer 7, expected an object");
  finds(with_device(R"({"url": "rr+tcp://h:1/?service=s"})"), "gateway.json: /devices/0/name: missing");
  finds(with_device(R"({"name": "a"})"), "gateway.json: /devices/0/url: missing; expected a string");
  finds(with_device(R"({"name": "a/b", "url": "rr+tcp://h:1/?service=s"})"),
        "gateway.json: /devices/0/name: found 'a/b'");
  finds(with_device(R"({"name": "", "url": "rr+tcp://h:1/?service=s"})"), "gateway.json: /devices/0/name: found ''");
  finds(with_device(R"({"name": "a", "url": "rr+tpc://h:1/?service=s"})"),
        "gateway.json: /devices/0/url: ", "scheme 'rr+tpc' unknown; known: rr+tcp");
  finds(with_device(R"({"name": "a", "url": "rr+intra:///?nodename=n&service=s"})"),
        "gateway.json: /devices/0/url: ", "available: rr+tcp");
  const std::string device = R"({"name": "a", "url": "rr+tcp://h:1/?service=s"})";
  finds(with_device(device + "," + device), "gateway.json: /devices/1/name: found 'a' a second time");
}

TEST_CASE("discovery is on where it is named, and allows nothing by itself") {
  CHECK_FALSE(parse_config(smallest).config.discover.is_enabled);
  const auto parsed = parse_config(with(R"("discover": {})"));
  CHECK(parsed.findings.empty());
  CHECK(parsed.config.discover == Discover{true, {"link_local"}, {}, 64});
}

TEST_CASE("mistakes in discovery rules are named by their index") {
  const auto with_rule = [](const std::string& rule) { return with(R"("discover": {"allow": [)" + rule + "]}"); };
  finds(with(R"("discover": true)"), "gateway.json: /discover: found boolean true, expected an object");
  finds(with(R"("discover": {"scopes": ["everywhere"]})"),
        "gateway.json: /discover/scopes/0: found 'everywhere', expected one of: node_local, link_local");
  finds(with(R"("discover": {"max_devices": 0})"), "gateway.json: /discover/max_devices: found 0, expected 1 to 4096");
  finds(with_rule("{}"), "gateway.json: /discover/allow/0/node_name: missing; a rule needs one of");
  finds(with_rule(R"({"node_name": ""})"), "gateway.json: /discover/allow/0/node_name: missing");
  finds(with_rule(R"({"node_name": "a b"})"), "gateway.json: /discover/allow/0/node_name: found 'a b'");
  finds(with_rule(R"({"node_id": "me"})"), "gateway.json: /discover/allow/0/node_id: found 'me', expected a UUID");
  finds(with_rule(R"({"node_id": "{0}"})"), "gateway.json: /discover/allow/0/node_id: found '{0}', expected a UUID");
  finds(with_rule(R"({"node_name": "*", "type": "x"})"),
        "gateway.json: /discover/allow/0/type: unknown option; known here: node_name");
}

TEST_CASE("all findings are listed at once") {
  const auto findings = findings_of(R"({"listen": [1, "x"], "devices": [{}], "limits": {"clients": "a", "b": 1}})");
  CHECK(findings.size() == 6);
}

TEST_CASE("the schema and the parser know the same options") {
  std::ifstream in(config_folder / "gateway.schema.json");
  const auto schema = nlohmann::json::parse(in);
  CHECK(schema.at("$schema") == "https://json-schema.org/draft/2020-12/schema");
  std::vector<OptionInfo> stated;
  list_schema(schema, "", false, stated);
  auto known = config_options();
  const auto by_path = [](const OptionInfo& left, const OptionInfo& right) { return left.path < right.path; };
  std::sort(stated.begin(), stated.end(), by_path);
  std::sort(known.begin(), known.end(), by_path);
  REQUIRE(known.size() > 25);
  REQUIRE(stated.size() == known.size());
  for (std::size_t i = 0; i < known.size(); ++i) {
    INFO(known[i].path);
    CHECK(stated[i].path == known[i].path);
    CHECK(stated[i].type == known[i].type);
    CHECK(stated[i].is_required == known[i].is_required);
    CHECK(stated[i].minimum == known[i].minimum);
    CHECK(stated[i].maximum == known[i].maximum);
    CHECK(stated[i].choices == known[i].choices);
    CHECK(stated[i].default_value == known[i].default_value);
  }
}

TEST_CASE("the example configurations load") {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(config_folder)) {
    if (entry.path().extension() != ".json" || entry.path().filename() == "gateway.schema.json") continue;
    ++count;
    const auto parsed = load_config(entry.path().string());
    for (const auto& finding : parsed.findings) FAIL_CHECK(format_finding(entry.path().string(), finding));
  }
  CHECK(count >= 2);
}

TEST_CASE("a file that isn't there is a finding") {
  const auto parsed = load_config("no/such/file.json");
  REQUIRE(parsed.findings.size() == 1);
  CHECK(parsed.findings[0].path.empty());
}
