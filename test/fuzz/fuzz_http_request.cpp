// What clients of the gateway and of nodes send first: HTTP requests, and whether they become a WebSocket.
//
// Input: the first byte is the size of the pieces that arrive, the rest is what does.
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cstdlib>

#include "node/http/foreign_page.hpp"
#include "node/http/request_reader.hpp"
#include "node/http/upgrade.hpp"
#include "test/fuzz/memory_bound.hpp"
#include "test/fuzz/scripted_stream.hpp"

namespace {

constexpr rrgate::RequestLimits limits{1024, std::chrono::hours(1), std::chrono::hours(1), 512};

void require(bool claim) {
  if (!claim) std::abort();
}

/// One head, whatever of the request is repeated in it.
void check_head(std::string_view head) {
  require(head.find("\r\n\r\n") == head.size() - 4);
}

void check_request(const rrgate::HttpRequest& request) {
  require(request.path().size() + request.query().size() <= request.message.target().size());
  require(request.message.body().empty());
  const std::vector<std::string> origins = {"https://*.lab.example"};
  const std::vector<std::string> hosts = {"*.lab.example"};
  const rrgate::PageRules rules{origins, hosts};
  auto refusal = rrgate::refuse_unknown_host(request, rules);
  if (!refusal) refusal = rrgate::refuse_foreign_page(request, rules);
  if (!refusal && rrgate::asks_for_websocket(request)) refusal = rrgate::refuse_upgrade(request);
  if (refusal) {
    require(refusal->status >= 400 && refusal->body && refusal->body->size() < 2000);
    check_head(rrgate::format_response_head(*refusal, false, 1));
  } else if (rrgate::asks_for_websocket(request)) {
    check_head(rrgate::format_upgrade_response(request));
  }
  static_cast<void>(rrgate::takes_close_frames(request));
}

void check_failure(const rrgate::ReadFailure& failure) {
  require(failure.status == 0 || (failure.status >= 400 && !failure.detail.empty()));
}

rr::awaitable<void> read_all(rr::ByteStream& stream, bool& is_done) {
  rrgate::RequestReader reader(stream, limits);
  const rrgate::RequestReader::HasRoom has_room = [](std::size_t bytes) { return bytes < 400; };
  while (true) {
    auto read = co_await reader.next();
    require(reader.unread().size() <= 4096 + limits.header_bytes);
    if (!read.request) {
      check_failure(read.failure);
      break;
    }
    check_request(*read.request);
    if (const auto failure = co_await reader.read_body(*read.request, has_room)) {
      check_failure(*failure);
      break;
    }
    require(read.request->message.body().size() <= limits.body_bytes && !reader.has_unread_body());
  }
  is_done = true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size < 2) return 0;
  static boost::asio::io_context io{1};
  rr::fuzz::ScriptedStream stream(io, std::string(rr::as_text(rr::ByteSpan(data, size).subspan(1))),
                                  1 + std::size_t{data[0]} * 16);
  bool is_done = false;
  boost::asio::co_spawn(io, read_all(stream, is_done), boost::asio::detached);
  io.restart();
  io.poll();
  require(is_done);
  return 0;
}
