// What servers and proxies answer to a client that asks for a WebSocket or for a way, and the frames behind it.
//
// Input: the first byte says which of the two, the second is the size of the pieces that arrive, the rest is what
// does; "@ACCEPT@" in it becomes the right Sec-WebSocket-Accept, which no fuzzer guesses.
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cstdlib>

#include "core/support/error.hpp"
#include "node/transport/http_connect.hpp"
#include "node/transport/websocket_frames.hpp"
#include "test/fuzz/memory_bound.hpp"
#include "test/fuzz/scripted_stream.hpp"

namespace {

void require(bool claim) {
  if (!claim) std::abort();
}

class Server final : public rr::fuzz::ScriptedStream {
 public:
  using ScriptedStream::ScriptedStream;

 private:
  void handle_written(const std::string& request) override {
    constexpr std::string_view before = "Sec-WebSocket-Key: ";
    constexpr std::string_view mark = "@ACCEPT@";
    const auto begin = request.find(before);
    const auto at = input().find(mark);
    if (begin == std::string::npos || at == std::string::npos) return;
    const auto key = request.substr(begin + before.size(), 24);
    input().replace(at, mark.size(), rr::websocket_accept(key));
  }
};

rr::awaitable<void> drain(rr::ByteStream& stream, std::size_t limit) {
  rr::Bytes piece(512);
  std::size_t received = 0;
  while (true) {
    const auto read = co_await stream.read_some(piece);
    received += read.bytes;
    require(received <= limit);
    if (read.error || read.is_end()) break;
  }
}

rr::awaitable<void> run(std::uint8_t kind, std::unique_ptr<rr::ByteStream> stream, std::size_t size, bool& is_done) {
  if (kind & 1) {
    rr::HostPort target{"robot.example", 48653};
    const auto opened = co_await rr::connect_through_proxy(*stream, std::move(target));
    if (opened)
      co_await drain(*stream, size);
    else
      require(opened.error().message.size() < 500);
  } else {
    auto url = rr::parse_url("rr+ws://robot.example/path?service=a").value();
    rr::HttpHeaders headers;
    const auto socket = co_await rr::connect_websocket(std::move(stream), std::move(url), std::move(headers));
    if (socket)
      co_await drain(**socket, size);
    else
      require(socket.error().message.size() < 1500);  // with the detail of a problem document
  }
  is_done = true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size < 3) return 0;
  static boost::asio::io_context io{1};
  const auto text = rr::as_text(rr::ByteSpan(data, size).subspan(2));
  auto stream = std::make_unique<Server>(io, std::string(text), 1 + std::size_t{data[1]} * 16);
  bool is_done = false;
  boost::asio::co_spawn(io, run(data[0], std::move(stream), size, is_done), boost::asio::detached);
  io.restart();
  io.poll();
  require(is_done);
  return 0;
}
