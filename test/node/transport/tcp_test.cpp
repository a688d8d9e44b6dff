#include "node/transport/tcp.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <optional>
#include <vector>

using namespace rr;
namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

std::optional<Result<tcp::socket>> dial(asio::io_context& io, const std::string& host, std::uint16_t port,
                                        std::chrono::milliseconds timeout = std::chrono::seconds(5)) {
  std::optional<Result<tcp::socket>> answer;
  const auto run = [&]() -> awaitable<void> {
    auto result = co_await connect_tcp(host, port, timeout);
    answer.emplace(std::move(result));
  };
  asio::co_spawn(io, run, asio::detached);
  io.restart();
  io.run();
  return answer;
}

}  // namespace

TEST_CASE("a listening host is reached by number and by name") {
  asio::io_context io;
  tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.1"), 0});
  const auto port = acceptor.local_endpoint().port();
  for (const char* host : {"127.0.0.1", "localhost"}) {
    const auto answer = dial(io, host, port);
    REQUIRE(answer);
    REQUIRE(answer->has_value());
    CHECK((**answer).remote_endpoint().port() == port);
  }
}

TEST_CASE("a refused connection says to where, and at once") {
  asio::io_context io;
  std::uint16_t port = 0;
  {
    tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.1"), 0});
    port = acceptor.local_endpoint().port();
  }
  const auto before = std::chrono::steady_clock::now();
  const auto answer = dial(io, "127.0.0.1", port, std::chrono::seconds(30));
  REQUIRE(answer);
  REQUIRE(answer->has_error());
  CHECK(answer->error().code == ErrorCode::connection_error);
  CHECK_THAT(answer->error().message, Catch::Matchers::Contains("127.0.0.1:" + std::to_string(port)));
  CHECK(std::chrono::steady_clock::now() - before < std::chrono::seconds(10));
}

TEST_CASE("a host that does not answer is given up in time") {
  asio::io_context io;
  // A full accept queue: further connections wait for an answer that never comes.
  tcp::acceptor acceptor(io, tcp::v4());
  acceptor.bind({asio::ip::make_address("127.0.0.1"), 0});
  acceptor.listen(0);
  asio::io_context never_run;
  std::vector<tcp::socket> fillers;
  for (int i = 0; i < 8; ++i) {
    fillers.emplace_back(never_run, tcp::v4());
    fillers.back().async_connect(acceptor.local_endpoint(), [](const auto&) {});
  }
  const auto answer = dial(io, "127.0.0.1", acceptor.local_endpoint().port(), std::chrono::milliseconds(60));
  REQUIRE(answer);
  REQUIRE(answer->has_error());
  CHECK(answer->error().code == ErrorCode::connection_error);
  CHECK_THAT(answer->error().message, Catch::Matchers::Contains("no answer within 60 ms"));
}
