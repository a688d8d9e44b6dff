// WebSocket clients: native peers and pages.
#include <catch2/catch.hpp>

#include "test/server/support/test_gateway.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

const std::string native = "Sec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\n";
const std::string page = native + "Origin: http://localhost:8080\r\n";

std::string close_reason(const TestClient::Frame& frame, std::uint16_t code) {
  REQUIRE(frame.first == 0x88);
  REQUIRE(frame.payload.size() >= 2);
  CHECK((frame.payload[0] << 8 | frame.payload[1]) == code);
  return std::string(rr::as_text(rr::ByteSpan(frame.payload).subspan(2)));
}

}  // namespace

TEST_CASE("a WebSocket at /devices/NAME reaches the device") {
  TestGateway gateway(2);
  TestClient client(gateway.port());
  const auto response = client.upgrade("/devices/y?service=test", native);
  CHECK(response.status == 101);
  CHECK_THAT(response.head, Catch::Contains("\r\nConnection: Upgrade\r\n"));
  CHECK_THAT(response.head, Catch::Contains("\r\nSec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\n"));
  const auto message = make_message("echo", 200);
  client.send_frame(2, message);
  CHECK(client.receive_payload(message.size()) == message);
}

TEST_CASE("ten million bytes cross a WebSocket intact, in frames of at most 65535") {
  TestGateway gateway;
  TestClient client(gateway.port());
  client.upgrade("/devices/x", page);
  const auto message = make_message("echo", 10'000'000);
  std::thread sender([&] { client.send_frame(2, message); });
  const auto answer = client.receive_payload(message.size());  // throws at a 64-bit, an empty or a control frame
  sender.join();
  CHECK((answer == message));
}

TEST_CASE("frames that come with the request header are not lost") {
  TestGateway gateway;
  TestClient client(gateway.port());
  const auto message = make_message("echo", 5000);
  std::string all =
      "GET /devices/x HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
      "Sec-WebSocket-Version: 13\r\n\r\n";
  all += "\x82\xfe" + std::string{static_cast<char>(message.size() >> 8), static_cast<char>(message.size())} +
         std::string(4, '\0') + std::string(rr::as_text(message));
  client.send(all);
  CHECK(client.receive_response().status == 101);
  CHECK(client.receive_payload(message.size()) == message);
}

TEST_CASE("at / the query of native clients names the node") {
  TestGateway gateway(2);
  gateway.wait_for_state("online", 0);
  gateway.wait_for_state("online", 1);
  const auto status = [&](const std::string& target) {
    return TestClient(gateway.port()).upgrade(target, native).status;
  };
  const auto id = rr::format_node_id(gateway.device(1).node_id(), rr::NodeIdFormat::dashes);
  CHECK(status("/?nodeid=" + id + "&service=test") == 101);
  CHECK(status("/?nodename=node.y&service=test") == 101);
  CHECK(status("/?nodeid=" + id + "&nodename=node.y") == 101);
  CHECK(status("/?nodeid=" + id + "&nodename=node.x") == 404);
  CHECK(status("/?nodename=other") == 404);
  CHECK(status("/?service=test") == 101);  // the gateway's own node
  CHECK(status("/?nodeid=nonsense") == 400);
  CHECK(status("/devices/other") == 404);
  CHECK(status("/devices/") == 404);
  CHECK(status("/elsewhere") == 404);
}

TEST_CASE("wrong subprotocols and origins are refused") {
  TestGateway gateway;
  const auto status = [&](const std::string& headers) {
    return TestClient(gateway.port()).upgrade("/devices/x", headers).status;
  };
  CHECK(status("Sec-WebSocket-Protocol: chat\r\n") == 426);
  CHECK(status("Origin: http://evil.example\r\n") == 403);
  CHECK(status("Origin: null\r\n") == 403);
  CHECK(status("Origin: http://localhost:8080\r\n") == 101);
  CHECK(status("") == 101);
}

TEST_CASE("a page that was loaded by a stranger's name reaches nothing, by WebSocket or HTTP") {
  TestGateway gateway(1, [](Config& config) { config.allowed_hosts = {"mybox.local"}; });
  const auto status = [&](const std::string& request) {
    TestClient client(gateway.port());
    client.send(request);
    return client.receive_response().status;
  };
  const auto upgrade = [&](const std::string& headers) {
    return status("GET /devices/x HTTP/1.1\r\n" + headers +
                  "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                  "Sec-WebSocket-Version: 13\r\n\r\n");
  };
  CHECK(upgrade("Host: evil.example\r\nOrigin: http://evil.example\r\n") == 421);
  CHECK(upgrade("Host: evil.example\r\n") == 101);
  CHECK(upgrade("Host: mybox.local\r\nOrigin: http://mybox.local\r\n") == 101);
  CHECK(status("GET /api/v1/devices HTTP/1.1\r\nHost: evil.example\r\n\r\n") == 421);
  CHECK(status("GET /api/v1/devices HTTP/1.1\r\nHost: mybox.local\r\n\r\n") == 200);
  CHECK(status("GET /healthz HTTP/1.1\r\nHost: evil.example\r\n\r\n") == 421);
}

TEST_CASE("pings are answered and closes are returned") {
  TestGateway gateway;
  TestClient client(gateway.port());
  client.upgrade("/devices/x", native);
  client.send_frame(9, rr::as_bytes("are you there"));
  const auto pong = client.receive_frame();
  CHECK(pong.first == 0x8a);
  CHECK(rr::as_text(pong.payload) == "are you there");
  client.send_frame(8, rr::as_bytes("\x03\xe9"));
  CHECK(close_reason(client.receive_frame(), 1001).empty());
  CHECK(client.receive_all().empty());
}

TEST_CASE("a native peer never sees a close frame, a page sees why") {
  TestGateway gateway(1, [](Config& config) { config.limits.max_message_size = 100'000; });
  for (const auto member : {"bye", "huge"}) {
    TestClient peer(gateway.port());
    peer.upgrade("/devices/x", native);
    peer.send_frame(2, make_message(member));
    CHECK(peer.receive_all().empty());
  }
  TestClient left(gateway.port());
  left.upgrade("/devices/x", page);
  left.send_frame(2, make_message("bye"));
  CHECK(close_reason(left.receive_frame(), 1000) == "device closed the connection");

  TestClient too_much(gateway.port());
  too_much.upgrade("/devices/x", page);
  too_much.send_frame(2, make_message("echo", 200'000));
  CHECK_THAT(close_reason(too_much.receive_frame(), 1009), Catch::Contains("above the limit of 100000"));

  TestClient from_device(gateway.port());
  from_device.upgrade("/devices/x", page);
  from_device.send_frame(2, make_message("huge"));
  CHECK_THAT(close_reason(from_device.receive_frame(), 1009), Catch::Contains("from the device"));

  TestClient wrong(gateway.port());
  wrong.upgrade("/devices/x", page);
  wrong.send_frame(2, rr::as_bytes("not a message at all"));
  close_reason(wrong.receive_frame(), 1002);

  TestClient text(gateway.port());
  text.upgrade("/devices/x", page);
  text.send_frame(1, rr::as_bytes("hello"));
  close_reason(text.receive_frame(), 1003);
}

TEST_CASE("a device that is down: 503 for native peers, a close with the reason for pages") {
  TestGateway gateway;
  gateway.wait_for_state("online");
  TestClient connected(gateway.port());
  connected.upgrade("/devices/x", page);
  gateway.end_device();
  CHECK_THAT(close_reason(connected.receive_frame(), 1000), Catch::Contains("device"));
  gateway.wait_for_state("offline");

  TestClient peer(gateway.port());
  const auto refusal = peer.upgrade("/devices/x", native);
  CHECK(refusal.status == 503);
  CHECK_THAT(refusal.body, Catch::Contains("device 'x' is offline"));
  TestClient browser(gateway.port());
  CHECK(browser.upgrade("/devices/x", page).status == 101);
  CHECK_THAT(close_reason(browser.receive_frame(), 1013), Catch::Contains("device 'x' is offline"));
  CHECK(browser.receive_all().empty());

  gateway.restart_device();
  gateway.wait_for_state("online");
  TestClient again(gateway.port());
  again.upgrade("/devices/x", page);
  const auto message = make_message("echo", 10);
  again.send_frame(2, message);
  CHECK(again.receive_payload(message.size()) == message);
}
