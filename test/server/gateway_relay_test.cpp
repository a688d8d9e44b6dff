// Relaying native clients, over real sockets.
#include <catch2/catch.hpp>
#include <fstream>
#include <random>
#include <thread>

#include "core/wire/codec.hpp"
#include "test/server/support/test_gateway.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

struct Greeting {
  rr::ErrorCode error;
  rr::NodeId node_id;
  std::string node_name;
  std::string text;
};

Greeting greet(TestClient& client, const rr::NodeId& receiver = {}, std::string_view receiver_name = {}) {
  client.send(make_greeting(receiver, receiver_name));
  const auto bytes = client.receive_message();
  rr::Message reply;
  REQUIRE(rr::decode(bytes, {}, reply).has_value());
  REQUIRE(reply.entries.size() == 1);
  REQUIRE(reply.entries[0].type == rr::EntryType::stream_op_ret);
  const auto* text = reply.elements_of(reply.entries[0]).find("errorstring");
  return {reply.entries[0].error, reply.header.sender_node_id, std::string(reply.header.sender_node_name),
          text ? std::string(text->text()) : std::string()};
}

bool echoes(TestClient& client, std::size_t payload) {
  const auto message = make_message("echo", payload);
  std::thread sender([&] { client.send(message); });  // both directions at once: neither side may wait for the other
  const auto answer = client.receive(message.size());
  sender.join();
  return answer == message;
}

std::size_t resident_bytes() {
  std::ifstream in("/proc/self/statm");
  std::size_t total = 0;
  std::size_t resident = 0;
  in >> total >> resident;
  return resident * 4096;
}

}  // namespace

TEST_CASE("a native client reaches the only device without naming it") {
  TestGateway gateway;
  TestClient client(gateway.port());
  const auto greeting = greet(client);
  CHECK(greeting.error == rr::ErrorCode::none);
  CHECK(greeting.node_id == gateway.device().node_id());
  CHECK(echoes(client, 10));
  CHECK(echoes(client, 10'000'000));
}

TEST_CASE("a native client reaches a device by node id and name") {
  TestGateway gateway(3);
  for (std::size_t i = 0; i < 3; ++i) gateway.wait_for_state("online", i);
  TestClient by_id(gateway.port());
  CHECK(greet(by_id, gateway.device(1).node_id()).node_name == "node.y");
  TestClient by_name(gateway.port());
  CHECK(greet(by_name, {}, "node.z").node_name == "node.z");
  TestClient by_both(gateway.port());
  CHECK(greet(by_both, gateway.device(0).node_id(), "node.x").node_name == "node.x");
}

TEST_CASE("a native client that no device is meant by gets NodeNotFound") {
  TestGateway gateway(2);
  gateway.wait_for_state("online", 0);
  gateway.wait_for_state("online", 1);
  const auto refused = [&](const rr::NodeId& id, std::string_view name) {
    TestClient client(gateway.port());
    const auto greeting = greet(client, id, name);
    CHECK(greeting.error == rr::ErrorCode::node_not_found);
    CHECK(client.receive_all().empty());
  };
  refused({}, "node.other");
  refused(gateway.device(0).node_id(), "node.y");
  rr::NodeId other;
  other.bytes.fill(0xee);
  refused(other, "");
}

TEST_CASE("who asks for no node in particular, where there are several devices, gets the gateway's own") {
  TestGateway gateway(2);
  gateway.wait_for_state("online", 0);
  gateway.wait_for_state("online", 1);
  TestClient client(gateway.port());
  const auto greeting = greet(client);
  CHECK(greeting.error == rr::ErrorCode::none);
  CHECK(greeting.node_name == "rrgate");
  TestClient by_name(gateway.port());
  CHECK(greet(by_name, {}, "rrgate").node_id == greeting.node_id);
  TestClient by_id(gateway.port());
  CHECK(greet(by_id, greeting.node_id).node_name == "rrgate");
}

TEST_CASE("a device that is down is told, and taken again when it is back") {
  TestGateway gateway;
  gateway.wait_for_state("online");
  TestClient before(gateway.port());
  CHECK(greet(before).error == rr::ErrorCode::none);
  gateway.end_device();
  CHECK(before.receive_all().empty());
  CHECK_THAT(gateway.wait_for_state("offline"), Catch::Contains("refused"));
  TestClient during(gateway.port());
  const auto refusal = greet(during);
  CHECK(refusal.error == rr::ErrorCode::connection_error);
  CHECK_THAT(refusal.text, Catch::Contains("device 'x' is offline"));
  gateway.restart_device();
  CHECK_THAT(gateway.wait_for_state("online"), Catch::Contains("\"last_error\":null"));
  TestClient after(gateway.port());
  CHECK(greet(after).error == rr::ErrorCode::none);
}

TEST_CASE("messages arrive whole, sent byte by byte") {
  TestGateway gateway;
  TestClient client(gateway.port());
  for (const auto byte : make_greeting()) client.send(rr::ByteSpan(&byte, 1));
  client.receive_message();
  const auto message = make_message("echo", 30);
  for (const auto byte : message) client.send(rr::ByteSpan(&byte, 1));
  CHECK(client.receive_message() == message);
}

TEST_CASE("messages sent behind the greeting are not lost") {
  TestGateway gateway;
  TestClient client(gateway.port());
  auto all = make_greeting();
  const auto message = make_message("echo", 20'000);
  all.insert(all.end(), message.begin(), message.end());
  client.send(all);
  client.receive_message();
  CHECK(client.receive_message() == message);
}

TEST_CASE("a message above the limit closes that connection alone") {
  TestGateway gateway(1, [](Config& config) { config.limits.max_message_size = 100'000; });
  TestClient good(gateway.port());
  greet(good);
  TestClient bad(gateway.port());
  greet(bad);
  bad.send(make_message("echo", 200'000));
  CHECK(bad.receive_all().empty());
  TestClient unlucky(gateway.port());
  greet(unlucky);
  unlucky.send(make_message("huge"));  // this time it is the device that sends too much
  CHECK(unlucky.receive_all().empty());
  CHECK(echoes(good, 90'000));
}

TEST_CASE("what follows a wrong message start doesn't reach the device") {
  TestGateway gateway;
  TestClient client(gateway.port());
  greet(client);
  client.send("RRAX and so on");
  CHECK(client.receive_all().empty());
}

TEST_CASE("answers on their way still come when the client has ended its side") {
  TestGateway gateway;
  TestClient client(gateway.port());
  greet(client);
  const auto message = make_message("echo", 1'000'000);
  client.send(message);
  client.finish_sending();
  CHECK(client.receive_message() == message);
  CHECK(client.receive_all().empty());
}

TEST_CASE("a device that closes ends its client") {
  TestGateway gateway;
  TestClient client(gateway.port());
  greet(client);
  client.send(make_message("bye"));
  CHECK(client.receive_all().empty());
}

TEST_CASE("200 clients: one that stops reading slows no other and grows no memory") {
  TestGateway gateway(1, [](Config& config) { config.timeouts.send_stall = milliseconds(1000); });
  std::vector<TestClient> clients;
  for (int i = 0; i < 200; ++i) {
    clients.emplace_back(gateway.port());
    CHECK(greet(clients.back()).error == rr::ErrorCode::none);
  }
  // What a first message costs each relay is not what a flood adds.
  for (auto& client : clients) CHECK(echoes(client, 1000));
  const auto memory_before = resident_bytes();
  clients[0].send(make_message("flood"));
  for (int round = 0; round < 5; ++round)
    for (std::size_t i = 1; i < clients.size(); ++i) CHECK(echoes(clients[i], 1000));
  // The stalled client is cut after a second without progress; what left the device until then is in kernel buffers.
  gateway.wait_for_device(0, [](const auto& device) { return device["clients"] == 199; });
  CHECK(gateway.device().flooded() > 100'000);
  CHECK(gateway.device().flooded() < 64u << 20);
  CHECK(resident_bytes() < memory_before + (32u << 20));
  CHECK(clients[0].receive_all().size() < 64u << 20);
  CHECK(echoes(clients[199], 1000));
}

TEST_CASE("a device takes as many clients as it may, and one more when one has left") {
  TestGateway gateway(1, [](Config& config) { config.devices[0].max_clients = 2; });
  auto first = std::make_unique<TestClient>(gateway.port());
  CHECK(greet(*first).error == rr::ErrorCode::none);
  TestClient second(gateway.port());
  CHECK(greet(second).error == rr::ErrorCode::none);
  TestClient third(gateway.port());
  const auto refusal = greet(third);
  CHECK(refusal.error == rr::ErrorCode::connection_error);
  CHECK_THAT(refusal.text, Catch::Contains("all the clients it may have"));
  first->send(make_message("bye"));
  first->receive_all();
  gateway.wait_for_device(0, [](const auto& device) { return device["clients"] == 1; });
  TestClient fourth(gateway.port());
  CHECK(greet(fourth).error == rr::ErrorCode::none);
}

TEST_CASE("connections beyond the limit of an address are closed") {
  TestGateway gateway(1, [](Config& config) { config.limits.clients_per_address = 3; });
  std::vector<TestClient> clients;
  for (int i = 0; i < 3; ++i) {
    clients.emplace_back(gateway.port());
    greet(clients.back());
  }
  TestClient refused(gateway.port());
  CHECK(refused.receive_all().empty());
  TestClient elsewhere(gateway.port());
  CHECK(elsewhere.receive_all().empty());
  CHECK(echoes(clients[0], 10));
}

TEST_CASE("garbage never hurts: random bytes, cut and mixed with what is right") {
  TestGateway gateway(1, [](Config& config) { config.limits.header_timeout = milliseconds(300); });
  TestClient good(gateway.port());
  greet(good);
  std::mt19937 random(7);
  const std::string starts[] = {
      "", "RRAC", "GET ", "GET / HTTP/1.1\r\n", "\x16\x03\x01", "POST /", "PRI * HTTP/2.0\r\n\r\n"};
  for (int i = 0; i < 300; ++i) {
    TestClient client(gateway.port());
    auto text = starts[random() % std::size(starts)];
    if (i % 5 == 0) text = std::string(rr::as_text(make_greeting())).substr(0, random() % 80);
    const auto size = random() % (i % 7 == 0 ? 100'000 : 100);
    for (std::size_t k = 0; k < size; ++k) text += static_cast<char>(random());
    client.send(text);
    if (i % 3 != 0) client.finish_sending();
    if (i % 2 == 0) client.receive_all();
  }
  CHECK(echoes(good, 1000));
}
