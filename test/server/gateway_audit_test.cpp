// What the gateway tells people about rights and about what was done: GET /api/v1/access and /api/v1/audit.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

/// A gateway with devices "x" and "y" and two tokens: "root" is an admin, "vera" may read parts of "x".
struct Watched {
  explicit Watched(bool has_audit = true) : has_log(has_audit) {}

  bool has_log;
  Folder files;
  std::string root = make_api_token();
  std::string vera = make_api_token();
  TestGateway gateway{
      2, [this](Config& config) {
        config.access.tokens_file = files.write("tokens", "root " + hash_api_token(root) + " admin _\n" + "vera " +
                                                              hash_api_token(vera) + " viewer 2200-01-01\n");
        config.access.rules = {{.roles = {"admin"}, .may = {std::begin(all_verbs), std::end(all_verbs)}},
                               {.roles = {"viewer"}, .devices = {"x"}, .members = {"pose"}, .may = {Verb::read}},
                               {.roles = {"viewer"}, .devices = {"x"}, .may = {Verb::subscribe}}};
        if (has_log) config.access.audit.file = files.path("audit.jsonl");
      }};

  TestClient::HttpResponse ask(const std::string& first, const std::string& token,
                               const std::string& lines = {}) const {
    TestClient client(gateway.port());
    const auto proof = token.empty() ? std::string() : "Authorization: Bearer " + token + "\r\n";
    client.send(first + " HTTP/1.1\r\nHost: localhost:8080\r\n" + proof + lines + "\r\n");
    return client.receive_response();
  }
  nlohmann::json tell(const std::string& target, const std::string& token) const {
    const auto answer = ask("GET " + target, token);
    INFO(answer.head << answer.body);
    REQUIRE(answer.status == 200);
    CHECK_THAT(answer.head, Catch::Contains("Cache-Control: no-store"));
    return nlohmann::json::parse(answer.body);
  }
  std::vector<std::string> events(const std::string& target) const {
    std::vector<std::string> out;
    const auto told = tell(target, root);
    for (const auto& record : told["records"]) out.push_back(record["event"]);
    return out;
  }
};

}  // namespace

TEST_CASE("everybody is told what he may do, to the devices that he sees, and until when") {
  const Watched watched;
  const auto root = watched.tell("/api/v1/access", watched.root);
  CHECK(root["may"] == nlohmann::json({"metrics", "admin"}));
  CHECK(root["expires_in"].is_null());
  const nlohmann::json all{{"read", "all"},      {"write", "all"}, {"call", "all"},
                           {"subscribe", "all"}, {"lock", "all"},  {"record", "all"}};
  CHECK(root["devices"] == nlohmann::json({{"x", all}, {"y", all}}));

  const auto vera = watched.tell("/api/v1/access", watched.vera);
  CHECK(vera["user"] == "vera");
  CHECK(vera["proof"] == "token");
  CHECK(vera["may"] == nlohmann::json::array());
  CHECK(vera["devices"] == nlohmann::json({{"x", {{"read", "some"}, {"subscribe", "all"}}}}));
  CHECK(vera["expires_in"] > 5'000'000'000);

  const auto stranger = watched.tell("/api/v1/access", {});
  CHECK(stranger["user"].is_null());
  CHECK(stranger["devices"] == nlohmann::json::object());

  CHECK_FALSE(watched.tell("/api/v1/access?devices=false", watched.root).contains("devices"));
  const auto wrong = watched.ask("GET /api/v1/access?devices=x", watched.root);
  CHECK(wrong.status == 400);
  CHECK_THAT(wrong.body, Catch::Contains("expected true or false"));
}

TEST_CASE("admins read the newest records of the audit log, and nobody else does") {
  const Watched watched;
  const auto page = "Origin: http://localhost:8080\r\n";
  for (const auto& token : {watched.vera, watched.root}) {
    TestClient client(watched.gateway.port());
    client.send("POST /api/v1/session HTTP/1.1\r\nHost: localhost:8080\r\nAuthorization: Bearer " + token + "\r\n" +
                page + "\r\n");
    REQUIRE(client.receive_response().status == 201);
  }
  CHECK(watched.ask("GET /api/v1/audit", {}).status == 401);
  CHECK(watched.ask("GET /api/v1/audit", watched.vera).status == 403);

  const auto told = watched.tell("/api/v1/audit", watched.root);
  CHECK(told["enabled"] == true);
  CHECK(told["all"] == true);
  CHECK(watched.events("/api/v1/audit") ==
        std::vector<std::string>{"refused", "refused", "signed_in", "signed_in", "started"});
  CHECK(watched.events("/api/v1/audit?user=vera") == std::vector<std::string>{"refused", "signed_in"});
  CHECK(watched.events("/api/v1/audit?user=r*t") == std::vector<std::string>{"signed_in"});
  CHECK(watched.events("/api/v1/audit?device=x").empty());
  CHECK(watched.ask("GET /devices/y", watched.vera).status == 403);
  CHECK(watched.events("/api/v1/audit?device=y&limit=1") == std::vector<std::string>{"refused"});
  const auto few = watched.tell("/api/v1/audit?limit=2", watched.root);
  CHECK(few["records"].size() == 2);
  CHECK(few["all"] == false);
  CHECK(few["records"][0]["device"] == "y");
  CHECK(few["records"][0]["user"] == "vera");

  for (const std::string limit : {"0", "1001", "-1", "1x", ""}) {
    const auto wrong = watched.ask("GET /api/v1/audit?limit=" + limit, watched.root);
    CHECK(wrong.status == 400);
    CHECK_THAT(wrong.body, Catch::Contains("expected a whole number from 1 to 1000"));
  }
  CHECK(watched.ask("GET /api/v1/audit?user=" + std::string(257, 'a'), watched.root).status == 400);
}

TEST_CASE("a gateway without an audit log says so") {
  const Watched watched(false);
  CHECK(watched.tell("/api/v1/audit", watched.root) ==
        nlohmann::json({{"enabled", false}, {"records", nlohmann::json::array()}, {"all", true}}));
  CHECK(watched.ask("GET /api/v1/audit", watched.vera).status == 403);
}
