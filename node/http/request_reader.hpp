// Reads requests from a byte stream, within limits. Layer: node/http. Parsing is Beast's.
#pragma once

#include <chrono>

#include "node/http/message.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"

namespace rrgate {

struct RequestLimits {
  std::size_t header_bytes;
  std::chrono::milliseconds header_timeout;  ///< for a whole header from its first byte, and for each part of a body
  std::chrono::milliseconds idle_timeout;    ///< until that first byte
  std::size_t body_bytes = 64 * 1024;
};

/// What reading came to: a request, or a status to refuse with (408, 413, 431, 400), or neither: the peer is gone.
struct ReadRequest {
  std::optional<HttpRequest> request;
  unsigned refusal = 0;
  std::string detail;
};

/// One for each connection: keeps what was read beyond a request.
class RequestReader {
 public:
  RequestReader(rr::ByteStream& stream, RequestLimits limits);

  rr::awaitable<ReadRequest> next();
  /// Bytes behind the last request: of the next one, or of the protocol that was upgraded to.
  rr::ByteSpan unread() const { return buffer_; }

 private:
  bool is_header_too_long(std::size_t consumed) const;

  rr::ByteStream& stream_;
  RequestLimits limits_;
  rr::Deadline limit_;
  rr::Bytes buffer_;
  bool is_first_ = true;
};

}  // namespace rrgate
