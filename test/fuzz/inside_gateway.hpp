// A gateway without sockets of its own and its HTTP clients, all in this process and on one loop: what fuzzers of the
// gateway as a whole have in common.
#pragma once

#include <algorithm>
#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "server/gateway/gateway.hpp"
#include "test/fuzz/hostile_peer.hpp"

namespace rr::fuzz {

/// A client of the gateway that keeps all that it is sent.
class InsideClient {
 public:
  InsideClient(boost::asio::io_context& io, rrgate::Gateway& gateway) : io_(io) {
    auto stream = gateway.connect_inside();
    test::require(stream.has_value(), "the gateway takes a client of this process");
    state_->stream = std::move(*stream);
    boost::asio::co_spawn(io_, read_all(state_), boost::asio::detached);
  }
  ~InsideClient() { state_->stream->close(); }
  InsideClient(const InsideClient&) = delete;
  InsideClient& operator=(const InsideClient&) = delete;

  void send(std::string text) { boost::asio::co_spawn(io_, write_all(state_, std::move(text)), boost::asio::detached); }
  const std::string& received() const { return state_->received; }
  bool has_ended() const { return state_->has_ended; }
  void forget() { state_->received.clear(); }

 private:
  struct State {
    std::unique_ptr<ByteStream> stream;
    std::string received;
    bool has_ended = false;
  };
  static awaitable<void> read_all(std::shared_ptr<State> state) {
    std::array<std::uint8_t, 16384> buffer;
    for (;;) {
      const auto read = co_await state->stream->read_some(buffer);
      if (read.bytes == 0) break;
      state->received += as_text(ByteSpan(buffer).first(read.bytes));
    }
    state->has_ended = true;
  }
  static awaitable<void> write_all(std::shared_ptr<State> state, std::string text) {
    const auto slice = as_bytes(text);
    const std::span<const ByteSpan> slices(&slice, 1);
    co_await state->stream->write(slices);
  }

  boost::asio::io_context& io_;
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

/// Until it is so, the time is over, or nothing has happened for a few milliseconds: all peers are on this loop.
/// Returns whether it is so.
inline bool run_until(boost::asio::io_context& io, std::chrono::milliseconds patience,
                      const std::function<bool()>& is_so, int most_quiet = 3) {
  const auto end = std::chrono::steady_clock::now() + patience;
  for (int quiet = 0; !is_so() && quiet < most_quiet && std::chrono::steady_clock::now() < end;) {
    io.restart();
    quiet = io.run_one_for(std::chrono::milliseconds(1)) == 0 ? quiet + 1 : 0;
  }
  return is_so();
}

/// Does what can be done without waiting.
inline void settle(boost::asio::io_context& io) {
  for (int quiet = 0; quiet < 3; ++quiet) {
    io.restart();
    if (io.poll() > 0) quiet = 0;
  }
}

/// What the first response in a text is.
struct Answer {
  unsigned status = 0;  ///< 0: its head is not whole
  std::string_view head;
  std::string_view body;
  bool is_whole = false;
  bool is_stream = false;  ///< in chunks
};

inline std::string_view header_of(std::string_view head, std::string_view name) {
  for (auto at = head.find("\r\n"); at != std::string_view::npos; at = head.find("\r\n", at + 2)) {
    const auto line = head.substr(at + 2, head.find("\r\n", at + 2) - at - 2);
    if (line.size() <= name.size() || line[name.size()] != ':') continue;
    const auto is_same = [](char a, char b) { return std::tolower(a) == std::tolower(b); };
    if (std::equal(name.begin(), name.end(), line.begin(), is_same))
      return line.substr(line.find_first_not_of(" ", name.size() + 1));
  }
  return {};
}

/// Aborts where the text does not begin as a response does. `method`  of the request.
inline Answer read_answer(std::string_view text, std::string_view method) {
  using test::require;
  Answer out;
  const auto end = text.find("\r\n\r\n");
  if (end == std::string_view::npos) return out;
  out.head = text.substr(0, end + 2);
  require(out.head.starts_with("HTTP/1.") && out.head.size() > 13 && out.head[8] == ' ' && out.head[12] == ' ',
          "a response begins with its status line");
  for (const auto digit : out.head.substr(9, 3)) {
    require(digit >= '0' && digit <= '9', "a status is a number");
    out.status = out.status * 10 + static_cast<unsigned>(digit - '0');
  }
  require(out.status >= 100 && out.status < 600, "a status is one of HTTP's");
  require(out.head.find('\0') == std::string_view::npos, "a head has no zeros");
  out.body = text.substr(end + 4);
  const auto length = header_of(out.head, "Content-Length");
  out.is_stream = header_of(out.head, "Transfer-Encoding") == "chunked";
  require(length.empty() || !out.is_stream, "a body has one length");
  if (method == "HEAD" || out.status == 204 || out.status == 304 || out.status == 101) {
    out.is_whole = true;
    // Of what can't be read nobody knows that it was HEAD; the connection ends behind the answer.
    const bool is_unread = out.status == 400 && header_of(out.head, "Connection") == "close";
    require(out.status == 101 || out.body.empty() || is_unread, "what has no body sends none");
  } else if (out.is_stream) {
    out.is_whole = out.body.ends_with("0\r\n\r\n");
  } else {
    std::size_t bytes = 0;
    for (const auto digit : length) {
      require(digit >= '0' && digit <= '9', "a length is a number");
      bytes = bytes * 10 + static_cast<std::size_t>(digit - '0');
    }
    require(out.body.size() <= bytes, "a body is as long as its head says");
    out.is_whole = out.body.size() == bytes;
  }
  return out;
}

/// One masked text frame of a WebSocket.
inline std::string text_frame(std::string_view text) {
  std::string out = "\x81";
  if (text.size() < 126) {
    out += static_cast<char>(0x80 | text.size());
  } else {
    out += static_cast<char>(0xfe);
    out += static_cast<char>(text.size() >> 8);
    out += static_cast<char>(text.size() & 0xff);
  }
  return out + std::string(4, '\0') + std::string(text);
}

}  // namespace rr::fuzz
