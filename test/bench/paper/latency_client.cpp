// Clients of the latency table, one way to a service each; see answer_counts().
//
//   latency_client call URL                      an empty function of a Robot Raconteur service
//   latency_client intra                         the same, of a node of this process that has a thread of its own
//   latency_client echo PORT|PATH REQUEST REPLY  so many bytes there and back, over TCP or a local socket: the
//   yardstick latency_client nats PORT                     an empty request by way of a NATS server latency_client
//   nats-service PORT             who answers it; says its "port" when it can
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>
#include <cstdlib>
#include <exception>
#include <istream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "node/client/client.hpp"
#include "node/service/node.hpp"
#include "test/bench/paper/latency.hpp"
#include "test/bench/raw_session.hpp"

namespace asio = boost::asio;

namespace {

constexpr const char* definition = R"(service test.bench
stdver 0.10
object Bench
    function void nothing()
end
)";

void call(const std::string& url) {
  auto robot = rr::connect(url);
  rr::bench::answer_counts([&] { robot.call("nothing"); });
}

void call_within_the_process() {
  rr::Node node("bench.intra");
  const auto service = rr::Service::from_text({definition}, "interop", "Bench");
  service->function("nothing", [] {});
  node.add(service);
  node.listen("rr+intra:///");
  std::jthread thread([&] { node.run(); });
  try {
    call("rr+intra:///?nodename=bench.intra&service=interop");
  } catch (...) {
    asio::post(node.io_context(), [&] { node.stop(); });
    throw;
  }
  asio::post(node.io_context(), [&] { node.stop(); });
}

template <class Socket>
void exchange(Socket& socket, const std::array<std::uint32_t, 2>& sizes) {
  asio::write(socket, asio::buffer(sizes));
  const std::vector<std::uint8_t> request(sizes[0]);
  std::vector<std::uint8_t> reply(sizes[1]);
  rr::bench::answer_counts([&] {
    asio::write(socket, asio::buffer(request));
    asio::read(socket, asio::buffer(reply));
  });
}

void echo(const std::string& where, const std::array<std::uint32_t, 2>& sizes) {
  asio::io_context io;
  if (where.front() == '/') {
    asio::local::stream_protocol::socket socket(io);
    socket.connect(where);
    exchange(socket, sizes);
  } else {
    auto socket = rr::bench::connect_to(io, static_cast<std::uint16_t>(std::stoi(where)));
    exchange(socket, sizes);
  }
}

/// As much of NATS's protocol as a request takes: https://docs.nats.io/reference/reference-protocols/nats-protocol
class NatsConnection {
 public:
  NatsConnection(std::uint16_t port, std::string_view subscription) : socket_(rr::bench::connect_to(io_, port)) {
    next_line();  // INFO
    send("CONNECT {\"verbose\":false}\r\nSUB " + std::string(subscription) + " 1\r\nPING\r\n");
    while (next_line() != "PONG") {
    }
  }

  void send(std::string_view text) { asio::write(socket_, asio::buffer(text)); }

  /// Waits for a message, which has nothing in it. Returns where an answer is to go.
  std::string next_message() {
    for (;;) {
      const auto line = next_line();
      if (line == "PING") send("PONG\r\n");
      if (!line.starts_with("MSG ")) continue;
      next_line();  // the message
      const auto words = std::string_view(line).substr(0, line.rfind(' '));
      return std::string(words.substr(words.rfind(' ') + 1));
    }
  }

 private:
  std::string next_line() {
    const auto length = asio::read_until(socket_, buffer_, "\r\n");
    std::string line(asio::buffers_begin(buffer_.data()),
                     asio::buffers_begin(buffer_.data()) + static_cast<std::ptrdiff_t>(length) - 2);
    buffer_.consume(length);
    if (line.starts_with("-ERR")) throw std::runtime_error("NATS: " + line);
    return line;
  }

  asio::io_context io_;
  asio::ip::tcp::socket socket_;
  asio::streambuf buffer_;
};

void request_by_nats(std::uint16_t port) {
  NatsConnection connection(port, "answers");
  rr::bench::answer_counts([&] {
    connection.send("PUB nothing answers 0\r\n\r\n");
    connection.next_message();
  });
}

void answer_by_nats(std::uint16_t port) {
  NatsConnection connection(port, "nothing");
  std::printf("{\"port\": %d}\n", port);
  std::fflush(stdout);
  for (;;) connection.send("PUB " + connection.next_message() + " 0\r\n\r\n");
}

int run(std::span<char*> arguments) {
  const std::string_view kind = arguments.size() < 2 ? "" : arguments[1];
  const auto number = [&](std::size_t i) { return static_cast<std::uint32_t>(std::stoul(arguments[i])); };
  if (kind == "call" && arguments.size() == 3) {
    call(arguments[2]);
  } else if (kind == "intra" && arguments.size() == 2) {
    call_within_the_process();
  } else if (kind == "echo" && arguments.size() == 5) {
    echo(arguments[2], {number(3), number(4)});
  } else if (kind == "nats" && arguments.size() == 3) {
    request_by_nats(static_cast<std::uint16_t>(number(2)));
  } else if (kind == "nats-service" && arguments.size() == 3) {
    answer_by_nats(static_cast<std::uint16_t>(number(2)));
  } else {
    std::fprintf(stderr,
                 "usage: latency_client call URL | intra | echo PORT|PATH REQUEST REPLY | nats[-service] PORT\n");
    return 2;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv, static_cast<std::size_t>(argc)});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "latency_client: %s\n", error.what());
    return 1;
  }
}
