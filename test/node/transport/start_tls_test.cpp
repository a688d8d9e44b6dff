#include "node/transport/start_tls.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>

#include "core/wire/codec.hpp"
#include "test/node/transport/certificate_lab.hpp"
#include "test/node/transport/memory_stream.hpp"

using namespace rr;
using namespace rr::test;
namespace asio = boost::asio;

namespace {

constexpr std::chrono::milliseconds patience{2000};

/// A client and a service that meet for the first time.
struct Meeting {
  explicit Meeting(std::size_t piece = 64 * 1024) : streams(io.get_executor(), 64 * 1024, piece) {
    options.self = {service_node, "the.service"};
    options.timeout = patience;
  }

  void accept() {
    const auto work = [](Meeting& self) -> awaitable<void> {
      self.accepted = co_await accept_tls(std::move(self.streams.server), self.options);
    };
    asio::co_spawn(io, work(*this), asio::detached);
  }
  void start_client(NodeIdentity target, TlsContextPtr context) {
    const auto work = [](Meeting& self, NodeIdentity wanted, TlsContextPtr own) -> awaitable<void> {
      self.started =
          co_await start_tls_client(std::move(self.streams.client), std::move(wanted), std::move(own), patience);
    };
    asio::co_spawn(io, work(*this, std::move(target), std::move(context)), asio::detached);
  }
  /// What the client says, and what comes back to it.
  void say(const Bytes& bytes) {
    auto& pipe = *streams.to_server;
    pipe.bytes.insert(pipe.bytes.end(), bytes.begin(), bytes.end());
  }
  Message heard() {
    Message message;
    kept.assign(streams.to_client->bytes.begin(), streams.to_client->bytes.end());
    REQUIRE(decode(kept, {}, message).has_value());
    return message;
  }
  void run() { io.run_for(patience * 3); }

  asio::io_context io;
  MemoryStreams streams;
  AcceptTlsOptions options;
  Result<AcceptedStream> accepted = protocol_error("not accepted in time");
  Result<std::unique_ptr<ByteStream>> started = protocol_error("not started in time");
  Bytes kept;
};

Bytes stream_op(std::string_view member, const NodeId& sender = {}, const NodeId& receiver = {}) {
  Message message;
  message.header.version = 2;
  message.header.sender_node_id = sender;
  message.header.receiver_node_id = receiver;
  message.begin_entry(EntryType::stream_op, {}, member);
  EncodedMessage encoded;
  REQUIRE(encode(message, {}, encoded).has_value());
  return encoded.to_bytes();
}

std::string error_text(const Message& message) {
  REQUIRE(message.entries.size() == 1);
  const auto* text = message.elements_of(message.entries[0]).find("errorstring");
  return text ? std::string(text->text()) : "(none)";
}

}  // namespace

TEST_CASE("STARTTLS: both sides come out with a stream that knows its peer", "[tls]") {
  CertificateLab lab;
  const std::size_t piece = GENERATE(std::size_t{1}, std::size_t{64 * 1024});
  const bool has_certificate = GENERATE(true, false);
  Meeting meeting(piece);
  meeting.options.context = lab.context(lab.good(service_node));
  meeting.accept();
  meeting.start_client(GENERATE(NodeIdentity{service_node, ""}, NodeIdentity{{}, "the.service"}, NodeIdentity{}),
                       has_certificate ? lab.context(lab.good(client_node)) : lab.anonymous());
  meeting.run();
  if (!meeting.started) FAIL(meeting.started.error().message);
  if (!meeting.accepted) FAIL(meeting.accepted.error().message);
  CHECK((*meeting.started)->verified_peer() == service_node);
  CHECK(meeting.accepted->stream->verified_peer() == (has_certificate ? client_node : NodeId{}));
  CHECK(meeting.accepted->is_encrypted);
}

TEST_CASE("STARTTLS: a service that is not the one meant", "[tls]") {
  CertificateLab lab;
  Meeting meeting;
  meeting.options.context = lab.context(lab.good(service_node));
  meeting.accept();
  meeting.start_client(GENERATE(NodeIdentity{client_node, ""}, NodeIdentity{{}, "another.service"}), lab.anonymous());
  meeting.run();
  REQUIRE_FALSE(meeting.started.has_value());
  CHECK(meeting.started.error().code == ErrorCode::node_not_found);
  CHECK_THAT(meeting.started.error().message, Catch::Contains("Node not found"));
  CHECK_FALSE(meeting.accepted.has_value());
}

TEST_CASE("STARTTLS: a service without certificate says so", "[tls]") {
  CertificateLab lab;
  Meeting meeting;
  meeting.accept();
  meeting.start_client({}, lab.anonymous());
  meeting.run();
  REQUIRE_FALSE(meeting.started.has_value());
  CHECK(meeting.started.error().code == ErrorCode::connection_error);
  CHECK_THAT(meeting.started.error().message, Catch::Contains("Server certificate not loaded"));
}

TEST_CASE("STARTTLS: a client that gets no sensible answer", "[tls]") {
  CertificateLab lab;
  Meeting meeting;
  meeting.start_client({service_node, ""}, lab.anonymous());
  std::string expected;
  SECTION("another node answers") {
    FirstRequest answer = answer_first_request(stream_op("STARTTLS"), {client_node, "x"}, true).value();
    meeting.streams.to_client->bytes.assign(answer.reply.begin(), answer.reply.end());
    expected = "wrong node: found {aaaaaaaa-0100";
  }
  SECTION("an answer to something else") {
    FirstRequest answer = answer_first_request(stream_op("GetRemoteNodeID"), {service_node, "x"}, true).value();
    meeting.streams.to_client->bytes.assign(answer.reply.begin(), answer.reply.end());
    expected = "answered something else";
  }
  SECTION("HTTP") {
    const auto text = as_bytes("HTTP/1.1 404 File Not Found\r\n\r\n");
    meeting.streams.to_client->bytes.assign(text.begin(), text.end());
    expected = "does not speak Robot Raconteur";
  }
  SECTION("the end") {
    meeting.streams.to_client->is_ended = true;
    expected = "STARTTLS: ended before a message was there";
  }
  SECTION("nothing") {
    expected = "no message within 2000 ms";
  }
  meeting.run();
  REQUIRE_FALSE(meeting.started.has_value());
  CHECK_THAT(meeting.started.error().message, Catch::Contains(expected));
}

TEST_CASE("who does not ask for TLS is served in clear, with nothing lost", "[tls]") {
  CertificateLab lab;
  Meeting meeting(GENERATE(std::size_t{1}, std::size_t{64 * 1024}));
  meeting.options.context = lab.context(lab.good(service_node));
  auto said = stream_op("CreateConnection");
  const bool is_http = GENERATE(false, true);
  if (is_http) {
    const auto text = as_bytes("GET / HTTP/1.1\r\n\r\n");
    said.assign(text.begin(), text.end());
  }
  meeting.accept();
  meeting.say(said);
  meeting.run();
  REQUIRE(meeting.accepted.has_value());
  CHECK_FALSE(meeting.accepted->is_encrypted);
  CHECK(meeting.accepted->stream->verified_peer().is_any());
  Bytes received;
  const auto read = [&]() -> awaitable<void> {
    while (received.size() < said.size()) {
      std::uint8_t byte = 0;
      const auto one = co_await meeting.accepted->stream->read_some({&byte, 1});
      if (one.bytes == 0) co_return;
      received.push_back(byte);
    }
  };
  asio::co_spawn(meeting.io, read(), asio::detached);
  meeting.io.restart();
  meeting.io.run_for(patience);
  CHECK(received == said);
}

TEST_CASE("GetRemoteNodeID before STARTTLS is answered", "[tls]") {
  CertificateLab lab;
  Meeting meeting;
  meeting.options.context = lab.context(lab.good(service_node));
  meeting.say(stream_op("GetRemoteNodeID"));
  meeting.accept();
  meeting.io.poll();
  CHECK(meeting.heard().header.sender_node_id == service_node);
  meeting.streams.to_client->bytes.clear();
  meeting.start_client({service_node, ""}, lab.anonymous());
  meeting.run();
  CHECK(meeting.started.has_value());
  CHECK(meeting.accepted.has_value());
}

TEST_CASE("where TLS is required, a client in clear is told", "[tls]") {
  CertificateLab lab;
  Meeting meeting;
  meeting.options.context = lab.context(lab.good(service_node));
  meeting.options.is_required = true;
  meeting.say(stream_op("CreateConnection"));
  meeting.accept();
  meeting.run();
  CHECK_FALSE(meeting.accepted.has_value());
  CHECK_THAT(error_text(meeting.heard()), Catch::Contains("use rrs+tcp"));
}

TEST_CASE("a client that says who it is must prove just that", "[tls]") {
  CertificateLab lab;
  Meeting meeting;
  meeting.options.context = lab.context(lab.good(service_node));
  meeting.say(stream_op("STARTTLS", client_node));
  meeting.accept();
  meeting.io.poll();
  const auto reply = meeting.heard();
  CHECK(reply.entries.at(0).error == ErrorCode::none);
  CHECK(reply.header.receiver_node_id == client_node);
}

TEST_CASE("what follows STARTTLS in clear is no command", "[tls]") {
  CertificateLab lab;
  Meeting meeting;
  meeting.options.context = lab.context(lab.good(service_node));
  meeting.say(stream_op("STARTTLS"));
  meeting.say(stream_op("CreateConnection"));
  meeting.accept();
  meeting.run();
  REQUIRE_FALSE(meeting.accepted.has_value());
  CHECK_THAT(meeting.accepted.error().message, Catch::Contains("TLS"));
}

TEST_CASE("names in certificates", "[tls]") {
  const NodeId id{{0x82, 0x30, 0x1b, 0xf1, 0xe1, 0xef, 0x4e, 0x89, 0x8d, 0x8f, 0x08, 0x48, 0x29, 0x15, 0x87, 0xac}};
  const auto name = format_certificate_name(id);
  CHECK(name == "Robot Raconteur Node {82301bf1-e1ef-4e89-8d8f-0848291587ac}");
  CHECK(parse_certificate_name(name).value() == id);
  for (const std::string bad :
       {"", "Robot Raconteur Node ", "Robot Raconteur Node 82301bf1-e1ef-4e89-8d8f-0848291587ac",
        "Robot Raconteur Node {82301BF1-e1ef-4e89-8d8f-0848291587ac}", "robot.example",
        "Robot Raconteur Node {82301bf1e1ef4e898d8f0848291587ac}", "Robot Raconteur Node {0}",
        "Robot Raconteur Node {00000000-0000-0000-0000-000000000000}"})
    CHECK_FALSE(parse_certificate_name(bad).has_value());
  CHECK_FALSE(parse_certificate_name(name + std::string(1, '\0')).has_value());
  CHECK_FALSE(parse_certificate_name(name + " ").has_value());
}
