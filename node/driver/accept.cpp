#include "node/driver/accept.hpp"

#include <array>

#include "core/wire/frame_start.hpp"
#include "node/http/foreign_page.hpp"
#include "node/http/request_reader.hpp"
#include "node/http/upgrade.hpp"
#include "node/transport/start_tls.hpp"
#include "node/transport/watchdog.hpp"
#include "node/transport/websocket.hpp"

namespace rr {

namespace {

constexpr std::chrono::milliseconds prologue_time{5000};
constexpr std::size_t max_header_bytes = 8192;

Error dropped(const ByteStream& stream, std::string why) {
  return make_error(ErrorCode::connection_error, "connection of " + stream.peer() + " dropped: " + std::move(why));
}

awaitable<error_code> write_text(ByteStream& stream, std::string text) {
  const ByteSpan slice = as_bytes(text);
  const std::span<const ByteSpan> slices(&slice, 1);
  co_return co_await stream.write(slices);
}

awaitable<Result<Accepted>> upgrade(std::unique_ptr<ByteStream> stream, AcceptOptions options) {
  const rrgate::RequestLimits limits{max_header_bytes, prologue_time, prologue_time};
  rrgate::RequestReader reader(*stream, limits);
  const auto read = co_await reader.next();
  std::string why = read.failure.detail;
  rrgate::Response refusal;
  if (read.request && rrgate::asks_for_websocket(*read.request)) {
    auto refused = rrgate::refuse_foreign_page(*read.request, {.allowed_origins = options.allowed_origins});
    if (!refused) refused = rrgate::refuse_upgrade(*read.request);
    if (!refused) {
      std::string accepted = rrgate::format_upgrade_response(*read.request);
      if (const auto error = co_await write_text(*stream, std::move(accepted)); error)
        co_return dropped(*stream, error.message());
      stream->put_back(reader.unread());
      const bool takes_close = rrgate::takes_close_frames(*read.request);
      Accepted result{std::make_unique<WebSocketStream>(std::move(stream), WebSocketRole::server, takes_close),
                      "rr+ws"};
      co_return result;
    }
    refusal = std::move(*refused);
    why = "its WebSocket was refused with status " + std::to_string(refusal.status);
  } else if (read.request) {
    refusal = rrgate::problem_response(404, "a Robot Raconteur node; it answers WebSockets and native clients alone");
    why = "an HTTP request that is no WebSocket";
  } else if (read.failure.status != 0) {
    refusal = rrgate::problem_response(read.failure.status, read.failure.detail);
  } else {
    co_return dropped(*stream, "it ended within its first request");
  }
  std::string response =
      rrgate::format_response_head(refusal, false, 1) + (refusal.body ? *refusal.body : std::string());
  co_await write_text(*stream, std::move(response));
  co_await stream->end(no_reason);
  co_return dropped(*stream, std::move(why));
}

awaitable<Result<Accepted>> accept_plain(std::unique_ptr<ByteStream> stream, AcceptOptions options) {
  auto& raw = *stream;
  Deadline limit(raw.executor(), [&raw] { raw.close(); });
  limit.arm(prologue_time);
  std::array<std::uint8_t, 4096> first;
  std::size_t size = 0;
  while (size < frame_magic.size()) {
    const auto read = co_await raw.read_some(std::span(first).subspan(size));
    if (read.error || read.is_end())
      co_return dropped(raw, limit.is_armed() ? "it ended before its first four bytes" : "it sent nothing for 5 s");
    size += read.bytes;
  }
  limit.disarm();
  const ByteSpan seen(first.data(), size);
  raw.put_back(seen);
  if (as_text(seen.first(frame_magic.size())) == frame_magic) {
    Accepted result{std::move(stream), "rr+tcp"};
    co_return result;
  }
  co_return co_await upgrade(std::move(stream), std::move(options));
}

}  // namespace

awaitable<Result<Accepted>> accept_stream(std::unique_ptr<ByteStream> stream, AcceptOptions options) {
  AcceptTlsOptions tls;
  tls.self = options.self;
  tls.context = options.tls;
  tls.is_required = options.requires_tls;
  tls.timeout = prologue_time;
  auto accepted = co_await accept_plain(std::move(stream), std::move(options));
  if (!accepted || (!tls.context && !tls.is_required)) co_return accepted;
  auto secured = co_await accept_tls(std::move(accepted->stream), std::move(tls));
  if (!secured) co_return secured.error();
  accepted->stream = std::move(secured->stream);
  if (secured->is_encrypted) accepted->scheme.replace(0, 2, "rrs");
  accepted->is_encrypted = secured->is_encrypted;
  const auto verified = accepted->stream->verified_peer();
  accepted->known_peer = verified.is_any() ? secured->claimed : verified;
  co_return accepted;
}

}  // namespace rr
