// Sign-ins of pages at the gateway's port: what a cookie is good for, for whom, and until when.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "test/node/transport/sandbox.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

const std::string own_page = "Origin: http://localhost:8080\r\n";

/// A gateway with the tokens "ci" and "bob".
struct Guarded {
  rr::Sandbox folders;
  Folder files;
  std::string key = "a key of thirty-two bytes or more";
  std::string token = make_api_token();
  std::string token_of_bob = make_api_token();
  std::string line = "ci " + hash_api_token(token) + " admin _\n";
  std::function<void(Config&)> change = [this](Config& config) {
    config.access.tokens_file = files.write("tokens", line + "bob " + hash_api_token(token_of_bob) + " viewer _\n");
    config.access.ticket_key_file = files.write("key", key);
  };
  TestGateway gateway{1, change};

  TestClient::HttpResponse ask(const std::string& first, const std::string& lines = {}, const std::string& body = {}) {
    TestClient client(gateway.port());
    const auto length = "Content-Length: " + std::to_string(body.size()) + "\r\n";
    client.send(first + " HTTP/1.1\r\nHost: localhost:8080\r\n" + lines + (body.empty() ? "" : length) + "\r\n" + body);
    return client.receive_response(!first.starts_with("DELETE"));
  }
  TestClient::HttpResponse sign_in(const std::string& body, const std::string& lines = own_page) {
    return ask("POST /api/v1/session", lines + "Content-Type: application/json\r\n", body);
  }
  /// "Cookie: rrgate=...".
  std::string cookie() {
    const auto head = sign_in(R"({"token": ")" + token + "\"}").head;
    const auto begin = head.find("Set-Cookie: rrgate-8080=") + 12;
    return "Cookie: " + head.substr(begin, head.find(';', begin) - begin) + "\r\n";
  }
  /// One of "ci", of which more than half the time is over.
  std::string old_cookie() const {
    Identity who;
    who.name = "ci";
    who.roles = who.proven_roles = {"admin"};
    who.proof = Proof::token;
    who.credential = hash_api_token(token);
    const auto long_ago = std::chrono::system_clock::now() - SignIns::lifetime / 2 - std::chrono::minutes(1);
    return "Cookie: rrgate-8080=" + SignIns(rr::Bytes(key.begin(), key.end())).begin(who, long_ago).value() + "\r\n";
  }
  /// Whom the gateway takes a request for.
  nlohmann::json who(const std::string& lines) {
    return nlohmann::json::parse(ask("GET /api/v1/access", lines).body)["user"];
  }
};

}  // namespace

TEST_CASE("a sign-in: shown once, a cookie shows it from then on, to the gateway's own page") {
  Guarded guarded;
  const auto made = guarded.sign_in(R"({"token": ")" + guarded.token + "\"}");
  CHECK(made.status == 201);
  CHECK(nlohmann::json::parse(made.body) ==
        nlohmann::json({{"user", "ci"}, {"roles", {"admin"}}, {"expires_in", 28800}}));
  CHECK_THAT(made.head, Catch::Contains("; Path=/; HttpOnly; SameSite=Strict\r\n"));
  CHECK_THAT(made.head, Catch::Contains("Cache-Control: no-store\r\n"));
  CHECK(guarded.ask("POST /api/v1/session", "Authorization: Bearer " + guarded.token + "\r\n").status == 201);

  const auto cookie = guarded.cookie();
  const auto access = guarded.ask("GET /api/v1/access", cookie);
  CHECK(nlohmann::json::parse(access.body)["user"] == "ci");
  CHECK(nlohmann::json::parse(access.body)["session"] == true);
  CHECK_THAT(access.head, !Catch::Contains("Set-Cookie"));
  CHECK(guarded.who(cookie + own_page) == "ci");
  CHECK(guarded.who(cookie + "Sec-Fetch-Site: same-site\r\n").is_null());
  CHECK(guarded.who("Cookie: rrgate-8080=forged.AAAA\r\n").is_null());
  CHECK(guarded.who("Cookie: __Host-" + cookie.substr(8)).is_null());

  CHECK(guarded.ask("POST /api/v1/tickets", cookie + own_page).status == 201);
  CHECK(guarded.ask("POST /api/v1/tickets", cookie).status == 401);
  // Nobody's cookie is good for another cookie: a sign-in would never end.
  CHECK(guarded.ask("POST /api/v1/session", cookie + own_page).status == 401);
}

TEST_CASE("a sign-in: what is wrong is told, and sets no cookie") {
  Guarded guarded;
  const auto check = [&](unsigned status, const TestClient::HttpResponse& answer) {
    CHECK(answer.status == status);
    CHECK_THAT(answer.head, !Catch::Contains("Set-Cookie"));
    return answer;
  };
  check(401, guarded.sign_in(R"({"token": "wrong"})"));
  check(401, guarded.ask("POST /api/v1/session", own_page));
  check(400, guarded.sign_in("{}"));
  check(400, guarded.sign_in(R"({"token": 1})"));
  check(400, guarded.sign_in(R"({"token": "a", "user": "b"})"));
  check(400, guarded.sign_in(R"({"user": "a:b", "password": "c"})"));
  check(400, guarded.ask("POST /api/v1/session", own_page + "Content-Type: text/plain\r\n", "{}"));
  const auto none = check(409, guarded.sign_in(R"({"user": "ci", "password": "c"})"));
  CHECK_THAT(none.body, Catch::Contains("users_file"));
  check(403, guarded.sign_in(R"({"token": ")" + guarded.token + "\"}", "Origin: https://evil.example\r\n"));
}

TEST_CASE("a sign-in: WebSockets of the gateway's own page, and of no other, are let in by the cookie") {
  Guarded guarded;
  const auto cookie = guarded.cookie();
  guarded.gateway.wait_for("/readyz", [](const auto& ready) { return ready["devices_online"] == 1; });
  const auto upgrade = [&](const std::string& lines) {
    return TestClient(guarded.gateway.port()).upgrade("/devices/x", lines).status;
  };
  CHECK(upgrade(cookie + own_page) == 101);
  CHECK(upgrade(cookie) == 401);
  CHECK(upgrade(own_page) == 401);
  CHECK(upgrade(cookie + "Origin: http://localhost:3000\r\n") == 403);
}

TEST_CASE("signing out: no cookie of the sign-in is taken any more, and what went on by it ends") {
  Guarded guarded;
  const auto cookie = guarded.cookie();
  const auto other = guarded.cookie();
  guarded.gateway.wait_for("/readyz", [](const auto& ready) { return ready["devices_online"] == 1; });
  TestClient socket(guarded.gateway.port());
  REQUIRE(socket.upgrade("/devices/x", cookie + own_page).status == 101);
  CHECK(guarded.ask("DELETE /api/v1/session", cookie + "Origin: https://evil.example\r\n").status == 403);
  const auto gone = guarded.ask("DELETE /api/v1/session", cookie + own_page);
  CHECK(gone.status == 204);
  CHECK_THAT(gone.head, Catch::Contains("Set-Cookie: rrgate-8080=; Path=/; ") && Catch::Contains("Max-Age=0"));
  CHECK(guarded.who(cookie).is_null());
  CHECK(guarded.who(other) == "ci");
  CHECK_NOTHROW(socket.receive_all());
  CHECK(guarded.ask("DELETE /api/v1/session", cookie + own_page).status == 204);
}

TEST_CASE("signing out holds behind a restart, too") {
  Guarded guarded;
  const auto cookie = guarded.cookie();
  const auto other = guarded.cookie();
  CHECK(guarded.ask("DELETE /api/v1/session", cookie + own_page).status == 204);
  const TestGateway next(0, guarded.change);
  const auto who = [&](const std::string& lines) {
    TestClient client(next.port());
    client.send("GET /api/v1/access HTTP/1.1\r\nHost: localhost:8080\r\n" + lines + "\r\n");
    return nlohmann::json::parse(client.receive_response().body)["user"];
  };
  CHECK(who(cookie).is_null());
  CHECK(who(other) == "ci");
}

TEST_CASE("a response renews a cookie when half its time is over, unless it sets another one, or takes it away") {
  Guarded guarded;
  const auto cookie = guarded.old_cookie();
  const auto cookies_of = [](const TestClient::HttpResponse& answer) {
    std::vector<std::string> out;
    const std::string name = "Set-Cookie: ";
    for (auto at = answer.head.find(name); at != std::string::npos; at = answer.head.find(name, at + 1))
      out.push_back(answer.head.substr(at + 12, answer.head.find(';', at) - at - 12));
    return out;
  };
  const auto who_has = [&](const std::string& set) { return guarded.who("Cookie: " + set + "\r\n"); };
  const auto renewed = cookies_of(guarded.ask("GET /api/v1/access", cookie));
  REQUIRE(renewed.size() == 1);
  CHECK(who_has(renewed[0]) == "ci");

  const auto signed_in =
      cookies_of(guarded.sign_in(R"({"token": ")" + guarded.token_of_bob + "\"}", cookie + own_page));
  REQUIRE(signed_in.size() == 1);
  CHECK(who_has(signed_in[0]) == "bob");

  const auto signed_out = guarded.ask("DELETE /api/v1/session", cookie + own_page);
  CHECK(cookies_of(signed_out) == std::vector<std::string>{"rrgate-8080="});
  CHECK(who_has(renewed[0]).is_null());
}

TEST_CASE("whoever signs in takes the place of who was signed in: no late response renews the former cookie") {
  Guarded guarded;
  const auto former = guarded.old_cookie();
  TestClient late(guarded.gateway.port());
  late.send("POST /api/v1/session HTTP/1.1\r\nHost: localhost:8080\r\nConnection: close\r\nContent-Length: 8\r\n" +
            std::string("Expect: 100-continue\r\n") + own_page + former + "\r\n");
  late.receive_until("HTTP/1.1 100 Continue\r\n\r\n");
  CHECK(guarded.sign_in(R"({"token": ")" + guarded.token_of_bob + "\"}", former + own_page).status == 201);
  late.send("no JSON!");
  CHECK_THAT(late.receive_all(), !Catch::Contains("Set-Cookie"));
  CHECK_THAT(guarded.ask("GET /api/v1/access", former).head, !Catch::Contains("Set-Cookie"));
  CHECK(guarded.who(former).is_null());
}

TEST_CASE("a sign-in ends when what was shown is good no more") {
  Guarded guarded;
  const auto cookie = guarded.cookie();
  CHECK(guarded.who(cookie) == "ci");
  guarded.files.write("tokens", "");
  guarded.gateway.wait_for("/api/v1/access", [&](const auto&) { return guarded.who(cookie).is_null(); });
  guarded.files.write("tokens", guarded.line);  // the same token again: it had not been signed out
  guarded.gateway.wait_for("/api/v1/access", [&](const auto&) { return guarded.who(cookie) == "ci"; });
}

TEST_CASE("a page that has a form of its own is refused without a word of passwords") {
  Folder files;
  TestGateway gateway(0, [&](Config& config) { config.access.users_file = files.write("users", ""); });
  const auto refusal = [&](const std::string& lines) {
    TestClient client(gateway.port());
    client.send("GET /api/v1/devices HTTP/1.1\r\nHost: localhost\r\n" + lines + "\r\n");
    return client.receive_response();
  };
  CHECK_THAT(refusal({}).head, Catch::Contains("WWW-Authenticate: Basic"));
  const auto quiet = refusal("X-Requested-With: rrgate\r\n");
  CHECK(quiet.status == 401);
  CHECK_THAT(quiet.head, !Catch::Contains("WWW-Authenticate"));
}
