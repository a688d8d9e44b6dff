#include "server/gateway/probe.hpp"

#include "core/session/client_session.hpp"
#include "core/session/service_index.hpp"
#include "core/support/random.hpp"
#include "server/node/clocks.hpp"
#include "server/transport/watchdog.hpp"

namespace rrgate {

namespace {

rr::ClientOptions index_options(const rr::ConnectionUrl& url, std::chrono::milliseconds timeout) {
  rr::ClientOptions options;
  options.connection.self = {rr::random_node_id(), "rrgate"};
  options.connection.target = {url.node_id.value_or(rr::NodeId{}), url.node_name};
  options.connection.handshake_timeout = timeout;
  options.service = rr::service_index_name;
  return options;
}

std::string text_of(const rr::Structure& info, std::string_view field) {
  const auto* value = info.find(field);
  const auto text = value ? value->to_text() : rr::Result<std::string_view>(std::string_view());
  return text ? std::string(*text) : std::string();
}

/// The services of a node but for the index itself, which every node has.
std::vector<DeviceService> read_services(const rr::Value& answer) {
  std::vector<DeviceService> services;
  if (const auto* infos = answer.get_if<rr::MapInt32>())
    for (const auto& [key, info] : infos->items)
      if (const auto* fields = info.get_if<rr::Structure>();
          fields && text_of(*fields, "Name") != rr::service_index_name)
        services.push_back({text_of(*fields, "Name"), text_of(*fields, "RootObjectType")});
  return services;
}

rr::Error about_device(rr::Error error) {
  error.message = "device: " + error.message;
  return error;
}

rr::Error lost(std::string what) {
  return {rr::ErrorCode::connection_error, "device: " + std::move(what)};
}

}  // namespace

rr::awaitable<rr::Result<ProbeResult>> probe(rr::ConnectionUrl url, rr::DialOptions options) {
  auto dialed = co_await rr::dial(url, options);
  if (!dialed) co_return dialed.error();
  rr::ByteStream& stream = **dialed;
  rr::Deadline limit(stream.executor(), [&stream] { stream.close(); });
  limit.arm(options.timeout);

  rr::ClientSession session(index_options(url, options.timeout), rr::read_clocks());
  ProbeResult result;
  std::optional<rr::Error> failure;
  rr::Bytes buffer(16 * 1024);
  for (;;) {
    while (auto event = session.poll_event()) {
      if (std::get_if<rr::Connected>(&*event)) {
        const auto& peer = session.connection().peer();
        result = {peer.id, peer.name, {}};
        session.call_function(rr::service_index_name, "GetLocalNodeServices", {}, rr::read_clocks());
      } else if (auto* completed = std::get_if<rr::Completed>(&*event)) {
        if (completed->result)
          result.services = read_services(*completed->result);
        else
          failure = about_device(completed->result.error());
        session.disconnect(rr::read_clocks());
      } else if (auto* closed = std::get_if<rr::SessionClosed>(&*event)) {
        if (failure) co_return *failure;
        const auto& peer = session.connection().peer();
        // A small device may have no service index: it is there all the same, and said so in its handshake.
        if (closed->reason.code == rr::ErrorCode::service_not_found) result = {peer.id, peer.name, {}};
        if (result.node_id.is_any()) co_return about_device(std::move(closed->reason));
        co_return result;
      }
    }
    if (const auto slices = session.poll_transmit(); !slices.empty()) {
      std::size_t size = 0;
      for (const auto& slice : slices) size += slice.size();
      const auto error = co_await stream.write(slices);
      if (error) session.handle_closed(lost(error.message()), rr::read_clocks());
      session.handle_transmitted(size, rr::read_clocks());
      continue;
    }
    const auto read = co_await stream.read_some(buffer);
    if (!limit.is_armed())
      session.handle_closed(lost("no answer within " + std::to_string(options.timeout.count()) + " ms"),
                            rr::read_clocks());
    else if (read.error)
      session.handle_closed(lost(read.error.message()), rr::read_clocks());
    else if (read.is_end())
      session.handle_closed(lost("closed the connection without an answer"), rr::read_clocks());
    else
      session.handle_bytes(rr::ByteSpan(buffer.data(), read.bytes), rr::read_clocks());
  }
}

}  // namespace rrgate
