// Stopping: listeners first, relays within their time, then everything.
#include <catch2/catch.hpp>

#include <boost/asio/ip/tcp.hpp>

#include "test/server/support/test_gateway.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

constexpr auto long_drain = [](Config& config) { config.timeouts.drain = std::chrono::seconds(60); };

bool is_ready(const std::future<void>& future) {
  return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

const std::string page =
    "Sec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\nOrigin: http://localhost:8080\r\n";

}  // namespace

TEST_CASE("a gateway without clients stops at once") {
  TestGateway gateway(1, long_drain);
  CHECK(gateway.stop().wait_for(std::chrono::seconds(5)) == std::future_status::ready);
}

TEST_CASE("relays go on while the gateway stops, new connections are refused") {
  TestGateway gateway(1, long_drain);
  TestClient client(gateway.port());
  client.send(make_greeting());
  client.receive_message();
  TestClient idle(gateway.port());
  idle.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(idle.receive_response().status == 200);

  const auto stopped = gateway.stop();
  CHECK(idle.receive_all().empty());
  const auto status_of = [&](const std::string& path) {
    TestClient late(gateway.port());
    late.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    return late.receive_response().status;
  };
  CHECK(status_of("/readyz") == 503);
  CHECK(status_of("/healthz") == 200);
  CHECK(status_of("/api/v1/devices/x/x") == 503);
  TestClient late(gateway.port());
  late.send(make_greeting());
  CHECK(late.receive_all().empty());
  const auto message = make_message("echo", 100'000);
  client.send(message);
  CHECK(client.receive_message() == message);
  CHECK_FALSE(is_ready(stopped));
  client.send(make_message("bye"));
  CHECK(client.receive_all().empty());
  CHECK(stopped.wait_for(std::chrono::seconds(5)) == std::future_status::ready);
}

TEST_CASE("what is left at the deadline is ended with a reason") {
  TestGateway gateway(1, [](Config& config) { config.timeouts.drain = milliseconds(200); });
  TestClient browser(gateway.port());
  browser.upgrade("/devices/x", page);
  TestClient peer(gateway.port());
  peer.send(make_greeting());
  peer.receive_message();
  const auto stopped = gateway.stop();
  const auto frame = browser.receive_frame();
  CHECK(frame.first == 0x88);
  CHECK((frame.payload.at(0) << 8 | frame.payload.at(1)) == 1001);
  CHECK(peer.receive_all().empty());
  CHECK(stopped.wait_for(std::chrono::seconds(5)) == std::future_status::ready);
}

TEST_CASE("a device that hangs while it is dialed doesn't hold up the end") {
  boost::asio::io_context never_run;
  using boost::asio::ip::tcp;
  tcp::acceptor hanging(never_run, tcp::v4());
  hanging.bind({boost::asio::ip::address_v4::loopback(), 0});
  hanging.listen(0);
  std::vector<tcp::socket> fillers;  // a full accept queue: further connections wait for an answer that never comes
  for (int i = 0; i < 8; ++i) {
    fillers.emplace_back(never_run, tcp::v4());
    fillers.back().async_connect(hanging.local_endpoint(), [](const auto&) {});
  }
  const auto url = "rr+tcp://127.0.0.1:" + std::to_string(hanging.local_endpoint().port()) + "/?service=x";
  auto gateway = std::make_unique<TestGateway>(1, [&](Config& config) {
    config.devices[0].url = rr::parse_url(url).value();
    config.timeouts.connect = std::chrono::seconds(60);
  });
  TestClient client(gateway->port());
  client.send(make_greeting());
  gateway->wait_for_state("connecting");
  const auto begin = std::chrono::steady_clock::now();
  gateway.reset();  // waits until its loop has nothing left to do
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(10));
}

TEST_CASE("a client that takes nothing doesn't hold up the end") {
  TestGateway gateway;
  TestClient stuck(gateway.port());
  stuck.send(make_greeting());
  stuck.receive_message();
  stuck.send(make_message("flood"));
  while (gateway.device().flooded() < 1'000'000) std::this_thread::yield();
  CHECK(gateway.stop().wait_for(std::chrono::seconds(5)) == std::future_status::ready);
}
