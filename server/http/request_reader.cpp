#include "server/http/request_reader.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>

namespace rrgate {

namespace {

ReadRequest refuse(unsigned status, std::string detail) { return {std::nullopt, status, std::move(detail)}; }

ReadRequest refuse_for(const boost::beast::error_code& error, const RequestLimits& limits) {
  if (error == http::error::header_limit)
    return refuse(431, "request header longer than " + std::to_string(limits.header_bytes) + " bytes");
  if (error == http::error::body_limit)
    return refuse(413, "request body longer than " + std::to_string(limits.body_bytes) + " bytes");
  return refuse(400, "not an HTTP request: " + error.message());
}

}  // namespace

RequestReader::RequestReader(ByteStream& stream, RequestLimits limits, Watchdog& watchdog)
    : stream_(stream), limits_(limits), limit_(watchdog, [this] { stream_.cancel(); }) {}

awaitable<ReadRequest> RequestReader::next() {
  http::request_parser<http::string_body> parser;
  parser.header_limit(static_cast<std::uint32_t>(limits_.header_bytes));
  parser.body_limit(limits_.body_bytes);
  parser.eager(true);
  // The first request follows the first bytes of the connection, so the short limit holds for it from the start.
  bool is_started = std::exchange(is_first_, false) || !buffer_.empty();
  limit_.arm(is_started ? limits_.header_timeout : limits_.idle_timeout);
  rr::Bytes chunk(4096);
  while (!parser.is_done()) {
    if (!buffer_.empty()) {
      boost::beast::error_code error;
      const auto used = parser.put(boost::asio::const_buffer(buffer_.data(), buffer_.size()), error);
      buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(used));
      if (error && error != http::error::need_more) {
        limit_.disarm();
        co_return refuse_for(error, limits_);
      }
      if (parser.is_done()) break;
      if (!error && !buffer_.empty()) continue;
      // Beast counts a header only once it is whole, or fills a buffer of that size.
      if (!parser.is_header_done() && buffer_.size() >= limits_.header_bytes) {
        limit_.disarm();
        co_return refuse_for(http::error::header_limit, limits_);
      }
    }
    const auto read = co_await stream_.read_some(chunk);
    if (read.error || read.is_end()) {
      const bool is_late = is_started && !limit_.is_armed();
      limit_.disarm();
      co_return is_late ? refuse(408, "the request took longer than " +
                                          std::to_string(limits_.header_timeout.count()) + " ms")
                        : ReadRequest{};
    }
    if (!is_started) {
      is_started = true;
      limit_.arm(limits_.header_timeout);
    }
    buffer_.insert(buffer_.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(read.bytes));
  }
  limit_.disarm();
  ReadRequest out;
  out.request.emplace(Request{parser.release()});
  co_return out;
}

}  // namespace rrgate
