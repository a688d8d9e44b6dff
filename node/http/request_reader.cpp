#include "node/http/request_reader.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>

namespace rrgate {

namespace {

/// A header is read in parts as long as what is there of it, within these: who sends the beginning of one, or nothing
/// yet, has the gateway hold little more.
constexpr std::size_t least_header_chunk = 512;
constexpr std::size_t most_header_chunk = 2048;
constexpr std::size_t body_chunk = 4096;

ReadFailure failure_of(const boost::beast::error_code& error, const RequestLimits& limits, std::size_t body_limit) {
  if (error == http::error::header_limit)
    return {431, "request header longer than " + std::to_string(limits.header_bytes) + " bytes"};
  if (error == http::error::body_limit)
    return {413, "request body longer than " + std::to_string(body_limit) + " bytes"};
  return {400, "not an HTTP request: " + error.message()};
}

/// What Beast takes and others may read differently: where a request ends, whom it is for, and what its body is, must
/// be beyond doubt.
std::optional<ReadFailure> check_header(const HttpRequest& request) {
  const auto& message = request.message;
  const auto codings = message.count(http::field::transfer_encoding);
  const auto coding = request.header(http::field::transfer_encoding);
  if (codings > 1 || (codings == 1 && !equals_ignoring_case(coding, "chunked")))
    return ReadFailure{501, "Transfer-Encoding is " + rr::quote(coding) + ", expected \"chunked\" alone"};
  if (codings != 0 && (message.version() < 11 || message.count(http::field::content_length) != 0))
    return ReadFailure{400, "Transfer-Encoding needs HTTP/1.1, and no Content-Length beside it"};
  const auto encoding = request.list(http::field::content_encoding);
  if (!encoding.empty() && !equals_ignoring_case(encoding, "identity"))
    return ReadFailure{415, "Content-Encoding is " + rr::quote(encoding) + "; send the body as it is"};
  const auto hosts = message.count(http::field::host);
  if (hosts > 1 || (hosts == 0 && message.version() >= 11))
    return ReadFailure{400, "the request has " + std::to_string(hosts) + " Host headers, expected one"};
  return std::nullopt;
}

}  // namespace

RequestReader::RequestReader(rr::ByteStream& stream, RequestLimits limits)
    : stream_(stream), limits_(limits), limit_(stream.executor(), [this] {
        // Again and again: what is read at that moment can't be cancelled any more.
        is_late_ = true;
        stream_.cancel();
        limit_.arm(rr::Watchdog::tick);
      }) {}

void RequestReader::arm(std::chrono::milliseconds limit) {
  is_late_ = false;
  limit_.arm(limit);
}

/// A header that goes on in another line: obsolete (RFC 9112, section 5.2), and not read alike by everybody. The parser
/// takes no header before it has seen how the next line begins, so that both are in buffer_.
bool RequestReader::has_folded_header() const {
  const auto text = rr::as_text(buffer_);
  const auto header = text.substr(0, text.find("\r\n\r\n"));
  return header.find("\r\n ") != std::string_view::npos || header.find("\r\n\t") != std::string_view::npos;
}

/// Beast's own header_limit is a few bytes generous; ours counts every byte up to and with the empty line.
bool RequestReader::is_header_too_long(std::size_t consumed) const {
  const auto text = rr::as_text(buffer_);
  const auto end = text.find("\r\n\r\n");
  return consumed + (end == std::string_view::npos ? text.size() : end + 4) > limits_.header_bytes;
}

std::size_t RequestReader::parse(Parser& parser, rr::Bytes& buffer, boost::beast::error_code& error) {
  const auto used = parser.put(boost::asio::const_buffer(buffer.data(), buffer.size()), error);
  buffer.erase(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(used));
  if (error == http::error::need_more) error = {};
  return used;
}

/// Reads more into buffer_, at most `chunk` bytes, while limit_ is armed.
rr::awaitable<std::optional<ReadFailure>> RequestReader::read_on(std::size_t chunk) {
  // Read where it is kept: of many clients that send slowly each holds what it has sent, and little more.
  if (buffer_.empty() && buffer_.capacity() > 2 * chunk) rr::Bytes().swap(buffer_);
  const auto had = buffer_.size();
  buffer_.reserve(had + chunk);  // no more than that
  buffer_.resize(had + chunk);
  const auto read = co_await stream_.read_some(std::span(buffer_).subspan(had));
  buffer_.resize(had + read.bytes);
  if (!is_late_ && !read.error && !read.is_end()) co_return std::nullopt;
  limit_.disarm();
  if (!is_late_) co_return ReadFailure();
  co_return ReadFailure{408, "the request took longer than " + std::to_string(limits_.header_timeout.count()) +
                                 " ms, or its body came with less than " + std::to_string(least_rate) +
                                 " bytes a second"};
}

ReadRequest RequestReader::take() {
  auto request = std::make_unique<HttpRequest>(HttpRequest{std::move(parser_->get())});
  if (auto failure = check_header(*request)) return {nullptr, std::move(*failure)};
  if (parser_->is_done()) parser_.reset();
  return {std::move(request)};
}

rr::awaitable<ReadRequest> RequestReader::next() {
  if (has_unread_body()) co_return ReadRequest();
  auto& parser = parser_.emplace();
  parser.header_limit(static_cast<std::uint32_t>(limits_.header_bytes) + 1024);
  parser.body_limit(limits_.body_bytes);
  std::size_t consumed = 0;
  // The first request follows the first bytes of the connection, so the short limit holds for it from the start.
  bool is_started = std::exchange(is_first_, false) || !buffer_.empty();
  arm(is_started ? limits_.header_timeout : limits_.idle_timeout);
  for (;;) {
    boost::beast::error_code error;
    if (is_header_too_long(consumed)) error = http::error::header_limit;
    if (!error && has_folded_header()) error = http::error::bad_obs_fold;
    if (!error && !buffer_.empty()) consumed += parse(parser, buffer_, error);
    if (error) {
      limit_.disarm();
      co_return ReadRequest{nullptr, failure_of(error, limits_, limits_.body_bytes)};
    }
    if (parser.is_header_done()) break;
    const auto chunk = std::clamp(consumed + buffer_.size(), least_header_chunk, most_header_chunk);
    auto failure = co_await read_on(chunk);
    // One that sends nothing is idle, not late.
    if (failure && !is_started) failure = ReadFailure();
    if (failure) co_return ReadRequest{nullptr, std::move(*failure)};
    if (!std::exchange(is_started, true)) arm(limits_.header_timeout);
  }
  limit_.disarm();
  co_return take();
}

rr::awaitable<std::optional<ReadFailure>> RequestReader::read_body(HttpRequest& request, const HasRoom& has_room,
                                                                   std::size_t limit) {
  if (!has_unread_body()) co_return std::nullopt;
  auto& parser = *parser_;
  limit = std::min(limit, limits_.body_bytes);
  parser.body_limit(limit);
  parser.eager(true);
  const auto told = parser.content_length().value_or(0);
  if (told > limit) co_return failure_of(http::error::body_limit, limits_, limit);
  const auto begin = std::chrono::steady_clock::now();
  std::size_t received = 0;
  if (buffer_.empty() && has_token(request.header(http::field::expect), "100-continue")) {
    const auto go_on = rr::as_bytes("HTTP/1.1 100 Continue\r\n\r\n");
    const std::span<const rr::ByteSpan> slices(&go_on, 1);
    if (co_await stream_.write(slices)) co_return ReadFailure();
  }
  for (;;) {
    const auto size = std::max<std::size_t>(told, parser.get().body().size() + buffer_.size());
    if (has_room && !has_room(size))
      co_return ReadFailure{503, "the gateway has no memory left for a body of " + std::to_string(size) + " bytes"};
    boost::beast::error_code error;
    if (!buffer_.empty()) received += parse(parser, buffer_, error);
    if (error) co_return failure_of(error, limits_, limit);
    if (parser.is_done()) break;
    // What the parser has not taken is no data.
    if (buffer_.size() > limits_.header_bytes)
      co_return ReadFailure{
          431, "a chunk's extensions, or trailers, longer than " + std::to_string(limits_.header_bytes) + " bytes"};
    const auto end = begin + limits_.header_timeout + std::chrono::milliseconds(received * 1000 / least_rate);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    arm(std::min(limits_.header_timeout, left));
    auto failure = co_await read_on(body_chunk);
    limit_.disarm();
    if (failure) co_return failure;
  }
  request.message.body() = std::move(parser.get().body());
  parser_.reset();
  co_return std::nullopt;
}

}  // namespace rrgate
