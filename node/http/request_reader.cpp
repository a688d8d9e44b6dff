#include "node/http/request_reader.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>

namespace rrgate {

namespace {

ReadRequest refuse(unsigned status, std::string detail) {
  return {std::nullopt, status, std::move(detail)};
}

ReadRequest refuse_for(const boost::beast::error_code& error, const RequestLimits& limits) {
  if (error == http::error::header_limit)
    return refuse(431, "request header longer than " + std::to_string(limits.header_bytes) + " bytes");
  if (error == http::error::body_limit)
    return refuse(413, "request body longer than " + std::to_string(limits.body_bytes) + " bytes");
  return refuse(400, "not an HTTP request: " + error.message());
}

}  // namespace

RequestReader::RequestReader(rr::ByteStream& stream, RequestLimits limits)
    : stream_(stream), limits_(limits), limit_(stream.executor(), [this] { stream_.cancel(); }) {}

/// Beast's own header_limit is a few bytes generous; ours counts every byte up to and with the empty line.
bool RequestReader::is_header_too_long(std::size_t consumed) const {
  const auto text = rr::as_text(buffer_);
  const auto end = text.find("\r\n\r\n");
  return consumed + (end == std::string_view::npos ? text.size() : end + 4) > limits_.header_bytes;
}

rr::awaitable<ReadRequest> RequestReader::next() {
  http::request_parser<http::string_body> parser;
  parser.header_limit(static_cast<std::uint32_t>(limits_.header_bytes) + 1024);
  parser.body_limit(limits_.body_bytes);
  parser.eager(true);
  std::size_t consumed = 0;  // of the header
  // The first request follows the first bytes of the connection, so the short limit holds for it from the start.
  bool is_started = std::exchange(is_first_, false) || !buffer_.empty();
  limit_.arm(is_started ? limits_.header_timeout : limits_.idle_timeout);
  rr::Bytes chunk(4096);
  while (!parser.is_done()) {
    if (!buffer_.empty()) {
      boost::beast::error_code error;
      if (!parser.is_header_done() && is_header_too_long(consumed)) error = http::error::header_limit;
      const auto used = error ? 0 : parser.put(boost::asio::const_buffer(buffer_.data(), buffer_.size()), error);
      buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(used));
      consumed += used;
      if (error && error != http::error::need_more) {
        limit_.disarm();
        co_return refuse_for(error, limits_);
      }
      if (parser.is_done()) break;
      if (used > 0 && !buffer_.empty()) continue;
    }
    const auto read = co_await stream_.read_some(chunk);
    if (read.error || read.is_end()) {
      const bool is_late = is_started && !limit_.is_armed();
      limit_.disarm();
      co_return is_late
          ? refuse(408, "the request took longer than " + std::to_string(limits_.header_timeout.count()) + " ms")
          : ReadRequest{};
    }
    if (!is_started || parser.is_header_done()) {
      is_started = true;
      limit_.arm(limits_.header_timeout);
    }
    buffer_.insert(buffer_.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(read.bytes));
  }
  limit_.disarm();
  ReadRequest out;
  out.request.emplace(HttpRequest{parser.release()});
  co_return out;
}

}  // namespace rrgate
