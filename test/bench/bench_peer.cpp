// The other side of the call benchmark, each in a process of its own. Prints its port as JSON; runs until it is ended.
//
//   bench_peer service      a node with service "interop": a function that does nothing, and one that takes its time
//   bench_peer echo [PATH]  the yardstick: answers requests of a known size with replies of a known size; a client
//                           begins with both sizes (two uint32); by TCP, or by a local socket
#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string_view>
#include <thread>
#include <type_traits>
#include <vector>

#include "node/service/node.hpp"
#include "test/support/count_allocations.hpp"

namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

constexpr const char* definition = R"(service test.bench
stdver 0.10
object Bench
    function void nothing()
    function void wait(double seconds)
    property uint64 allocations [readonly]
end
)";

void say_port(std::uint16_t port) {
  std::printf("{\"port\": %d}\n", port);
  std::fflush(stdout);
}

void serve() {
  rr::Node node("interop.service");
  const auto service = rr::Service::from_text({definition}, "interop", "Bench");
  service->function("nothing", [] {});
  service->function("wait", rr::blocking([](double seconds) {
                      std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
                    }));
  service->property("allocations").get([] { return static_cast<std::uint64_t>(rr::test::allocation_count); });
  node.add(service);
  say_port(node.listen("rr+tcp://127.0.0.1:0"));
  node.run();
}

template <class Socket>
asio::awaitable<void> echo(Socket socket) {
  try {
    if constexpr (std::is_same_v<Socket, tcp::socket>) socket.set_option(tcp::no_delay(true));
    std::array<std::uint32_t, 2> sizes{};
    co_await asio::async_read(socket, asio::buffer(sizes), asio::use_awaitable);
    std::vector<std::uint8_t> request(sizes[0]);
    const std::vector<std::uint8_t> reply(sizes[1]);
    for (;;) {
      co_await asio::async_read(socket, asio::buffer(request), asio::use_awaitable);
      co_await asio::async_write(socket, asio::buffer(reply), asio::use_awaitable);
    }
  } catch (const boost::system::system_error&) {  // the client is gone
  }
}

template <class Acceptor>
asio::awaitable<void> accept(Acceptor& acceptor) {
  for (;;)
    asio::co_spawn(acceptor.get_executor(), echo(co_await acceptor.async_accept(asio::use_awaitable)), asio::detached);
}

void run_echo() {
  asio::io_context io{1};
  tcp::acceptor acceptor(io, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  asio::co_spawn(io, accept(acceptor), asio::detached);
  say_port(acceptor.local_endpoint().port());
  io.run();
}

void run_echo(const char* path) {
  asio::io_context io{1};
  asio::local::stream_protocol::acceptor acceptor(io, path);
  asio::co_spawn(io, accept(acceptor), asio::detached);
  say_port(0);
  io.run();
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view role = argc > 1 ? argv[1] : "";
  try {
    if (role == "service" && argc == 2) {
      serve();
    } else if (role == "echo" && argc == 2) {
      run_echo();
    } else if (role == "echo" && argc == 3) {
      run_echo(argv[2]);
    } else {
      std::fprintf(stderr, "usage: bench_peer service | echo [PATH]\n");
      return 2;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_peer: %s\n", error.what());
    return 1;
  }
}
