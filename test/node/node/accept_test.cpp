// Connections that a program has accepted itself, in the hands of a node.
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <catch2/catch.hpp>

#include "node/transport/beast_stream.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using Catch::Matchers::Contains;

namespace {

constexpr auto await_tuple = asio::as_tuple(asio::use_awaitable);

void add_doubler(Node& node) {
  auto service = Service::from_text(
      {"service test.doubler\nobject Doubler\nfunction uint8[] Double(uint8[] block)\nfunction void Stop()\nend\n"},
      "Doubler", "Doubler");
  service->function("Double", [](const std::vector<std::uint8_t>& block) {
    auto doubled = block;
    doubled.insert(doubled.end(), block.begin(), block.end());
    return doubled;
  });
  service->function("Stop", [&node] { node.post([&node] { node.stop(); }); });
  node.add(service);
}

/// A listener of the test's own on the node's thread, each of whose connections `serve` gets.
struct OwnListener {
  using Serve = std::function<awaitable<void>(tcp::socket, Node&)>;
  explicit OwnListener(Serve serve)
      : node([&](Node& made) {
          add_doubler(made);
          tcp::acceptor acceptor(made.io_context(), {asio::ip::make_address("127.0.0.1"), 0});
          port = acceptor.local_endpoint().port();
          asio::co_spawn(made.io_context(), accept(std::move(acceptor), made, std::move(serve)), asio::detached);
        }) {}
  static awaitable<void> accept(tcp::acceptor acceptor, Node& node, Serve serve) {
    for (;;) {
      auto [error, socket] = co_await acceptor.async_accept(await_tuple);
      if (error) co_return;
      co_await serve(std::move(socket), node);
    }
  }
  std::string at() const { return "127.0.0.1:" + std::to_string(port); }

  std::uint16_t port = 0;
  RunningNode node;
};

void use(const RemoteObject& doubler) {
  CHECK(doubler.call("Double", std::vector<std::uint8_t>{1, 2}) == Value(std::vector<std::uint8_t>{1, 2, 1, 2}));
  const std::vector<std::uint8_t> large(3'000'000, 7);
  const Value doubled = doubler.call("Double", large);
  CHECK(doubled.to_items<std::uint8_t>().value().size() == 2 * large.size());
}

}  // namespace

TEST_CASE("a socket that a program has accepted is served as one of the node's own") {
  OwnListener own([](tcp::socket socket, Node& node) -> awaitable<void> {
    node.accept(std::move(socket));
    co_return;
  });
  use(connect("rr+tcp://" + own.at() + "/?service=Doubler"));
  use(connect("rr+ws://" + own.at() + "/?service=Doubler"));
}

TEST_CASE("a socket of which a program has read the request is upgraded by the node") {
  OwnListener own([](tcp::socket socket, Node& node) -> awaitable<void> {
    std::string request;
    co_await asio::async_read_until(socket, asio::dynamic_buffer(request), "\r\n\r\n", await_tuple);
    node.accept(std::move(socket), as_bytes(request));
  });
  use(connect("rr+ws://" + own.at() + "/?service=Doubler"));
}

TEST_CASE("a WebSocket that Beast has accepted is served, and ends with the node") {
  OwnListener own([](tcp::socket socket, Node& node) -> awaitable<void> {
    beast::tcp_stream stream(std::move(socket));
    beast::flat_buffer buffer;
    beast::http::request<beast::http::empty_body> request;
    co_await beast::http::async_read(stream, buffer, request, await_tuple);
    CHECK(request.target().starts_with("/arm"));
    beast::websocket::stream<beast::tcp_stream> websocket(std::move(stream));
    co_await websocket.async_accept(request, await_tuple);
    node.accept(make_beast_stream(std::move(websocket)), "rr+ws://robot.lab:8080/arm/");
  });
  const auto doubler = connect("rr+ws://" + own.at() + "/arm?service=Doubler");
  use(doubler);
  const auto index = connect("rr+ws://" + own.at() + "/arm?service=RobotRaconteurServiceIndex");
  const auto services = index.call("GetLocalNodeServices");
  const auto& info = *services.get_if<MapInt32>()->items.front().second.get_if<Structure>();
  CHECK_THAT(std::string(*info.find("ConnectionURL")->get_if<MapInt32>()->items.front().second.to_text()),
             Catch::Matchers::StartsWith("rr+ws://robot.lab:8080/arm/?"));
  doubler.call("Stop");
  own.node.join();
  CHECK(error_of([&] { doubler.call("Stop"); }).code != ErrorCode::none);
}

TEST_CASE("a peer that takes what it is sent slowly, but takes it, is not given up") {
  asio::io_context io;
  tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.1"), 0});
  acceptor.set_option(asio::socket_base::send_buffer_size(8 * 1024));
  tcp::socket client(io, tcp::v4());
  client.set_option(asio::socket_base::receive_buffer_size(8 * 1024));
  client.connect(acceptor.local_endpoint());
  beast::websocket::stream<beast::tcp_stream> server{beast::tcp_stream(acceptor.accept())};
  beast::websocket::stream<tcp::socket> peer(std::move(client));
  error_code failed = asio::error::would_block;
  const auto serve = [&]() -> awaitable<void> {
    co_await server.async_accept(await_tuple);
    const auto stream = make_beast_stream(std::move(server), std::chrono::milliseconds(300));
    const Bytes much(512 * 1024);
    const ByteSpan slice(much);
    failed = co_await stream->write(std::span(&slice, 1));
    stream->close();
  };
  const auto take_slowly = [&]() -> awaitable<void> {
    co_await peer.async_handshake("robot.lab", "/", await_tuple);
    std::array<char, 4096> into{};
    asio::steady_timer pause(io);
    for (;;) {
      pause.expires_after(std::chrono::milliseconds(10));
      co_await pause.async_wait(await_tuple);
      const auto [error, bytes] = co_await peer.async_read_some(asio::buffer(into), await_tuple);
      if (error) break;
    }
  };
  asio::co_spawn(io, serve, asio::detached);
  asio::co_spawn(io, take_slowly, asio::detached);
  io.run_for(std::chrono::seconds(20));
  CHECK_FALSE(failed);
}

TEST_CASE("the reason that a Beast WebSocket ends with is cut between characters") {
  asio::io_context io;
  tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.1"), 0});
  tcp::socket client(io);
  client.connect(acceptor.local_endpoint());
  beast::websocket::stream<beast::tcp_stream> server{beast::tcp_stream(acceptor.accept())};
  beast::websocket::stream<tcp::socket> peer(std::move(client));
  const std::string fits(122, 'a');
  const auto serve = [&]() -> awaitable<void> {
    co_await server.async_accept(await_tuple);
    const auto stream = make_beast_stream(std::move(server));
    const EndReason reason{1011, fits + "\xc3\xa4"};
    co_await stream->end(reason);
  };
  error_code ended;
  const auto hear = [&]() -> awaitable<void> {
    co_await peer.async_handshake("robot.lab", "/", await_tuple);
    std::array<char, 16> into{};
    const auto [error, bytes] = co_await peer.async_read_some(asio::buffer(into), await_tuple);
    ended = error;
  };
  asio::co_spawn(io, serve, asio::detached);
  asio::co_spawn(io, hear, asio::detached);
  io.run_for(std::chrono::seconds(20));
  CHECK(ended == beast::websocket::error::closed);
  CHECK(std::string_view(peer.reason().reason.data(), peer.reason().reason.size()) == fits);
}

TEST_CASE("a connection is refused for a URL that is none, and let go by a node that stops") {
  asio::io_context io;
  Node node(io, "test.node");
  tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.1"), 0});
  tcp::socket client(io);
  client.connect(acceptor.local_endpoint());
  auto stream = make_beast_stream(beast::websocket::stream<beast::tcp_stream>(beast::tcp_stream(acceptor.accept())));
  CHECK_THAT(refusal([&] { node.accept(std::move(stream), "nonsense"); }), Contains("'nonsense'"));
  client = tcp::socket(io);
  client.connect(acceptor.local_endpoint());
  node.accept(acceptor.accept());
  node.stop();
  char byte = 0;
  bool is_let_go = false;
  client.async_read_some(asio::buffer(&byte, 1),
                         [&](const boost::system::error_code& error, std::size_t) { is_let_go = bool(error); });
  io.run_for(std::chrono::seconds(2));
  CHECK(is_let_go);
}
