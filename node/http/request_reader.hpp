// Reads requests from a byte stream, within limits: the header first, the body when it is asked for. Layer: node/http.
// Parsing is Beast's. Source: RFC 9112 sections 3.2 and 6; RFC 9110 section 10.1.1 (100-continue).
#pragma once

#include <boost/beast/http/parser.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "node/http/message.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"

namespace rrgate {

struct RequestLimits {
  std::size_t header_bytes;
  /// For a whole header from its first byte, and for each part of a body; see also least_rate.
  std::chrono::milliseconds header_timeout;
  std::chrono::milliseconds idle_timeout;  ///< until that first byte
  std::size_t body_bytes = 64 * 1024;
};

/// Bytes a second that bodies need at least, on average from their first byte, beside one header_timeout.
inline constexpr std::size_t least_rate = 8 * 1024;

/// Why something could not be read.
struct ReadFailure {
  unsigned status = 0;  ///< to refuse with: 400, 408, 413, 415, 431, 501, 503; 0: the peer is gone
  std::string detail;
};

/// What reading came to: a request, or else why there is none. Small, since each connection waits with room for one.
struct ReadRequest {
  std::unique_ptr<HttpRequest> request;
  ReadFailure failure = {};
};

/// One for each connection: keeps what was read beyond a request.
class RequestReader {
 public:
  RequestReader(rr::ByteStream& stream, RequestLimits limits);

  /// The next request up to the end of its header; the body before it was read, or there was none.
  rr::awaitable<ReadRequest> next();
  /// Whether the last request has a body that was not read. Where it stays so, nothing can follow.
  bool has_unread_body() const { return parser_ && !parser_->is_done(); }

  /// Asked with the size of the whole body as far as it is known, before memory is taken for it. False: 503.
  using HasRoom = std::function<bool(std::size_t bytes)>;
  /// Reads the body of the last request, `request`, into it. At most `limit` bytes, where that is less than
  /// RequestLimits::body_bytes. Both are borrowed for the wait. Returns why that failed; nullopt: it is there.
  rr::awaitable<std::optional<ReadFailure>> read_body(HttpRequest& request, const HasRoom& has_room,
                                                      std::size_t limit = std::size_t(-1));

  /// Bytes behind the last request: of the next one, or of the protocol that was upgraded to.
  rr::ByteSpan unread() const { return buffer_; }

 private:
  using Parser = http::request_parser<http::string_body>;

  bool is_header_too_long(std::size_t consumed) const;
  bool has_folded_header() const;
  /// Gives the parser what was read. Returns how much of it was taken.
  static std::size_t parse(Parser& parser, rr::Bytes& buffer, boost::beast::error_code& error);
  /// The request whose header the parser has.
  ReadRequest take();
  rr::awaitable<std::optional<ReadFailure>> read_on(std::size_t chunk);

  /// Reads have to end within that, until limit_ is disarmed.
  void arm(std::chrono::milliseconds limit);

  rr::ByteStream& stream_;
  RequestLimits limits_;
  rr::Deadline limit_;
  bool is_late_ = false;          ///< limit_ has passed
  std::optional<Parser> parser_;  ///< of the last request, where it has a body
  rr::Bytes buffer_;
  bool is_first_ = true;
};

}  // namespace rrgate
