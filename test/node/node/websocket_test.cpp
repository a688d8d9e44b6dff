// WebSockets at nodes: our client and raw HTTP against our node, and the way through a proxy.
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <catch2/catch.hpp>
#include <optional>
#include <thread>

#include "node/client/client.hpp"
#include "node/client/client_connection.hpp"
#include "node/transport/dial.hpp"
#include "node/transport/websocket.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/memory_stream.hpp"

using namespace rr;
namespace asio = boost::asio;
using asio::ip::tcp;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
using Catch::Matchers::StartsWith;

namespace {

void add_blocks(Node& node) {
  auto service = Service::from_text(
      {"service test.blocks\nobject Blocks\nfunction uint8[] Double(uint8[] block)\nend\n"}, "Blocks", "Blocks");
  service->function("Double", [](const Value& block) {
    const auto items = block.to_items<std::uint8_t>().value();
    std::vector<std::uint8_t> doubled(items.begin(), items.end());
    doubled.insert(doubled.end(), items.begin(), items.end());
    return Value(std::move(doubled));
  });
  node.add(service);
}

std::string websocket_url(const RunningNode& node) {
  return "rr+ws://127.0.0.1:" + std::to_string(node.port()) + "/?service=Blocks";
}

/// The first line of what a node answers to a request.
std::string answer_to(const RunningNode& node, const std::string& request) {
  asio::io_context io;
  tcp::socket socket(io);
  socket.connect({asio::ip::make_address("127.0.0.1"), node.port()});
  asio::write(socket, asio::buffer(request));
  std::string text;
  asio::read_until(socket, asio::dynamic_buffer(text), "\r\n");
  return text.substr(0, text.find("\r\n"));
}

std::string upgrade_request(const std::string& more, const std::string& host = "127.0.0.1:48653") {
  return "GET /?service=Blocks HTTP/1.1\r\nHost: " + host +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n" +
         more + "\r\n";
}

/// Answers one CONNECT: with a way to where it was asked to, or with a refusal.
class Proxy {
 public:
  explicit Proxy(std::string refusal = {}) : acceptor_(io_, {asio::ip::make_address("127.0.0.1"), 0}) {
    port_ = acceptor_.local_endpoint().port();
    thread_ = std::thread([this, refusal] { serve(refusal); });
  }
  ~Proxy() { thread_.join(); }
  std::uint16_t port() const { return port_; }
  const std::string& request() const { return request_; }

 private:
  void serve(const std::string& refusal) {
    tcp::socket client = acceptor_.accept();
    const auto end = asio::read_until(client, asio::dynamic_buffer(request_), "\r\n\r\n");
    REQUIRE(end == request_.size());
    if (!refusal.empty()) {
      asio::write(client, asio::buffer(refusal));
      return;
    }
    const auto target = parse_host_port(request_.substr(8, request_.find(' ', 8) - 8)).value();
    tcp::socket device(io_);
    device.connect({asio::ip::make_address(target.host), target.port});
    asio::write(client, asio::buffer(std::string("HTTP/1.1 200 Connection established\r\n\r\n")));
    std::thread back([&] { copy(device, client); });
    copy(client, device);
    back.join();
  }
  static void copy(tcp::socket& from, tcp::socket& to) {
    std::array<char, 4096> buffer;
    boost::system::error_code error;
    while (!error) {
      const auto bytes = from.read_some(asio::buffer(buffer), error);
      if (!error) asio::write(to, asio::buffer(buffer.data(), bytes), error);
    }
    to.shutdown(tcp::socket::shutdown_send, error);
  }

  asio::io_context io_;
  tcp::acceptor acceptor_;
  std::uint16_t port_ = 0;
  std::string request_;
  std::thread thread_;
};

}  // namespace

TEST_CASE("a node takes WebSockets on its port, with messages of any size") {
  RunningNode node(add_blocks);
  auto blocks = connect(websocket_url(node));
  for (const std::size_t size : {0u, 1u, 125u, 126u, 65535u, 65536u, 3'000'000u}) {
    const std::vector<std::uint8_t> block(size, 7);
    CHECK(blocks.call("Double", block) == Value(std::vector<std::uint8_t>(2 * size, 7)));
  }
}

TEST_CASE("a node refuses pages of strange origins, and what is no WebSocket") {
  RunningNode node(add_blocks);
  CHECK_THAT(answer_to(node, upgrade_request("")), StartsWith("HTTP/1.1 101"));
  CHECK_THAT(answer_to(node, upgrade_request("Origin: http://127.0.0.1:48653\r\n")), StartsWith("HTTP/1.1 101"));
  CHECK_THAT(answer_to(node, upgrade_request("Origin: http://elsewhere.example\r\n")), StartsWith("HTTP/1.1 403"));
  CHECK_THAT(answer_to(node, upgrade_request("Sec-WebSocket-Protocol: chat\r\n")), StartsWith("HTTP/1.1 426"));
  CHECK_THAT(answer_to(node, "GET / HTTP/1.1\r\nHost: x\r\n\r\n"), StartsWith("HTTP/1.1 404"));
  CHECK_THAT(answer_to(node, "nonsense\r\n\r\n"), StartsWith("HTTP/1.1 400"));
}

TEST_CASE("a page that was loaded by a stranger's name is no page of the node's; a program may use any name") {
  RunningNode node(add_blocks);
  const auto rebound = upgrade_request("Origin: http://evil.example\r\n", "evil.example");
  CHECK_THAT(answer_to(node, rebound), StartsWith("HTTP/1.1 403"));
  CHECK_THAT(answer_to(node, upgrade_request("", "device.example")), StartsWith("HTTP/1.1 101"));
  CHECK_THAT(answer_to(node, upgrade_request("Origin: http://localhost:1\r\n", "localhost:1")),
             StartsWith("HTTP/1.1 101"));
}

TEST_CASE("origins that a node allows may open WebSockets") {
  NodeOptions options;
  options.allowed_origins = {"https://*.lab.example"};
  RunningNode node(add_blocks, options);
  CHECK_THAT(answer_to(node, upgrade_request("Origin: https://a.lab.example\r\n")), StartsWith("HTTP/1.1 101"));
  CHECK_THAT(answer_to(node, upgrade_request("Origin: https://lab.example.org\r\n")), StartsWith("HTTP/1.1 403"));
}

TEST_CASE("a WebSocket to what is none says what came instead") {
  // What the server answers, and how the error ends.
  const std::string refusal = "HTTP/1.1 503 Try later\r\n";
  const std::string problem = refusal + "Content-Type: application/problem+json; charset=utf-8\r\nContent-Length: ";
  const auto script = GENERATE_COPY(table<std::string, std::string>(
      {{refusal + "Content-Length: 0\r\n\r\n", "status 503 'Try later'"},
       {problem + "32\r\n\r\n{\"detail\": \"device 'a' is away\"}", "status 503 'Try later': device 'a' is away"},
       {problem + "99\r\n\r\n{\"detail\": \"device 'a' is away\"}", "status 503 'Try later'"},
       {problem + "13\r\n\r\n{\"detail\": 3}", "status 503 'Try later'"},
       {problem + "4\r\n\r\nnone", "status 503 'Try later'"},
       {problem + "2000\r\n\r\n{\"detail\": \"x\"}" + std::string(1985, ' '), "status 503 'Try later'"},
       {refusal + "Content-Type: text/html\r\nContent-Length: 3\r\n\r\n<p>", "status 503 'Try later'"}}));
  const auto& [answer, told] = script;
  INFO(answer);
  asio::io_context io;
  tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.1"), 0});
  std::string request;
  std::thread server([&, &answer = answer] {
    auto socket = acceptor.accept();
    asio::read_until(socket, asio::dynamic_buffer(request), "\r\n\r\n");
    asio::write(socket, asio::buffer(answer));
  });
  ConnectOptions options;
  options.dial.headers = {{"Authorization", "Bearer 1"}};
  const auto error = error_of([&] {
    connect(
        "rr+ws://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()) + "/robots/a?token=1&service=Blocks",
        options);
  });
  server.join();
  CHECK(error.code == ErrorCode::connection_error);
  CHECK_THAT(error.message, EndsWith(told));
  CHECK_THAT(request, StartsWith("GET /robots/a?token=1&service=Blocks HTTP/1.1\r\n"));
  CHECK_THAT(request, Contains("\r\nAuthorization: Bearer 1\r\n"));
}

TEST_CASE("a connection ends by what the peer says when it closes the WebSocket") {
  const auto [reason, text] = GENERATE(table<EndReason, std::string>({
      {{1008, "not allowed"}, "the peer closed the connection: code 1008, 'not allowed'"},
      {{1001, ""}, "the peer closed the connection: code 1001"},
      {{1000, ""}, "the peer closed the connection"},
  }));
  asio::io_context io;
  test::MemoryStreams streams{io.get_executor()};
  std::optional<Error> failure;
  ClientConnection::open(std::make_unique<WebSocketStream>(std::move(streams.client), WebSocketRole::client, false), {},
                         [&](const Result<std::shared_ptr<ClientConnection>>& opened) { failure = opened.error(); });
  WebSocketStream server(std::move(streams.server), WebSocketRole::server, true);
  auto work = [](WebSocketStream& stream, const EndReason& why) -> awaitable<void> {
    Bytes buffer(10'000);
    co_await stream.read_some(buffer);
    co_await stream.end(why);
  };
  asio::co_spawn(io, work(server, reason), asio::detached);
  io.run_for(std::chrono::seconds(20));
  REQUIRE(failure.has_value());
  CHECK(failure->message == text);
}

TEST_CASE("a proxy leads to the node, or says why not") {
  RunningNode node(add_blocks);
  ConnectOptions options;
  SECTION("it leads there") {
    Proxy proxy;
    {
      options.dial.proxy = {"127.0.0.1", proxy.port()};
      auto blocks = connect(websocket_url(node), options);
      CHECK(blocks.call("Double", std::vector<std::uint8_t>{1}) == Value(std::vector<std::uint8_t>{1, 1}));
    }
    CHECK_THAT(proxy.request(), StartsWith("CONNECT 127.0.0.1:" + std::to_string(node.port()) + " HTTP/1.1\r\n"));
  }
  SECTION("it refuses") {
    Proxy proxy("HTTP/1.1 407 Proxy Authentication Required\r\n\r\n");
    options.dial.proxy = {"127.0.0.1", proxy.port()};
    const auto error = error_of([&] { connect(websocket_url(node), options); });
    CHECK(error.code == ErrorCode::connection_error);
    CHECK_THAT(error.message, Contains("refused with status 407"));
  }
}
