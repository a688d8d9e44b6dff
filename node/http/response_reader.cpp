#include "node/http/response_reader.hpp"

#include <array>
#include <boost/asio/buffer.hpp>
#include <limits>

#include "core/support/bytes.hpp"

namespace rrgate {

namespace http = boost::beast::http;

rr::awaitable<rr::Result<>> read_response(rr::ByteStream& stream, ResponseParser& parser, std::size_t largest,
                                          const std::function<void()>& on_more) {
  const auto fail = [](const std::string& why) { return rr::make_error(rr::ErrorCode::connection_error, why); };
  const auto too_long = [&] { return fail("more than " + std::to_string(largest) + " bytes"); };
  parser.body_limit(std::numeric_limits<std::uint64_t>::max());
  parser.eager(true);
  rr::Bytes received;
  while (!parser.is_done()) {
    std::array<std::uint8_t, 4096> chunk;
    const auto read = co_await stream.read_some(chunk);
    if (read.error && parser.need_eof()) break;
    if (read.error) co_return fail(read.error.message());
    boost::beast::error_code error;
    if (read.is_end()) {
      parser.put_eof(error);
    } else {
      received.insert(received.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(read.bytes));
      const auto used = parser.put(boost::asio::const_buffer(received.data(), received.size()), error);
      received.erase(received.begin(), received.begin() + static_cast<std::ptrdiff_t>(used));
      if (error == http::error::need_more) error = {};
    }
    if (error) co_return fail("no HTTP: " + error.message());
    if (received.size() > largest) co_return too_long();
    if (parser.is_header_done() && on_more) on_more();
    if (parser.get().body().size() > largest) co_return too_long();
  }
  co_return rr::Result<>();
}

}  // namespace rrgate
