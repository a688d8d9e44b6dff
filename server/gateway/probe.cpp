#include "server/gateway/probe.hpp"

#include <boost/asio/error.hpp>

#include "core/wire/codec.hpp"
#include "core/wire/frame_scanner.hpp"

namespace rrgate {

namespace {

constexpr std::uint32_t offered_capabilities[] = {0x02000003, 0x04000003, 0x04100007};
constexpr std::size_t largest_reply = 64 * 1024;

rr::Error bad_answer(std::string what) {
  return rr::make_error(rr::ErrorCode::connection_error, "device: " + std::move(what));
}

rr::Bytes make_greeting(const rr::ConnectionUrl& url) {
  rr::Message message;
  message.header.version = 2;
  if (url.node_id) message.header.receiver_node_id = *url.node_id;
  message.header.receiver_node_name = url.node_name;
  message.header.sender_node_name = "rrgate";
  message.begin_entry(rr::EntryType::stream_op, "", "CreateConnection");
  message.add("capabilities", rr::DataType::uint32_t, std::size(offered_capabilities),
              rr::ByteSpan(reinterpret_cast<const std::uint8_t*>(offered_capabilities), sizeof(offered_capabilities)));
  rr::EncodedMessage encoded;
  if (auto done = rr::encode(message, {}, encoded); !done) return {};
  return encoded.to_bytes();
}

rr::Result<ProbeResult> read_reply(rr::ByteSpan bytes, const rr::ConnectionUrl& url) {
  rr::Message reply;
  if (auto decoded = rr::decode(bytes, {}, reply); !decoded) return decoded.error();
  if (reply.entries.empty() || reply.entries[0].type != rr::EntryType::stream_op_ret)
    return bad_answer("answered CreateConnection with something else");
  const auto& entry = reply.entries[0];
  // ProtocolError is how nodes without CreateConnection answer it: the header still says who they are.
  if (entry.error != rr::ErrorCode::none && entry.error != rr::ErrorCode::protocol_error) {
    const auto* text = reply.elements_of(entry).find("errorstring");
    return rr::make_error(entry.error, "device refused the connection: " +
                                           (text ? rr::quoted(text->text()) : std::string(rr::error_code_name(entry.error))));
  }
  ProbeResult result;
  result.node_id = reply.header.sender_node_id;
  result.node_name = std::string(reply.header.sender_node_name);
  if (url.node_id && !url.node_id->is_any() && *url.node_id != result.node_id)
    return rr::make_error(rr::ErrorCode::node_not_found, "found node " + rr::format_node_id(result.node_id) +
                                                             ", expected " + rr::format_node_id(*url.node_id));
  if (!url.node_name.empty() && url.node_name != result.node_name)
    return rr::make_error(rr::ErrorCode::node_not_found, "found node " + rr::quoted(result.node_name) + ", expected " +
                                                             rr::quoted(url.node_name));
  return result;
}

}  // namespace

awaitable<rr::Result<ProbeResult>> probe(rr::ConnectionUrl url, DialOptions options, Watchdog& watchdog) {
  auto dialed = co_await dial(url, options, watchdog);
  if (!dialed) co_return dialed.error();
  ByteStream& stream = **dialed;
  Deadline limit(watchdog, [&stream] { stream.close(); });
  limit.arm(options.timeout);

  const auto greeting = make_greeting(url);
  const rr::ByteSpan slice(greeting);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  if (const auto error = co_await stream.write(slices); error) co_return bad_answer(error.message());

  rr::FrameScanner scanner(largest_reply);
  rr::Bytes buffer(4096);
  for (;;) {
    const auto read = co_await stream.read_some(buffer);
    if (!limit.is_armed()) co_return bad_answer("no answer within " + std::to_string(options.timeout.count()) + " ms");
    if (read.error) co_return bad_answer(read.error.message());
    if (read.is_end()) co_return bad_answer("closed the connection without an answer");
    rr::ByteSpan rest(buffer.data(), read.bytes);
    while (!rest.empty()) {
      const auto consumed = scanner.feed(rest);
      if (!consumed) co_return bad_answer(consumed.error().message);
      rest = rest.subspan(*consumed);
      const auto message = scanner.message();
      if (!message) continue;
      // Heartbeats may come before the answer.
      rr::Message peek;
      if (rr::decode(*message, {}, peek) && !peek.entries.empty() &&
          peek.entries[0].type == rr::EntryType::connection_test)
        continue;
      co_return read_reply(*message, url);
    }
  }
}

}  // namespace rrgate
