#include "node/transport/http_connect.hpp"

#include <algorithm>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <nlohmann/json.hpp>

#include "core/support/random.hpp"
#include "core/support/whole_number.hpp"
#include "node/tls/base64.hpp"
#include "node/transport/websocket.hpp"
#include "node/transport/websocket_frames.hpp"

namespace rr {

namespace http = boost::beast::http;
using boost::beast::iequals;

namespace {

constexpr std::size_t max_header_bytes = 8192;
constexpr std::size_t max_problem_bytes = 1024;  // its text becomes a part of our message

using Answer = http::response<http::empty_body>;

std::string_view header(const Answer& answer, http::field name) {
  const auto value = answer[name];
  return {value.data(), value.size()};
}

bool has_token(std::string_view list, std::string_view wanted) {
  const http::token_list tokens(list);
  return std::any_of(tokens.begin(), tokens.end(), [&](const auto& token) {
    return iequals(token, boost::beast::string_view(wanted.data(), wanted.size()));
  });
}

std::string make_key() {
  const NodeId random = random_node_id();  // as many bytes as a key has
  return encode_base64(random.bytes);
}

awaitable<error_code> write_text(ByteStream& stream, std::string text) {
  const ByteSpan slice = as_bytes(text);
  const std::span<const ByteSpan> slices(&slice, 1);
  co_return co_await stream.write(slices);
}

/// Sends a request and reads the head of its answer; what follows it is put back.
awaitable<Result<Answer>> ask(ByteStream& stream, std::string request, std::string_view what) {
  const auto fail = [&](const std::string& why) {
    return make_error(ErrorCode::connection_error, std::string(what) + ": " + why);
  };
  if (const auto error = co_await write_text(stream, std::move(request)); error) co_return fail(error.message());
  Bytes received;
  std::size_t head_size = 0;
  while (head_size == 0) {
    std::uint8_t chunk[1024];
    const auto read = co_await stream.read_some(chunk);
    if (read.error) co_return fail(read.error.message());
    if (read.is_end()) co_return fail("the server closed the connection without an answer");
    received.insert(received.end(), chunk, chunk + read.bytes);
    const auto end = as_text(received).find("\r\n\r\n");
    if (end != std::string_view::npos) head_size = end + 4;
    if (head_size > max_header_bytes || (head_size == 0 && received.size() > max_header_bytes))
      co_return fail("the answer's header is longer than " + std::to_string(max_header_bytes) + " bytes");
  }
  http::response_parser<http::empty_body> parser;
  parser.skip(true);
  boost::beast::error_code error;
  parser.put(boost::asio::const_buffer(received.data(), head_size), error);
  if (error || !parser.is_header_done()) co_return fail("the answer is not HTTP: " + error.message());
  stream.put_back(ByteSpan(received).subspan(head_size));
  co_return parser.release();
}

std::string describe(const Answer& answer) {
  const auto reason = answer.reason();
  return "status " + std::to_string(answer.result_int()) + " " + quote(std::string_view(reason.data(), reason.size()));
}

/// Why a server refuses, where it says so as gateways do: the "detail" of a problem document (RFC 9457), as ": text".
/// Empty where there is none, or not all of it comes.
awaitable<std::string> read_detail(ByteStream& stream, const Answer& refusal) {
  const auto size = whole_number<std::size_t>(header(refusal, http::field::content_length));
  const bool is_problem = header(refusal, http::field::content_type).starts_with("application/problem+json");
  if (!is_problem || !size || *size > max_problem_bytes) co_return "";
  Bytes body(*size);
  for (std::size_t done = 0; done < body.size();) {
    const auto read = co_await stream.read_some(std::span(body).subspan(done));
    if (read.error || read.is_end()) co_return "";
    done += read.bytes;
  }
  const auto problem = nlohmann::json::parse(as_text(body), nullptr, false);
  const auto* detail = problem.is_object() && problem.contains("detail") ? &problem["detail"] : nullptr;
  if (!detail || !detail->is_string()) co_return "";
  co_return ": " + detail->get_ref<const std::string&>();
}

}  // namespace

bool is_extra_header(std::string_view name, std::string_view value) {
  constexpr std::string_view taken[] = {
      "Host",           "Upgrade",           "Connection",           "Sec-WebSocket-Key", "Sec-WebSocket-Protocol",
      "Content-Length", "Transfer-Encoding", "Sec-WebSocket-Version"};
  const auto is_token_char = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
  };
  const auto is_visible = [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f; };
  return !name.empty() && std::all_of(name.begin(), name.end(), is_token_char) &&
         std::all_of(value.begin(), value.end(), is_visible) &&
         std::none_of(std::begin(taken), std::end(taken), [&](std::string_view other) {
           return iequals(boost::beast::string_view(name.data(), name.size()),
                          boost::beast::string_view(other.data(), other.size()));
         });
}

awaitable<Result<std::unique_ptr<ByteStream>>> connect_websocket(std::unique_ptr<ByteStream> stream, ConnectionUrl url,
                                                                 HttpHeaders headers) {
  const auto* scheme = find_url_scheme(url.scheme);
  const bool is_default_port = scheme != nullptr && scheme->default_port == url.port;
  const std::string host_port = format_host_port(url.host, url.port);
  const std::string named = format_host_port(without_zone(url.host), url.port);
  const std::string host = is_default_port ? named.substr(0, named.rfind(':')) : named;
  const std::string what = "WebSocket to " + host_port;
  const std::string key = make_key();
  std::string request =
      "GET " + (url.path.empty() ? "/" : url.path) + (url.query.empty() ? "" : "?" + url.query) +
      " HTTP/1.1\r\nHost: " + host + "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: " + key +
      "\r\nSec-WebSocket-Protocol: " + std::string(websocket_subprotocol) + "\r\nSec-WebSocket-Version: 13\r\n";
  for (const auto& [name, value] : headers) request += name + ": " + value + "\r\n";
  request += "\r\n";
  const auto fail = [&](const std::string& why) { return make_error(ErrorCode::connection_error, what + ": " + why); };

  const auto answer = co_await ask(*stream, std::move(request), what);
  if (!answer) co_return answer.error();
  if (answer->result_int() != 101) {
    const auto detail = co_await read_detail(*stream, *answer);
    co_return fail("the server refused with " + describe(*answer) + detail);
  }
  if (!has_token(header(*answer, http::field::upgrade), "websocket") ||
      !has_token(header(*answer, http::field::connection), "upgrade"))
    co_return fail("the answer is no upgrade to a WebSocket");
  if (header(*answer, http::field::sec_websocket_accept) != websocket_accept(key))
    co_return fail("Sec-WebSocket-Accept is wrong: something between here and the server answers for it");
  const auto protocol = answer->find(http::field::sec_websocket_protocol);
  if (protocol != answer->end() &&
      !has_token(header(*answer, http::field::sec_websocket_protocol), websocket_subprotocol))
    co_return fail("the server speaks the subprotocol " + quote(header(*answer, http::field::sec_websocket_protocol)) +
                   ", expected " + std::string(websocket_subprotocol));
  std::unique_ptr<ByteStream> socket =
      std::make_unique<WebSocketStream>(std::move(stream), WebSocketRole::client, false);
  co_return socket;
}

awaitable<Result<>> connect_through_proxy(ByteStream& proxy, HostPort target) {
  const std::string host = format_host_port(target.host, target.port);
  const std::string what = "proxy " + proxy.peer() + " to " + host;
  std::string request = "CONNECT " + host + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n";
  const auto answer = co_await ask(proxy, std::move(request), what);
  if (!answer) co_return answer.error();
  if (answer->result_int() / 100 != 2)
    co_return make_error(ErrorCode::connection_error, what + ": refused with " + describe(*answer));
  co_return Result<>();
}

}  // namespace rr
