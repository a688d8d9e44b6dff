#include "server/front/front_door.hpp"

#include <algorithm>
#include <array>

#include "node/transport/tls.hpp"
#include "node/transport/watchdog.hpp"
#include "server/front/http_client.hpp"
#include "server/front/native_client.hpp"
#include "server/front/proxy_protocol.hpp"
#include "server/log/log.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

Protocol detect_protocol(rr::ByteSpan first_bytes) {
  constexpr std::string_view magic = "RRAC";
  constexpr std::uint8_t tls_handshake = 0x16;
  const auto text = rr::as_text(first_bytes.first(std::min<std::size_t>(first_bytes.size(), 4)));
  if (text.empty()) return Protocol::undecided;
  if (text == magic.substr(0, text.size())) return text.size() == 4 ? Protocol::robot_raconteur : Protocol::undecided;
  if (first_bytes[0] == tls_handshake) return Protocol::tls;
  // A method: capital letters, then a space ("GET ") or more letters ("POST", "OPTI").
  const auto space = text.find(' ');
  const auto letters = text.substr(0, space);
  const bool is_method = std::all_of(letters.begin(), letters.end(), [](char c) { return c >= 'A' && c <= 'Z'; });
  if (!is_method || (space != std::string_view::npos && space < 3)) return Protocol::unknown;
  return text.size() == 4 ? Protocol::http : Protocol::undecided;
}

namespace {

/// Reads what a proxy begins a connection with. Returns false where that is nothing that can be used.
rr::awaitable<bool> take_proxy_header(GatewayState& gateway, rr::ByteStream& stream, Connection& connection) {
  rr::Deadline limit(stream.executor(), [&stream] { stream.close(); });
  limit.arm(gateway.config().limits.header_timeout);
  std::array<std::uint8_t, largest_proxy_header> first{};
  std::size_t size = 0;
  for (;;) {
    const auto read = co_await stream.read_some(std::span(first).subspan(size));
    if (read.error || read.is_end()) co_return false;
    size += read.bytes;
    const auto header = parse_proxy_header({first.data(), size});
    if (!header) {
      gateway.reject(Rejection::proxy_header);
      gateway.log_refusal(LogLevel::warning, "connection of a trusted proxy closed", connection.client,
                          {{"peer", connection.client}, {"error", header.error().message}});
      co_return false;
    }
    if (header->size == 0) continue;
    stream.put_back({first.data() + header->size, size - header->size});
    if (!header->client) co_return true;
    connection.peer.endpoint = *header->client;
    connection.client = Connection::describe(connection.peer);
    if (connection.ticket.pass_to(header->client->address())) co_return true;
    gateway.reject(Rejection::too_many);
    gateway.log_refusal(LogLevel::warning, "connection refused: too many", connection.client,
                        {{"peer", connection.client}});
    co_return false;
  }
}

/// Enough to tell the protocol and to say in the log what was found; each connection that stays silent holds so much.
constexpr std::size_t first_look = 16;

/// Reads until the first bytes tell the protocol, and puts them back. Undecided: the connection ended before.
rr::awaitable<Protocol> look_at_first_bytes(GatewayState& gateway, rr::ByteStream& stream, const std::string& client) {
  rr::Deadline limit(stream.executor(), [&stream] { stream.close(); });
  limit.arm(gateway.config().limits.header_timeout);
  std::array<std::uint8_t, first_look> first{};
  std::size_t size = 0;
  auto protocol = Protocol::undecided;
  while (protocol == Protocol::undecided) {
    const auto read = co_await stream.read_some(std::span(first).subspan(size));
    if (read.error || read.is_end()) {
      if (size > 0 || !limit.is_armed())
        log(LogLevel::debug, "connection ended before its first bytes told the protocol", {{"peer", client}});
      co_return Protocol::undecided;
    }
    size += read.bytes;
    protocol = detect_protocol({first.data(), size});
  }
  if (protocol == Protocol::unknown)
    gateway.log_refusal(LogLevel::info, "connection closed: neither Robot Raconteur nor HTTP", client,
                        {{"peer", client}, {"found", rr::as_text({first.data(), size})}});
  stream.put_back({first.data(), size});
  co_return protocol;
}

/// Waits until the first record of TLS is there as a whole, which is the client's hello, and puts it back. OpenSSL
/// takes 50 kB for a handshake: only who has said something gets that, and a turn. Returns false where it does not
/// come.
rr::awaitable<bool> wait_for_hello(GatewayState& gateway, rr::ByteStream& stream) {
  constexpr std::size_t header_size = 5;                 // kind, version, length of what follows
  constexpr std::size_t chunk = 1024;                    // at most: nobody is believed how much comes
  constexpr std::size_t most = header_size + 16 * 1024;  // OpenSSL refuses a longer one
  rr::Deadline limit(stream.executor(), [&stream] { stream.close(); });
  limit.arm(gateway.config().limits.header_timeout);
  rr::Bytes record;
  std::size_t wanted = header_size;
  while (record.size() < wanted) {
    const auto size = record.size();
    const auto next = size + std::min(chunk, wanted - size);
    record.reserve(next);  // no more than that
    record.resize(next);
    const auto read = co_await stream.read_some(std::span(record).subspan(size));
    if (read.error || read.is_end()) co_return false;
    record.resize(size + read.bytes);
    if (record.size() >= header_size) wanted = std::min(most, header_size + (std::size_t{record[3]} << 8) + record[4]);
  }
  stream.put_back(record);
  co_return true;
}

/// The stream inside TLS; null where there is none.
rr::awaitable<std::unique_ptr<rr::ByteStream>> accept_https(GatewayState& gateway, Connection& connection,
                                                            std::unique_ptr<rr::ByteStream> stream) {
  const auto context = gateway.tls();
  if (!context) {
    gateway.reject(Rejection::unknown_protocol);
    gateway.log_refusal(LogLevel::info, "connection closed: TLS is not served here", connection.client,
                        {{"peer", connection.client}});
    co_return nullptr;
  }
  if (!co_await wait_for_hello(gateway, *stream)) {
    gateway.reject(Rejection::tls);
    gateway.log_refusal(LogLevel::info, "connection closed: it began TLS, and said no more", connection.client,
                        {{"peer", connection.client}});
    co_return nullptr;
  }
  HandshakeTurns::Turn turn(gateway.handshakes(), network_name(connection.peer.endpoint.address()), stream->executor());
  const auto stop = std::exchange(connection.stop, [&turn, below = stream.get()](const rr::EndReason&) {
    turn.cancel();
    below->close();
  });
  const auto& limits = gateway.config().limits;
  const bool has_turn = co_await turn.come(limits.header_timeout);
  connection.stop = stop;
  if (!has_turn) {
    gateway.reject(Rejection::tls);
    gateway.log_refusal(LogLevel::info, "connection closed: too many TLS handshakes are unfinished", connection.client,
                        {{"peer", connection.client}});
    co_return nullptr;
  }
  const rr::TlsPeerOptions any_client;
  auto tls = std::make_unique<rr::TlsStream>(std::move(stream), context, rr::TlsRole::server, any_client);
  const auto done = co_await tls->handshake(limits.header_timeout);
  if (!done) {
    gateway.reject(Rejection::tls);
    gateway.log_refusal(LogLevel::info, "connection closed", connection.client, {{"error", done.error().message}});
    co_return nullptr;
  }
  if (auto name = tls->client_name(); !name.empty()) {
    connection.identity.name = std::move(name);
    connection.identity.proof = Proof::certificate;
    connection.identity.ends = tls->client_certificate_end();
    connection.identity.credential = tls->client_certificate_marks();
  }
  co_return tls;
}

/// Who the client is by its certificate; without one, nobody.
void identify(GatewayState& gateway, Connection& connection) {
  auto& identity = connection.identity;
  identity.client = connection.client;
  identity.face = Face::native;
  const auto certified = identity.is_proven() ? gateway.access().renew(identity) : std::nullopt;
  identity = certified ? *certified : gateway.access().anonymous(connection.client, Face::native);
}

rr::awaitable<void> refuse_unknown_protocol(GatewayState& gateway, rr::ByteStream& stream) {
  gateway.reject(Rejection::unknown_protocol);
  // Native nodes answer with 404 too.
  const auto response = problem_response(404, "neither HTTP nor Robot Raconteur: nothing here speaks that");
  const auto text = format_response_head(response, false, 1) + *response.body;
  const auto slice = rr::as_bytes(text);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  co_await stream.write(slices);
  co_await stream.end(rr::no_reason);
}

}  // namespace

rr::awaitable<void> serve_connection(GatewayState& gateway, std::unique_ptr<rr::ByteStream> stream,
                                     boost::asio::ip::tcp::endpoint peer, boost::asio::ip::tcp::endpoint local,
                                     Admission::Ticket ticket) {
  rr::ByteStream* current = stream.get();
  Connection connection(Peer{std::move(peer), false}, std::move(local), std::move(ticket));
  connection.stop = [&current](const rr::EndReason&) { current->close(); };
  gateway.add(connection);
  const auto& proxy = gateway.config().proxy;
  if (proxy.has_proxy_protocol && proxy.trust.trusts(connection.peer.endpoint.address()))
    if (!co_await take_proxy_header(gateway, *stream, connection)) co_return;
  auto protocol = co_await look_at_first_bytes(gateway, *stream, connection.client);
  if (protocol == Protocol::tls) {
    // Closing what is below closes the TLS stream too, whose part it becomes: `current` holds through the handshake.
    stream = co_await accept_https(gateway, connection, std::move(stream));
    if (!stream) co_return;
    current = stream.get();
    connection.peer.is_encrypted = true;
    protocol = co_await look_at_first_bytes(gateway, *stream, connection.client);
  }

  connection.network = network_name(connection.peer.endpoint.address());
  identify(gateway, connection);
  rr::awaitable<void> continuation;
  switch (protocol) {
    case Protocol::robot_raconteur:
      if (gateway.is_stopping()) break;
      continuation = co_await serve_native_client(gateway, connection, std::move(stream));
      break;
    case Protocol::http:
      continuation = co_await serve_http_client(gateway, connection, std::move(stream));
      break;
    case Protocol::unknown:
      co_await refuse_unknown_protocol(gateway, *current);
      break;
    default:
      break;
  }
  if (continuation.valid()) co_await std::move(continuation);
}

}  // namespace rrgate
