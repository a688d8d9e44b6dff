// HTTP at the gateway's port: answers, limits, deadlines.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

TestClient::HttpResponse fetch(TestGateway& gateway, const std::string& request, bool has_body = true) {
  TestClient client(gateway.port());
  client.send(request);
  return client.receive_response(has_body);
}

/// A GET whose header block has exactly this many bytes.
std::string request_of_size(std::size_t size) {
  const std::string begin = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-Fill: ";
  return begin + std::string(size - begin.size() - 4, 'x') + "\r\n\r\n";
}

constexpr auto short_deadlines = [](Config& config) {
  config.limits.header_timeout = milliseconds(200);
  config.timeouts.idle = milliseconds(200);
};

}  // namespace

TEST_CASE("health, readiness and devices are answered") {
  TestGateway gateway(2);
  gateway.wait_for_state("online", 0);
  const auto text = gateway.wait_for_state("online", 1);
  const auto device = nlohmann::json::parse(text);
  CHECK(device["name"] == "y");
  CHECK(device["url"] == gateway.device(1).url());
  CHECK(device["node_id"] == rr::format_node_id(gateway.device(1).node_id(), rr::NodeIdFormat::dashes));
  CHECK(device["node_name"] == "node.y");
  CHECK(device["last_error"].is_null());
  CHECK(device["services"].is_array());
  CHECK(device["clients"] == 0);

  const auto health = fetch(gateway, "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(health.status == 200);
  CHECK_THAT(health.head, Catch::Contains("Content-Type: application/json\r\n"));
  CHECK_THAT(health.head, Catch::Contains("X-Content-Type-Options: nosniff\r\n"));
  const auto ready = fetch(gateway, "GET /readyz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(ready.status == 200);
  CHECK(nlohmann::json::parse(ready.body)["devices_online"] == 2);
}

TEST_CASE("requests follow each other on one connection, also unasked") {
  TestGateway gateway;
  TestClient client(gateway.port());
  std::string many;
  for (int i = 0; i < 20; ++i)
    many += "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\nGET /nope HTTP/1.1\r\nHost: localhost\r\n\r\n";
  client.send(many);
  for (int i = 0; i < 20; ++i) {
    CHECK(client.receive_response().status == 200);
    CHECK(client.receive_response().status == 404);
  }
  client.send("HEAD /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto head = client.receive_response(false);
  CHECK(head.status == 200);
  CHECK_THAT(head.head, Catch::Contains("Content-Length: 16\r\n"));
  client.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  CHECK_THAT(client.receive_response().head, Catch::Contains("Connection: close\r\n"));
  CHECK(client.receive_all().empty());
}

TEST_CASE("HTTP/1.0 is answered and closed") {
  TestGateway gateway;
  TestClient client(gateway.port());
  client.send("GET /healthz HTTP/1.0\r\n\r\n");
  CHECK_THAT(client.receive_all(), Catch::StartsWith("HTTP/1.0 200 OK\r\n"));
}

TEST_CASE("errors are problem documents") {
  TestGateway gateway;
  const auto missing = fetch(gateway, "GET /api/v2/x HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(missing.status == 404);
  CHECK_THAT(missing.head, Catch::Contains("Content-Type: application/problem+json\r\n"));
  CHECK(nlohmann::json::parse(missing.body)["status"] == 404);
  const auto refused = fetch(gateway, "POST /healthz HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\nhi");
  CHECK(refused.status == 405);
  CHECK_THAT(refused.head, Catch::Contains("Allow: GET, HEAD\r\n"));
  CHECK(fetch(gateway, "GET /devices/x HTTP/1.1\r\nHost: localhost\r\n\r\n").status == 426);
  CHECK(fetch(gateway, "GET /devices/other HTTP/1.1\r\nHost: localhost\r\n\r\n").status == 404);
  CHECK(fetch(gateway, "POST /healthz HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999\r\n\r\n").status == 413);
  CHECK(fetch(gateway, "GET /\x01 HTTP/1.1\r\n\r\n").status == 400);
  CHECK(fetch(gateway, "GET / HTTP/9.9\r\n\r\n").status == 400);
  CHECK(fetch(gateway, "GET / HTTP/1.1\r\nno colon\r\n\r\n").status == 400);
}

TEST_CASE("a header may have 8192 bytes and not one more") {
  TestGateway gateway;
  CHECK(fetch(gateway, request_of_size(8192)).status == 200);
  CHECK(fetch(gateway, request_of_size(8193)).status == 431);
  CHECK(fetch(gateway, "GET /" + std::string(100'000, 'a')).status == 431);
  CHECK(fetch(gateway, "GET / HTTP/1.1\r\n" + std::string(9000, 'a')).status == 431);
  std::string flood = "GET / HTTP/1.1\r\n";
  for (int i = 0; i < 2000; ++i) flood += "X-" + std::to_string(i) + ": y\r\n";
  CHECK(fetch(gateway, flood).status == 431);
}

TEST_CASE("a header of two pieces has the same limit") {
  TestGateway gateway;
  for (const std::size_t size : {8192u, 8193u}) {
    const auto request = request_of_size(size);
    TestClient client(gateway.port());
    client.send(request.substr(0, 4000));
    client.send(request.substr(4000));
    CHECK(client.receive_response().status == (size == 8192 ? 200 : 431));
  }
}

TEST_CASE("half a header is answered 408 when its time is over") {
  TestGateway gateway(1, short_deadlines);
  CHECK(fetch(gateway, "GET /healthz HTTP/1.1\r\nHost: g").status == 408);
}

TEST_CASE("a header that comes byte by byte has no more time for it") {
  TestGateway gateway(1, short_deadlines);
  TestClient slow(gateway.port());
  slow.send("GET /healthz HTTP/1.1\r\nX-Slow: ");
  const auto begin = std::chrono::steady_clock::now();
  std::chrono::steady_clock::duration took{};
  while (slow.send("x") && took < std::chrono::seconds(5)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // far below the deadline of 200 ms
    took = std::chrono::steady_clock::now() - begin;
  }
  CHECK(took < std::chrono::seconds(3));
}

TEST_CASE("a body may have as many bytes as are allowed and not one more") {
  TestGateway gateway(1, [](Config& config) { config.limits.body_bytes = 1024; });
  const auto put = [&](std::size_t size) {
    return fetch(gateway, "PUT /api/v1/devices HTTP/1.1\r\nHost: localhost\r\nContent-Length: " + std::to_string(size) +
                              "\r\n\r\n" + std::string(size, 'x'));
  };
  CHECK(put(1024).status == 405);
  const auto refused = put(1025);
  CHECK(refused.status == 413);
  CHECK_THAT(refused.body, Catch::Contains("longer than 1024 bytes"));
}

TEST_CASE("where a request ends and whom it is for is beyond doubt") {
  TestGateway gateway;
  const auto status = [&](const std::string& headers) {
    return fetch(gateway, "GET /healthz HTTP/1.1\r\n" + headers + "\r\n").status;
  };
  CHECK(status("Host: localhost\r\n") == 200);
  CHECK(status("") == 400);
  CHECK(status("Host: localhost\r\nHost: localhost\r\n") == 400);
  for (const auto* coding :
       {"xchunked", "gzip", "identity", "gzip, chunked", "chunked, gzip", "chunked, chunked", ""}) {
    INFO(coding);
    CHECK(status("Host: localhost\r\nTransfer-Encoding: " + std::string(coding) + "\r\n") == 501);
  }
  CHECK(status("Host: localhost\r\nTransfer-Encoding: gzip\r\nTransfer-Encoding: chunked\r\n") == 501);
  CHECK(status("Host: localhost\r\nContent-Length: 3\r\nTransfer-Encoding: chunked\r\n") == 400);
  CHECK(status("Host: localhost\r\nTransfer-Encoding: chunked\r\nContent-Length: 3\r\n") == 400);
  CHECK(fetch(gateway, "GET /healthz HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n").status == 400);
}

TEST_CASE("who may not have what he asks for hears so before his body is read") {
  TestGateway gateway(1, [](Config& config) {
    config.access.rules = {AccessRule{.roles = {"operator"}}};
    config.limits.header_timeout = milliseconds(60'000);
    config.rates.client.per_second = 5;
  });
  const auto post = [&](const std::string& path, const std::string& headers) {
    TestClient client(gateway.port());
    client.send("POST " + path + " HTTP/1.1\r\n" + headers + "Content-Type: application/json\r\n\r\n");
    auto response = client.receive_response();
    CHECK_THAT(response.head, Catch::Contains("Connection: close\r\n"));
    CHECK(client.receive_all().empty());
    return response.status;
  };
  const std::string path = "/api/v1/devices/x/service/function";
  CHECK(post(path, "Host: localhost\r\nContent-Length: 1000\r\n") == 403);
  CHECK(post(path, "Host: localhost\r\nTransfer-Encoding: chunked\r\n") == 403);
  CHECK(post(path, "Host: elsewhere.example\r\nContent-Length: 1000\r\n") == 421);
  CHECK(post("/healthz", "Host: localhost\r\nContent-Length: 1000\r\n") == 405);
  CHECK(post("/api/v1/access", "Host: localhost\r\nContent-Length: 1000\r\n") == 405);
  unsigned status = 0;
  for (int i = 0; i < 50 && status != 429; ++i) status = post(path, "Host: localhost\r\nContent-Length: 1000\r\n");
  CHECK(status == 429);
}

TEST_CASE("a body is asked for where the client waits for that, and has no time without end") {
  const Folder files;
  TestGateway gateway(1, [&](Config& config) {
    short_deadlines(config);
    config.access.tokens_file = files.write("tokens", "");
  });
  const std::string head =
      "POST /api/v1/access/requests HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n";
  TestClient patient(gateway.port());
  patient.send(head + "Content-Length: 15\r\nExpect: 100-continue\r\n\r\n");
  CHECK(patient.receive_until("\r\n\r\n") == "HTTP/1.1 100 Continue\r\n\r\n");
  patient.send("{\"name\": \"pad\"}");
  CHECK(patient.receive_response().status == 202);
  patient.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(patient.receive_response().status == 200);

  CHECK(fetch(gateway, head + "Content-Length: 15\r\n\r\n{").status == 408);
  CHECK(fetch(gateway, head + "Content-Length: 9000\r\n\r\n").status == 413);
  TestClient slow(gateway.port());
  slow.send(head + "Content-Length: 8000\r\n\r\n{");
  const auto begin = std::chrono::steady_clock::now();
  std::chrono::steady_clock::duration took{};
  while (slow.send(" ") && took < std::chrono::seconds(5)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // far below the deadline of 200 ms
    took = std::chrono::steady_clock::now() - begin;
  }
  CHECK(took < std::chrono::seconds(3));
}

TEST_CASE("silent, half-open and idle connections are closed") {
  TestGateway gateway(1, short_deadlines);
  TestClient silent(gateway.port());
  TestClient undecided(gateway.port());
  undecided.send("RRA");
  TestClient half_message(gateway.port());
  half_message.send(rr::ByteSpan(make_greeting()).first(40));
  TestClient idle(gateway.port());
  idle.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(idle.receive_response().status == 200);
  CHECK(silent.receive_all().empty());
  CHECK(undecided.receive_all().empty());
  CHECK(half_message.receive_all().empty());
  CHECK(idle.receive_all().empty());
}

TEST_CASE("a header in several lines, and a chunk whose extensions do not end, are refused") {
  const Folder files;
  TestGateway gateway(0, [&](Config& config) { config.access.tokens_file = files.write("tokens", ""); });
  const std::string begin = "POST /api/v1/access/requests HTTP/1.1\r\nHost: localhost\r\n";
  for (const auto fold : {"X-A: b\r\n c\r\n", "X-A: b\r\n\tc\r\n", "Transfer-Encoding:\r\n chunked\r\n"})
    CHECK(fetch(gateway, begin + fold + "\r\n").status == 400);
  TestClient in_parts(gateway.port());
  for (const auto* part : {"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-A: b\r\n", " c\r\n\r\n"})
    in_parts.send(std::string_view(part));
  CHECK(in_parts.receive_response().status == 400);
  TestClient endless(gateway.port());
  endless.send(begin + "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n2;" +
               std::string(200'000, 'a'));
  CHECK(endless.receive_response().status == 431);
}

TEST_CASE("neither HTTP nor Robot Raconteur gets 404; TLS gets nothing") {
  TestGateway gateway;
  TestClient garbage(gateway.port());
  garbage.send("hello there\r\n");
  CHECK_THAT(garbage.receive_all(), Catch::StartsWith("HTTP/1.1 404 Not Found\r\n"));
  TestClient tls(gateway.port());
  tls.send("\x16\x03\x01\x02");
  CHECK(tls.receive_all().empty());
}

TEST_CASE("a flood of requests is answered") {
  TestGateway gateway;
  std::vector<TestClient> clients;
  for (int i = 0; i < 100; ++i) clients.emplace_back(gateway.port());
  for (auto& client : clients)
    client.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\nGET /nope HTTP/1.1\r\nHost: localhost\r\n\r\n");
  for (auto& client : clients) {
    CHECK(client.receive_response().status == 200);
    CHECK(client.receive_response().status == 404);
  }
}

TEST_CASE("IPv6 is listened on, and by name") {
  TestGateway gateway(1, [](Config& config) { config.listen[0] = {"::1", 0}; });
  TestClient client(gateway.port(), "::1");
  client.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(client.receive_response().status == 200);
}

TEST_CASE("an address in use is an error that names it") {
  TestGateway gateway;
  boost::asio::io_context io;
  Config config;
  config.listen = {{"127.0.0.1", gateway.port()}};
  Gateway second(io, config);
  const auto started = second.start();
  REQUIRE_FALSE(started.has_value());
  CHECK_THAT(started.error().message, Catch::StartsWith("listen on 127.0.0.1:") && Catch::Contains("in use"));
}
