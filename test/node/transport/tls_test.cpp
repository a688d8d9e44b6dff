#include "node/transport/tls.hpp"

#include <openssl/ssl.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>

#include "test/node/transport/certificate_lab.hpp"
#include "test/node/transport/memory_stream.hpp"

using namespace rr;
using namespace rr::test;
namespace asio = boost::asio;

namespace {

constexpr std::chrono::milliseconds patience{5000};

/// Both ends of a connection, with their handshakes done or failed.
struct TlsPair {
  TlsPair(TlsContextPtr client_context, TlsContextPtr server_context, std::size_t piece = 64 * 1024,
          const TlsPeerOptions& at_client = {}, const TlsPeerOptions& at_server = {})
      : streams(io.get_executor(), 64 * 1024, piece),
        client(std::move(streams.client), std::move(client_context), TlsRole::client, at_client),
        server(std::move(streams.server), std::move(server_context), TlsRole::server, at_server) {
    spawn([](TlsPair& pair) -> awaitable<void> { pair.client_result = co_await pair.client.handshake(patience); });
    spawn([](TlsPair& pair) -> awaitable<void> { pair.server_result = co_await pair.server.handshake(patience); });
    run();
  }

  template <class F>
  void spawn(F what) {
    asio::co_spawn(io, what(*this), asio::detached);
  }
  void run() {
    io.restart();
    io.run_for(patience * 2);
  }

  asio::io_context io;
  MemoryStreams streams;
  TlsStream client;
  TlsStream server;
  Result<> client_result = protocol_error("the handshake did not end");
  Result<> server_result = protocol_error("the handshake did not end");
};

awaitable<void> read_all(ByteStream& stream, Bytes& into, error_code& error) {
  Bytes buffer(10'000);
  for (;;) {
    const auto read = co_await stream.read_some(buffer);
    error = read.error;
    if (read.error || read.is_end()) co_return;
    into.insert(into.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(read.bytes));
  }
}

awaitable<void> write_and_end(ByteStream& stream, const std::vector<Bytes>& parts, bool& is_done) {
  std::vector<ByteSpan> slices(parts.begin(), parts.end());
  const auto error = co_await stream.write(slices);
  CHECK_FALSE(error);
  co_await stream.end(no_reason);
  is_done = true;
}

Bytes pattern(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
  return bytes;
}

TlsContextPtr limited_to_tls12(TlsContextPtr context) {
  SSL_CTX_set_max_proto_version(context->native(), TLS1_2_VERSION);
  return context;
}

}  // namespace

TEST_CASE("TLS carries bytes in pieces of any size, and both sides know each other", "[tls]") {
  CertificateLab lab;
  const bool is_old = GENERATE(false, true);
  const std::size_t piece = GENERATE(std::size_t{1}, std::size_t{1000}, std::size_t{64 * 1024});
  auto client_context = lab.context(lab.good(client_node));
  if (is_old) client_context = limited_to_tls12(client_context);
  TlsPeerOptions at_client;
  at_client.expected = service_node;
  TlsPair pair(client_context, lab.context(lab.good(service_node)), piece, at_client);
  if (!pair.client_result) FAIL(pair.client_result.error().message);
  if (!pair.server_result) FAIL(pair.server_result.error().message);
  CHECK(pair.client.verified_peer() == service_node);
  CHECK(pair.server.verified_peer() == client_node);
  CHECK(pair.client.version() == (is_old ? "TLSv1.2" : "TLSv1.3"));

  const std::vector<Bytes> parts = {pattern(3), {}, pattern(20), pattern(40'000), pattern(16 * 1024), pattern(1)};
  Bytes all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  Bytes received;
  error_code error = asio::error::fault;
  bool is_sent = false;
  asio::co_spawn(pair.io, read_all(pair.server, received, error), asio::detached);
  asio::co_spawn(pair.io, write_and_end(pair.client, parts, is_sent), asio::detached);
  pair.run();
  CHECK(is_sent);
  CHECK(received.size() == all.size());
  CHECK((received == all));
  CHECK_FALSE(error);
}

TEST_CASE("a TLS writer waits for its reader, and holds little meanwhile", "[tls]") {
  CertificateLab lab;
  TlsPair pair(lab.anonymous(), lab.context(lab.good(service_node)));
  REQUIRE(pair.client_result.has_value());
  const std::vector<Bytes> parts = {pattern(3'000'000)};
  bool is_sent = false;
  asio::co_spawn(pair.io, write_and_end(pair.server, parts, is_sent), asio::detached);
  pair.io.restart();
  pair.io.poll();
  CHECK_FALSE(is_sent);
  CHECK(pair.streams.to_client->bytes.size() <= 64 * 1024);
  CHECK(pair.streams.to_client->carried < 200'000);

  Bytes received;
  error_code error;
  asio::co_spawn(pair.io, read_all(pair.client, received, error), asio::detached);
  pair.run();
  CHECK(is_sent);
  CHECK(received.size() == parts.front().size());
  CHECK_FALSE(error);
  CHECK((received == parts.front()));
}

TEST_CASE("a TLS stream that is cut is not one that ended", "[tls]") {
  CertificateLab lab;
  TlsPair pair(lab.anonymous(), lab.context(lab.good(service_node)));
  REQUIRE(pair.client_result.has_value());
  pair.streams.to_client->is_ended = true;
  Bytes received;
  error_code error;
  asio::co_spawn(pair.io, read_all(pair.client, received, error), asio::detached);
  pair.run();
  CHECK(error == asio::error::eof);
}

TEST_CASE("bytes that are no TLS are an error, and change no memory but ours", "[tls]") {
  CertificateLab lab;
  TlsPair pair(lab.anonymous(), lab.context(lab.good(service_node)));
  REQUIRE(pair.client_result.has_value());
  const auto junk = GENERATE(as<std::string>(), "RRAC....", "\x17\x03\x03\x00\x20 0123456789abcdef0123456789abcdef",
                             "\x16\x03\x03\xff\xff");
  pair.streams.to_client->bytes.assign(junk.begin(), junk.end());
  pair.streams.to_client->is_ended = true;
  Bytes received;
  error_code error;
  asio::co_spawn(pair.io, read_all(pair.client, received, error), asio::detached);
  pair.run();
  CHECK(error);
  CHECK(received.empty());
}

TEST_CASE("a client without certificate is let in, but nobody vouches for it", "[tls]") {
  CertificateLab lab;
  TlsPair pair(lab.anonymous(), lab.context(lab.good(service_node)));
  CHECK(pair.client_result.has_value());
  CHECK(pair.server_result.has_value());
  CHECK(pair.server.verified_peer().is_any());
}

TEST_CASE("a client that is not asked for its certificate shows none", "[tls]") {
  CertificateLab lab;
  TlsPeerOptions at_server;
  at_server.asks_certificate = false;
  TlsPair pair(lab.context(lab.good(client_node)), lab.context(lab.good(service_node)), 1000, {}, at_server);
  CHECK(pair.server_result.has_value());
  CHECK(pair.server.verified_peer().is_any());
}

TEST_CASE("a node may be certified through intermediate CAs", "[tls]") {
  CertificateLab lab;
  const auto upper = issue(ca_wish("Upper CA", intermediate_oid), &lab.ca);
  const auto lower = issue(ca_wish("Lower CA", intermediate_oid), &upper);
  const auto node = issue(node_wish(), &lower);
  const auto file = lab.bundle(node, lower.certificate + upper.certificate + lab.ca.certificate);
  TlsPair pair(lab.anonymous(), lab.context({file, service_node, lab.trust()}));
  if (!pair.client_result) FAIL(pair.client_result.error().message);
  CHECK(pair.client.verified_peer() == service_node);
}

TEST_CASE("certificates of services that are refused, and why", "[tls]") {
  CertificateLab lab;
  CertificateLab other_lab;
  struct Case {
    const char* name;
    CertificateAndKey node;
    std::string chain;
    const char* message;
  };
  const auto node_with = [&](auto&& change) {
    auto wish = node_wish();
    change(wish);
    return issue(wish, &lab.ca);
  };
  const auto plain_ca = issue(ca_wish("Plain CA", ""), &lab.ca);
  const auto old_ca = [&] {
    auto wish = ca_wish("Old CA", intermediate_oid);
    wish.ends_after_seconds = -one_day;
    return issue(wish, &lab.ca);
  }();
  const auto good_ca = issue(ca_wish("Good CA", intermediate_oid), &lab.ca);
  const Case cases[] = {
      {"not yet valid",
       node_with([](auto& wish) { wish.begins_after_seconds = one_day / 2; }),
       {},
       "is not valid before "},
      {"no mark",
       node_with([](auto& wish) { wish.node_level_oid = ""; }),
       {},
       "found no extension 1.3.6.1.4.1.45455.1.1.3.3"},
      {"marked as another level",
       node_with([](auto& wish) { wish.node_level_oid = intermediate_oid; }),
       {},
       "has the critical extension 1.3.6.1.4.1.45455.1.1.3.2"},
      {"another CA", issue(node_wish(), &other_lab.ca), {}, "which is no trusted CA and was not sent along"},
      {"self-signed", issue(node_wish(), nullptr), {}, "is self-signed"},
      {"below a CA without mark", issue(node_wish(), &plain_ca), plain_ca.certificate,
       "found no extension 1.3.6.1.4.1.45455.1.1.3.2"},
      {"below a CA that has expired", issue(node_wish(), &old_ca), old_ca.certificate, "Old CA' expired at"},
      {"CA not sent", issue(node_wish(), &good_ca), {}, "which is no trusted CA and was not sent along"},
  };
  for (const auto& each : cases) {
    SECTION(each.name) {
      const auto file = lab.bundle(each.node, each.chain);
      TlsPair pair(lab.anonymous(), lab.context({file, service_node, lab.trust()}));
      REQUIRE_FALSE(pair.client_result.has_value());
      CHECK(pair.client_result.error().code == ErrorCode::authentication_error);
      CHECK_THAT(pair.client_result.error().message, Catch::Contains(each.message));
      CHECK(pair.client.verified_peer().is_any());
    }
  }
  SECTION("expired") {  // a node does not load it, but may have run for too long
    auto wish = node_wish();
    wish.ends_after_seconds = 1;
    const auto context = lab.context({lab.bundle(issue(wish, &lab.ca)), service_node, lab.trust()});
    asio::io_context io;
    asio::steady_timer(io, std::chrono::milliseconds(2100)).wait();
    TlsPair pair(lab.anonymous(), context);
    REQUIRE_FALSE(pair.client_result.has_value());
    CHECK_THAT(pair.client_result.error().message, Catch::Contains("expired at"));
  }
  SECTION("of another node") {
    TlsPeerOptions at_client;
    at_client.expected = client_node;
    TlsPair pair(lab.anonymous(), lab.context(lab.good(service_node)), 1000, at_client);
    REQUIRE_FALSE(pair.client_result.has_value());
    CHECK_THAT(pair.client_result.error().message, Catch::Contains("the certificate is of node {11111111-0200") &&
                                                       Catch::Contains("expected node {aaaaaaaa-0100"));
  }
}

TEST_CASE("a client's certificate that is refused ends the handshake; both sides say so", "[tls]") {
  CertificateLab lab;
  CertificateLab other_lab;
  auto options = other_lab.good(client_node);
  options.trust = lab.trust();
  TlsPair pair(limited_to_tls12(lab.context(options)), lab.context(lab.good(service_node)));
  REQUIRE_FALSE(pair.server_result.has_value());
  CHECK_THAT(pair.server_result.error().message, Catch::Contains("which is no trusted CA"));
  REQUIRE_FALSE(pair.client_result.has_value());
  CHECK_THAT(pair.client_result.error().message, Catch::Contains("the peer refused") && Catch::Contains("alert"));
}

TEST_CASE("node certificates that are not loaded, and why", "[tls]") {
  CertificateLab lab;
  const auto refusal = [&](const std::string& file, const NodeId& id = service_node, const TlsTrust& trust = {}) {
    const auto made = make_node_tls({file, id, trust});
    return made ? std::string("(loaded)") : made.error().message;
  };
  const auto good = lab.bundle(issue(node_wish(), &lab.ca));
  CHECK(refusal(good) == "(loaded)");
  CHECK_THAT(refusal("/nowhere/node.p12"), Catch::Contains("/nowhere/node.p12") && Catch::Contains("No such file"));
  CHECK_THAT(refusal(lab.folder().write("text.p12", "hello")), Catch::Contains("not a PKCS#12 file"));
  CHECK_THAT(refusal(good, client_node), Catch::Contains("it is of node {11111111-0200-0000"));
  auto wish = node_wish();
  wish.common_name = "Robot Raconteur Node {11111111-0200-0000-0000-00000000000A}";
  CHECK_THAT(refusal(lab.bundle(issue(wish, &lab.ca))), Catch::Contains("lower case"));
  wish = node_wish();
  wish.ends_after_seconds = -1;
  CHECK_THAT(refusal(lab.bundle(issue(wish, &lab.ca))), Catch::Contains("expired"));
  CHECK_THAT(refusal({}, {}, {{"/nowhere/ca.pem"}, {}, {}}), Catch::Contains("/nowhere/ca.pem"));
  CHECK_THAT(refusal({}, {}, {{lab.folder().write("no.pem", "hello")}, {}, {}}),
             Catch::Contains("expected certificates"));
  CHECK_THAT(refusal({}, {}, {{}, {}, {lab.folder().path("ca.pem")}}), Catch::Contains("published"));
}

TEST_CASE("HTTPS: a client takes the certificate of the host that it asked for, and no other's", "[tls]") {
  CertificateLab lab;
  const auto ca = issue(ca_wish("Web CA", ""), nullptr);
  const auto server = [&](const char* name, std::vector<std::string> hosts) {
    auto wish = node_wish();
    wish.common_name = name;
    wish.node_level_oid = "";
    wish.hosts = std::move(hosts);
    const auto made = issue(wish, &ca);
    return WebCertificate{lab.folder().write(std::string(name) + ".pem", made.certificate),
                          lab.folder().write(std::string(name) + ".key", made.key)};
  };
  const WebCertificate certificates[] = {server("one", {"one.example", "127.0.0.1", "::1", "fe80::1"}),
                                         server("two", {"two.example", "*.two.example"})};
  const auto at_server = make_web_tls(certificates).value();
  const auto at_client = make_web_client_tls({{lab.folder().write("web-ca.pem", ca.certificate)}, {}, {}}).value();
  const auto result_for = [&](const std::string& host) {
    TlsPeerOptions peer;
    peer.host = host;
    TlsPair pair(at_client, at_server, 1000, peer);
    return pair.client_result ? std::string("good") : pair.client_result.error().message;
  };
  for (const auto* host :
       {"one.example", "127.0.0.1", "::1", "fe80::1%eth0", "two.example", "TWO.example", "a.two.example"})
    CHECK(result_for(host) == "good");
  for (const auto* host : {"one.example", "two.example", "TWO.example", "a.two.example"})
    CHECK(at_server->has_name(host));
  for (const auto* host : {"three.example", "a.b.two.example", "example", ""}) CHECK_FALSE(at_server->has_name(host));
  CHECK_THAT(result_for("three.example"), Catch::Contains("hostname mismatch"));
  CHECK_THAT(result_for("a.b.two.example"), Catch::Contains("hostname mismatch"));
  CHECK_THAT(result_for("127.0.0.2"), Catch::Contains("IP address mismatch"));
  const auto strangers = make_web_client_tls(lab.trust()).value();
  TlsPeerOptions peer;
  peer.host = "one.example";
  TlsPair pair(strangers, at_server, 1000, peer);
  REQUIRE_FALSE(pair.client_result.has_value());
  CHECK_THAT(pair.client_result.error().message, Catch::Contains("unable to get local issuer certificate"));
}
