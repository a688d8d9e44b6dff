// A Robot Raconteur device inside of a web server of one's own: Boost.Beast answers requests, and hands WebSockets on
// /arm to the node. web_server [PORT]
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <iostream>

#include "rrgate/beast.hpp"
#include "rrgate/device.hpp"

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;

constexpr const char* definition = R"(service example.arm
stdver 0.10
object Arm
    property double angle
    function void turn(double degrees)
end
)";
constexpr const char* subprotocol = "robotraconteur.robotraconteur.com";
constexpr auto await_tuple = asio::as_tuple(asio::use_awaitable);

asio::awaitable<void> serve(beast::tcp_stream stream, rr::Node& node) {
  beast::flat_buffer buffer;
  stream.expires_after(std::chrono::seconds(10));
  for (;;) {
    http::request<http::string_body> request;
    const auto [failure, size] = co_await http::async_read(stream, buffer, request, await_tuple);
    if (failure) co_return;
    const bool is_for_arm = websocket::is_upgrade(request) && request.target().starts_with("/arm");
    // Browsers open WebSockets for pages of every site, which Origin names; programs send none. This server has no
    // pages of its own that would need one, so it refuses them all.
    const bool is_page = request.count(http::field::origin) != 0;
    if (is_for_arm && !is_page) {
      const std::string url = "rr+ws://" + std::string(request[http::field::host]) + "/arm";
      websocket::stream<beast::tcp_stream> socket(std::move(stream));
      socket.set_option(websocket::stream_base::decorator(
          [](websocket::response_type& answer) { answer.set(http::field::sec_websocket_protocol, subprotocol); }));
      const auto [refused] = co_await socket.async_accept(request, await_tuple);
      if (!refused) node.accept(rr::make_beast_stream(std::move(socket)), url);
      co_return;
    }
    http::response<http::string_body> answer(is_for_arm ? http::status::forbidden : http::status::ok,
                                             request.version());
    answer.keep_alive(request.keep_alive());
    answer.set(http::field::content_type, "text/plain");
    answer.body() = is_for_arm ? "The arm is not for pages.\n"
                               : "This arm has " + std::to_string(node.client_count()) + " clients.\n";
    answer.prepare_payload();
    const auto [lost, sent] = co_await http::async_write(stream, answer, await_tuple);
    if (lost || !request.keep_alive()) co_return;
  }
}

asio::awaitable<void> listen(tcp::acceptor acceptor, rr::Node& node) {
  for (;;) {
    auto [failure, socket] = co_await acceptor.async_accept(await_tuple);
    if (failure) co_return;
    asio::co_spawn(acceptor.get_executor(), serve(beast::tcp_stream(std::move(socket)), node), asio::detached);
  }
}

int main(int count, char** words) {
  rr::Node node("example.arm");
  double angle = 0;
  const auto arm = rr::Service::from_text({definition}, "Arm", "Arm");
  arm->property("angle").get([&] { return angle; }).set([&](double degrees) { angle = degrees; });
  arm->function("turn", [&](double degrees) { angle += degrees; });
  node.add(arm);
  const auto port = static_cast<unsigned short>(count > 1 ? std::stoi(words[1]) : 8090);
  tcp::acceptor acceptor(node.io_context(), {asio::ip::make_address("127.0.0.1"), port});
  std::cout << "rr+ws://127.0.0.1:" << acceptor.local_endpoint().port() << "/arm?service=Arm" << std::endl;
  asio::co_spawn(node.io_context(), listen(std::move(acceptor), node), asio::detached);
  node.run();
}
