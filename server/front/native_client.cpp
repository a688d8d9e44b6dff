#include "server/front/native_client.hpp"

#include <algorithm>

#include "core/session/url.hpp"
#include "core/wire/codec.hpp"
#include "core/wire/frame_scanner.hpp"
#include "node/transport/watchdog.hpp"
#include "server/front/refused_client.hpp"
#include "server/front/serve_shared_client.hpp"
#include "server/log/log.hpp"
#include "server/relay/client_relay.hpp"

namespace rrgate {

namespace {

/// What any peer may send before it is authorised (transports spec, section 2).
constexpr std::size_t largest_first_message = 512 * 1024;

/// Reads one message and puts all that was read back, for the relay. Errors: as FrameScanner, or the connection ended.
rr::awaitable<rr::Result<rr::Bytes>> read_first_message(rr::ByteStream& stream, std::size_t limit,
                                                        MemoryBudget::Charge& memory) {
  rr::FrameScanner scanner(limit);
  rr::Bytes seen;
  rr::Bytes buffer(4096);
  for (;;) {
    const auto read = co_await stream.read_some(buffer);
    if (read.error || read.is_end())
      co_return rr::make_error(rr::ErrorCode::connection_error, "ended before its first message was complete");
    const rr::ByteSpan bytes(buffer.data(), read.bytes);
    seen.insert(seen.end(), bytes.begin(), bytes.end());
    if (!memory.resize(2 * seen.size()))  // the scanner has them, too
      co_return rr::make_error(rr::ErrorCode::out_of_system_resource, "the gateway has no memory left for its message");
    const auto consumed = scanner.feed(bytes);
    if (!consumed) co_return consumed.error();
    if (!scanner.message()) continue;
    stream.put_back(seen);
    seen.resize(seen.size() - (bytes.size() - *consumed));
    co_return seen;
  }
}

/// Whether it is the look of a device of ours that comes in here: then the device's URL leads back to us.
bool note_circle(GatewayState& gateway, const rr::NodeId& sender) {
  for (const auto& device : gateway.devices().all()) {
    if (!device->is_own_look(sender)) continue;
    device->note_circle();
    return true;
  }
  return false;
}

/// TLS with the device's own certificate can't be had without the device.
bool asks_for_tls(const rr::Message& request) {
  return !request.entries.empty() && request.entries.front().type == rr::EntryType::stream_op &&
         request.entries.front().member_name == "STARTTLS";
}

std::string describe_wish(const rr::MessageHeader& header) {
  std::string out;
  if (!header.receiver_node_id.is_any()) out += "node id " + rr::format_node_id(header.receiver_node_id);
  if (!header.receiver_node_name.empty())
    out += (out.empty() ? "" : ", ") + ("node name " + rr::quote(header.receiver_node_name));
  return out.empty() ? "no node in particular, and there is more than one" : out;
}

}  // namespace

rr::Bytes make_refusal(const rr::Message& request, const rr::NodeId& own_id, const rr::Error& error) {
  rr::Message reply;
  reply.header.version = 2;
  reply.header.sender_node_id = own_id;
  reply.header.sender_node_name = "rrgate";
  reply.header.receiver_node_id = request.header.sender_node_id;
  reply.header.receiver_node_name = request.header.sender_node_name;
  reply.header.receiver_endpoint = request.header.sender_endpoint;
  if (request.entries.empty()) return {};
  const auto& asked = request.entries.front();
  auto& entry = reply.begin_entry(rr::reply_type(asked.type), asked.service_path, asked.member_name, asked.request_id);
  entry.error = error.code;
  const auto name = error.qualified_name();
  reply.add_text("errorname", name);
  reply.add_text("errorstring", error.message);
  rr::EncodedMessage encoded;
  if (auto done = rr::encode(reply, {}, encoded); !done) return {};
  return encoded.to_bytes();
}

rr::awaitable<rr::awaitable<void>> serve_native_client(GatewayState& gateway, Connection& connection,
                                                       std::unique_ptr<rr::ByteStream> stream) {
  auto& client = *stream;
  rr::Deadline limit(client.executor(), [&client] { client.close(); });
  limit.arm(gateway.config().limits.header_timeout);
  auto memory = gateway.memory().charge(connection.network);
  const auto largest = std::min(largest_first_message, gateway.config().limits.max_message_size);
  const auto bytes = co_await read_first_message(client, largest, memory);
  limit.disarm();
  rr::Message request;
  rr::Result<> read = bytes ? rr::decode(*bytes, {}, request) : rr::Result<>(bytes.error());
  if (!read) {
    gateway.reject(Rejection::bad_request);
    gateway.log_refusal(LogLevel::info, "native client dropped", connection.client,
                        {{"peer", connection.client}, {"error", read.error().message}});
    client.close();
    co_return rr::awaitable<void>();
  }

  const auto destination =
      find_destination(gateway, request.header.receiver_node_id, request.header.receiver_node_name);
  rr::Error refusal;
  bool is_denied = false;
  // Who may see nothing is refused at a node that is not there as at one that is.
  const bool is_stranger = !gateway.access().state().rules.sees_any(connection.identity);
  const bool is_relayed = destination ? !destination->node : is_stranger;
  // What is relayed may be encrypted end to end, from its first message on.
  const bool is_in_clear = !connection.peer.is_encrypted && !(is_relayed && asks_for_tls(request));
  rr::Result<> allowed;
  if (gateway.config().tls.is_required && is_in_clear && (destination || is_relayed)) {
    gateway.reject(Rejection::forbidden);
    allowed = rr::make_error(rr::ErrorCode::permission_denied,
                             "the gateway is reached by TLS alone: rr+wss, or rrs+tcp where it relays");
  } else if (is_relayed) {
    allowed = may_relay(gateway, connection, destination ? destination->device : nullptr);
  }
  if (note_circle(gateway, request.header.sender_node_id)) {
    refusal = rr::make_error(rr::ErrorCode::connection_error, "the way leads back to the gateway that it began at");
  } else if (!allowed) {
    refusal = allowed.error();
    is_denied = true;
  } else if (destination && destination->node) {
    const auto host = connection.local.address().to_string();
    auto base_url = "rr+tcp://" + rr::format_host_port(rr::without_zone(host), connection.local.port()) + "/";
    co_return serve_shared_client(gateway, connection, *destination, std::move(stream), std::move(base_url));
  } else if (destination) {
    auto boarding = co_await board(gateway, connection, *destination->device);
    if (boarding) co_return relay_client(gateway, connection, std::move(stream), std::move(*boarding));
    refusal = boarding.error();
  } else {
    gateway.reject(Rejection::no_such_device);
    refusal = rr::make_error(rr::ErrorCode::node_not_found, "Node not found");
  }
  gateway.log_refusal(
      LogLevel::info, "native client refused", connection.client,
      {{"peer", connection.client}, {"wanted", describe_wish(request.header)}, {"error", refusal.message}});
  if (is_denied && !asks_for_tls(request)) {
    const auto& asked = request.header;
    auto self = is_stranger  ? unknown_identity(gateway, asked.receiver_node_id, asked.receiver_node_name)
                : is_relayed ? relayed_identity(gateway, *destination->device)
                             : destination->node->identity();
    co_return refuse_in_session(gateway, connection, std::move(self), std::move(stream), std::move(refusal));
  }
  const auto reply = make_refusal(request, gateway.node_id(), refusal);
  const rr::ByteSpan slice(reply);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  co_await client.write(slices);
  co_await client.end(rr::no_reason);
  co_return rr::awaitable<void>();
}

}  // namespace rrgate
