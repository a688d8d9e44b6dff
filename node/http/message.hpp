// A request and what answers it. Layer: node/http.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "node/transport/byte_stream.hpp"

namespace rrgate {

namespace http = boost::beast::http;

/// Who sent a request, and by which URL: as the client sees it, before any proxy.
struct Arrival {
  boost::asio::ip::address address;
  std::string peer;  ///< the same for logs, with the port where it is known
  bool is_encrypted = false;
  std::string host;    ///< host[:port]; empty where the request names none
  std::string prefix;  ///< of all paths, "" or "/robots"
};

/// A whole request, its body included (bounded while it was read).
struct HttpRequest {
  http::request<http::string_body> message;
  Arrival arrival = {};

  /// The target before and after '?'. The path is as received, not percent-decoded.
  std::string_view path() const;
  std::string_view query() const;
  /// First value of a header, without surrounding white space; empty when absent.
  std::string_view header(http::field name) const;
  std::string_view header(std::string_view name) const;
  /// All values of a header that is a list: several lines are one, with commas (RFC 9110, section 5.3).
  std::string list(http::field name) const;
};

class ResponseWriter;

struct Response {
  unsigned status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  /// Immutable, so that a cached file is shared by all who fetch it. Null: no body.
  std::shared_ptr<const std::string> body;
  bool closes = false;       ///< end the connection after this
  bool is_streamed = false;  ///< the body's length is not known yet
  /// Where the answer has to be waited for: answers in place of this response.
  std::function<rr::awaitable<void>(ResponseWriter& writer)> answer_later = {};

  Response& set(std::string name, std::string value) {
    headers.emplace_back(std::move(name), std::move(value));
    return *this;
  }
};

Response text_response(unsigned status, std::string_view content_type, std::string body);
Response json_response(unsigned status, std::string json);
/// RFC 9457: {"type":"about:blank","title":...,"status":...,"detail":...} as application/problem+json.
Response problem_response(unsigned status, std::string_view detail);

/// Status line and headers, with Content-Length or chunks, Date-less, and the headers every response of ours has.
std::string format_response_head(const Response& response, bool keeps_alive, unsigned http_minor_version);

/// Whether a comma-separated header value has `token`, in any case.
bool has_token(std::string_view list, std::string_view token);
/// Whether a header like Accept takes what it names, in any case, or refuses it by q=0; nullopt: it does not name it.
/// Source: RFC 9110, section 12.4.2.
std::optional<bool> acceptance(std::string_view list, std::string_view name);
/// Whether it names it and takes it.
bool accepts(std::string_view list, std::string_view name);
bool equals_ignoring_case(std::string_view left, std::string_view right);

}  // namespace rrgate
