#include "node/transport/start_tls.hpp"

#include <algorithm>

#include "core/session/start_tls.hpp"
#include "core/wire/frame_start.hpp"
#include "node/transport/tls.hpp"
#include "node/transport/watchdog.hpp"

namespace rr {

namespace {

constexpr std::size_t largest_first_message = 512 * 1024;
constexpr std::size_t chunk_size = 4096;

struct FirstBytes {
  Bytes bytes;
  bool is_message = false;  ///< whole; else something that is no message, as far as it was read to see that
};

/// Reads one message and not a byte more.
awaitable<Result<FirstBytes>> read_first(ByteStream& stream) {
  FirstBytes first;
  auto& bytes = first.bytes;
  std::size_t size = frame_start_size;
  while (bytes.size() < size) {
    const auto begin = bytes.size();
    bytes.resize(std::min(size, begin + chunk_size));  // as it comes, not as its header promises
    const auto read = co_await stream.read_some(std::span(bytes).subspan(begin));
    bytes.resize(begin + read.bytes);
    if (read.error)
      co_return make_error(ErrorCode::connection_error, "lost before a message was there: " + read.error.message());
    if (read.is_end()) co_return make_error(ErrorCode::connection_error, "ended before a message was there");
    const auto magic = as_text(bytes).substr(0, frame_magic.size());
    if (magic != frame_magic.substr(0, magic.size())) co_return first;
    if (begin < frame_start_size && bytes.size() >= frame_start_size) {
      size = frame_message_size(bytes);
      if (size < min_message_size || size > largest_first_message)
        co_return first;  // the session says what is wrong with it
    }
  }
  first.is_message = true;
  co_return first;
}

awaitable<error_code> write_all(ByteStream& stream, const Bytes& bytes) {
  const ByteSpan slice(bytes);
  const std::span<const ByteSpan> slices(&slice, 1);
  co_return co_await stream.write(slices);
}

Error late(const ByteStream& stream, std::chrono::milliseconds timeout) {
  return make_error(ErrorCode::connection_error,
                    stream.peer() + ": no message within " + std::to_string(timeout.count()) + " ms");
}

}  // namespace

awaitable<Result<std::unique_ptr<ByteStream>>> start_tls_client(std::unique_ptr<ByteStream> stream, NodeIdentity target,
                                                                TlsContextPtr context,
                                                                std::chrono::milliseconds timeout) {
  ByteStream& plain = *stream;
  Deadline limit(plain.executor(), [&plain] { plain.close(); });
  limit.arm(timeout);
  const auto request = make_start_tls(target, context->has_certificate());
  if (const auto error = co_await write_all(plain, request); error)
    co_return make_error(ErrorCode::connection_error, "STARTTLS: " + error.message());
  const auto answer = co_await read_first(plain);
  if (!limit.is_armed()) co_return late(plain, timeout);
  limit.disarm();
  if (!answer) {
    const auto error = answer.error();
    co_return make_error(error.code, "STARTTLS: " + error.message);
  }
  if (!answer->is_message) co_return protocol_error("STARTTLS: the peer does not speak Robot Raconteur");
  const auto reply = read_start_tls_reply(answer->bytes, target);
  if (!reply) co_return reply.error();

  TlsPeerOptions peer;
  peer.expected = reply->peer;
  auto tls = std::make_unique<TlsStream>(std::move(stream), std::move(context), TlsRole::client, peer);
  if (auto done = co_await tls->handshake(timeout); !done) co_return done.error();
  std::unique_ptr<ByteStream> made = std::move(tls);
  co_return made;
}

awaitable<Result<AcceptedStream>> accept_tls(std::unique_ptr<ByteStream> stream, AcceptTlsOptions options) {
  ByteStream& plain = *stream;
  Deadline limit(plain.executor(), [&plain] { plain.close(); });
  limit.arm(options.timeout);
  for (;;) {
    auto first = co_await read_first(plain);
    if (!limit.is_armed()) co_return late(plain, options.timeout);
    if (!first) {
      const auto error = first.error();
      co_return make_error(error.code, plain.peer() + ": " + error.message);
    }
    auto request = first->is_message ? answer_first_request(first->bytes, options.self, options.context != nullptr)
                                     : Result<FirstRequest>(FirstRequest());
    if (!request || request->kind == FirstRequest::Kind::other) {
      if (options.is_required) {
        const auto refusal =
            make_error(ErrorCode::connection_error, "this node takes TLS connections alone: use rrs+tcp");
        const auto reply = refuse_first_request(first->bytes, options.self, refusal);
        co_await write_all(plain, reply);
        co_await plain.end(no_reason);
        co_return make_error(ErrorCode::connection_error, plain.peer() + ": refused, since it asked for no TLS");
      }
      plain.put_back(first->bytes);
      AcceptedStream accepted;
      accepted.stream = std::move(stream);
      co_return accepted;
    }
    if (const auto error = co_await write_all(plain, request->reply); error)
      co_return make_error(ErrorCode::connection_error, plain.peer() + ": " + error.message());
    if (request->kind == FirstRequest::Kind::get_remote_node_id) continue;
    if (request->refusal) {
      co_await plain.end(no_reason);
      co_return make_error(request->refusal->code, plain.peer() + ": STARTTLS refused: " + request->refusal->message);
    }
    limit.disarm();
    TlsPeerOptions peer;
    peer.expected = request->client.id;
    peer.asks_certificate = request->has_certificate;
    auto tls = std::make_unique<TlsStream>(std::move(stream), options.context, TlsRole::server, peer);
    if (auto done = co_await tls->handshake(options.timeout); !done) co_return done.error();
    AcceptedStream accepted;
    accepted.stream = std::move(tls);
    accepted.claimed = request->client.id;
    accepted.is_encrypted = true;
    co_return accepted;
  }
}

}  // namespace rr
