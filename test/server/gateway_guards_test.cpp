// What every response tells browsers about itself, whichever route gives it.
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "server/gateway/gateway.hpp"
#include "server/gateway/routes.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

constexpr std::string_view strict_policy = "default-src 'none'; frame-ancestors 'none'";

/// Of all headers of this name.
std::vector<std::string> values_of(const std::string& head, const std::string& name) {
  std::vector<std::string> out;
  const auto begin = "\r\n" + name + ": ";
  for (auto at = head.find(begin); at != std::string::npos; at = head.find(begin, at + 1)) {
    const auto value = at + begin.size();
    out.push_back(head.substr(value, head.find("\r\n", value) - value));
  }
  return out;
}

using Values = std::vector<std::string>;

void check_guards(const std::string& head, std::string_view policy = strict_policy,
                  std::string_view shared_with = "same-origin") {
  CHECK(values_of(head, "X-Content-Type-Options") == Values{"nosniff"});
  CHECK(values_of(head, "Referrer-Policy") == Values{"no-referrer"});
  CHECK(values_of(head, "Cross-Origin-Opener-Policy") == Values{"same-origin"});
  CHECK(values_of(head, "Cross-Origin-Resource-Policy") == Values{std::string(shared_with)});
  CHECK(values_of(head, "Content-Security-Policy") == Values{std::string(policy)});
}

/// The head of the response; `lines` are the request's, without Host.
std::string head_of(TestGateway& gateway, const std::string& first, const std::string& lines = {},
                    const std::string& body = {}) {
  TestClient client(gateway.port());
  client.send(first + " HTTP/1.1\r\nHost: localhost\r\n" + lines + "\r\n" + body);
  return client.receive_until("\r\n\r\n");
}

unsigned status_of(const std::string& head) {
  return static_cast<unsigned>(std::stoul(head.substr(9, 3)));
}

/// Each pattern with something for its "*", and below a device.
std::set<std::string> paths() {
  boost::asio::io_context io;
  Gateway gateway(io, Config{});
  std::set<std::string> out;
  for (const auto& route : list_routes(gateway)) {
    const bool has_rest = route.pattern.back() == '*';
    const auto path = has_rest ? route.pattern.substr(0, route.pattern.size() - 1) : route.pattern;
    out.insert(has_rest ? path + "x" : path);
    if (has_rest) out.insert(path + "x/test/member");
  }
  return out;
}

}  // namespace

TEST_CASE("every route's response has each header that guards browsers, once") {
  TestGateway gateway;
  const auto all = paths();
  REQUIRE(all.size() > 20);
  for (const auto& path : all)
    for (const auto method : {"GET", "HEAD", "OPTIONS", "POST"}) {
      INFO(method << " " << path);
      const bool has_body = std::string_view(method) == "POST";
      check_guards(head_of(gateway, std::string(method) + " " + path,
                           has_body ? "Content-Type: application/json\r\nContent-Length: 2\r\n" : "",
                           has_body ? "{}" : ""));
    }
}

TEST_CASE("refusals and failures have each header that guards browsers, once") {
  const Folder files;
  const auto token = make_api_token();
  const auto tokens = files.write("tokens", "ci " + hash_api_token(token) + " admin _\n");
  TestGateway gateway(1, [&](Config& config) { config.access.tokens_file = tokens; });
  const auto shows = "Authorization: Bearer " + token + "\r\n";
  const auto check = [](unsigned status, const std::string& head) {
    INFO(head);
    CHECK(status_of(head) == status);
    check_guards(head);
  };
  check(400, head_of(gateway, "GET /healthz", "Host: twice\r\n"));
  check(401, head_of(gateway, "GET /api/v1/devices", "Authorization: Bearer wrong\r\n"));
  check(403, head_of(gateway, "GET /api/v1/devices", "Origin: https://elsewhere.example\r\n"));
  check(403, head_of(gateway, "GET /devices/x", "Origin: null\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"));
  check(404, head_of(gateway, "GET /api/nothing", shows));
  check(405, head_of(gateway, "DELETE /healthz"));
  check(426, head_of(gateway, "GET /devices/x", shows + "Upgrade: websocket\r\nConnection: Upgrade\r\n"));
  check(413, head_of(gateway, "POST /api/v1/access/requests", "Content-Length: 1000000000\r\n"));
  check(431, head_of(gateway, "GET /healthz", "X-Fill: " + std::string(100'000, 'x') + "\r\n"));
  TestClient stranger(gateway.port());
  stranger.send("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  check(421, stranger.receive_until("\r\n\r\n"));
  TestClient garbage(gateway.port());
  garbage.send("SSH-2.0-OpenSSH_9.2\r\n");
  check(404, garbage.receive_until("\r\n\r\n"));

  TestClient client(gateway.port());
  const std::string json = "Host: localhost\r\nContent-Type: application/json\r\n";
  client.send("POST /api/v1/access/requests HTTP/1.1\r\n" + json + "Content-Length: 15\r\n\r\n{\"name\":\"vera\"}");
  const auto asked = client.receive_response();
  REQUIRE(asked.status == 202);
  std::filesystem::remove(tokens);
  const auto id = nlohmann::json::parse(asked.body)["id"].get<std::string>();
  check(500, head_of(gateway, "POST /api/v1/access/requests/" + id + "/approve", shows + "Content-Length: 0\r\n"));
}

TEST_CASE("a page's files and their 304 have a policy of their own, all other answers the strict one") {
  const Folder files;
  files.write("web/index.html", "<!doctype html>");
  files.write("web/main.js", "1");
  TestGateway gateway(0, [&](Config& config) { config.web_root = files.path("web"); });
  const auto page = head_of(gateway, "GET /");
  const auto policies = values_of(page, "Content-Security-Policy");
  REQUIRE(policies.size() == 1);
  CHECK(policies[0].starts_with("default-src 'self'; script-src 'self' 'wasm-unsafe-eval'"));
  check_guards(page, policies[0]);
  const auto same = head_of(gateway, "GET /", "If-None-Match: " + values_of(page, "ETag").at(0) + "\r\n");
  CHECK(status_of(same) == 304);
  check_guards(same, policies[0]);
  check_guards(head_of(gateway, "GET /main.js"), policies[0]);
  check_guards(head_of(gateway, "GET /nowhere.js"));
}

TEST_CASE("pages of an allowed origin, and no others, may show what they may read") {
  TestGateway gateway(1, [](Config& config) { config.allowed_origins = {"https://lab.example"}; });
  for (const auto method : {"GET", "OPTIONS"}) {
    const auto asked = std::string(method) + " /api/v1/devices/x";
    check_guards(head_of(gateway, asked, "Origin: https://lab.example\r\n"), strict_policy, "cross-origin");
    check_guards(head_of(gateway, asked));
    check_guards(head_of(gateway, asked, "Origin: https://evil.example\r\n"));
  }
}
