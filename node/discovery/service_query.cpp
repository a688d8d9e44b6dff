#include "node/discovery/service_query.hpp"

#include <algorithm>

#include "core/session/client/client_session.hpp"
#include "core/session/service/service_index.hpp"
#include "core/support/random.hpp"
#include "node/driver/clocks.hpp"
#include "node/transport/race.hpp"
#include "node/transport/watchdog.hpp"

namespace rr {

namespace asio = boost::asio;

std::string url_of_service(ConnectionUrl url, const NodeIdentity& node, std::string_view service) {
  url.query = "nodeid=" + format_node_id(node.id, NodeIdFormat::dashes) + "&service=" + percent_encode(service);
  return format_url(url);
}

namespace {

constexpr std::size_t max_candidates = 8;

ClientOptions index_options(const ConnectionUrl& url, const ServiceQueryOptions& options) {
  ClientOptions out;
  out.connection.self = {options.self_id.is_any() ? random_node_id() : options.self_id, options.self_name};
  out.connection.target = {url.node_id.value_or(NodeId{}), url.node_name};
  out.connection.handshake_timeout = options.dial.timeout;
  out.connection.max_message_size = options.max_answer_bytes;
  out.service = service_index_name;
  out.read_definitions = options.definitions;
  return out;
}

std::string text_of(const Structure& info, std::string_view field) {
  const auto* value = info.find(field);
  const auto text = value ? value->to_text() : Result<std::string_view>(std::string_view());
  return text ? std::string(*text) : std::string();
}

/// Nodes write bases as the definition does: those of the root object's own definition without its name.
std::string qualified(std::string_view base, std::string_view root_type) {
  const auto definition = root_type.substr(0, root_type.rfind('.') + 1);
  return (base.find('.') == std::string_view::npos ? std::string(definition) : std::string()) + std::string(base);
}

ServiceInfo read_service(const Structure& info, const NodeIdentity& node, const ConnectionUrl& url) {
  ServiceInfo out;
  out.node = node;
  out.name = text_of(info, "Name");
  out.root_object_type = text_of(info, "RootObjectType");
  out.connection_url = url_of_service(url, node, out.name);
  if (const auto* field = info.find("RootObjectImplements"))
    if (const auto* names = field->get_if<MapInt32>())
      for (const auto& [key, name] : names->items)
        if (const auto text = name.to_text())
          out.root_object_implements.push_back(qualified(*text, out.root_object_type));
  if (const auto* field = info.find("Attributes"))
    if (const auto* attributes = field->get_if<MapString>()) out.attributes = *attributes;
  return out;
}

std::vector<ServiceInfo> read_services(const Value& answer, const NodeIdentity& node, const ConnectionUrl& url) {
  std::vector<ServiceInfo> services;
  if (const auto* infos = answer.get_if<MapInt32>())
    for (const auto& [key, info] : infos->items)
      if (const auto* fields = info.get_if<Structure>(); fields && text_of(*fields, "Name") != service_index_name)
        services.push_back(read_service(*fields, node, url));
  return services;
}

Error about_device(Error error) {
  error.message = "device: " + error.message;
  return error;
}

Error lost(std::string what) {
  return {ErrorCode::connection_error, std::move(what)};
}

Error closed_by(const ByteStream& peer) {
  const auto reason = peer.peer_reason();
  return lost("closed the connection without an answer" + (reason.empty() ? std::string() : ": " + reason));
}

}  // namespace

bool ServiceInfo::implements(std::string_view type) const {
  return root_object_type == type ||
         std::find(root_object_implements.begin(), root_object_implements.end(), type) != root_object_implements.end();
}

awaitable<Result<NodeServices>> query_services(ConnectionUrl url, ServiceQueryOptions options) {
  auto dialed = co_await dial(url, options.dial);
  if (!dialed) co_return dialed.error();
  ByteStream& stream = **dialed;
  Deadline limit(stream.executor(), [&stream] { stream.close(); });
  limit.arm(options.dial.timeout);

  auto session_options = index_options(url, options);
  session_options.connection.known_peer = stream.verified_peer();
  ClientSession session(std::move(session_options), read_clocks());
  NodeServices result;
  std::optional<Error> failure;
  Bytes buffer(16 * 1024);
  for (;;) {
    while (auto event = session.poll_event()) {
      if (std::get_if<Connected>(&*event)) {
        result.node = session.connection().peer();
        session.call_function(service_index_name, "GetLocalNodeServices", {}, read_clocks());
      } else if (auto* completed = std::get_if<Completed>(&*event)) {
        if (completed->result)
          result.services = read_services(*completed->result, result.node, url);
        else
          failure = about_device(completed->result.error());
        session.disconnect(read_clocks());
      } else if (auto* closed = std::get_if<SessionClosed>(&*event)) {
        if (failure) co_return *failure;
        // A small device may have no service index: it is there all the same, and said so in its handshake.
        if (closed->reason.code == ErrorCode::service_not_found) result = {session.connection().peer(), {}};
        if (result.node.id.is_any()) co_return about_device(std::move(closed->reason));
        co_return result;
      }
    }
    if (const auto slices = session.poll_transmit(); !slices.empty()) {
      std::size_t size = 0;
      for (const auto& slice : slices) size += slice.size();
      const auto error = co_await stream.write(slices);
      if (error) session.handle_closed(lost(error.message()), read_clocks());
      session.handle_transmitted(size, read_clocks());
      continue;
    }
    const auto read = co_await stream.read_some(buffer);
    if (!limit.is_armed())
      session.handle_closed(lost("no answer within " + std::to_string(options.dial.timeout.count()) + " ms"),
                            read_clocks());
    else if (read.error)
      session.handle_closed(lost(read.error.message()), read_clocks());
    else if (read.is_end())
      session.handle_closed(closed_by(stream), read_clocks());
    else
      session.handle_bytes(ByteSpan(buffer.data(), read.bytes), read_clocks());
  }
}

std::vector<ConnectionUrl> candidate_urls(const NodeDiscoveryInfo& node, const std::vector<std::string>& schemes) {
  auto heard = node.urls;
  std::stable_sort(heard.begin(), heard.end(),
                   [](const auto& a, const auto& b) { return a.last_announce > b.last_announce; });
  std::vector<ConnectionUrl> out;
  for (const auto& each : heard) {
    auto url = parse_url(each.url);
    if (!url || !can_dial(url->scheme) || out.size() == max_candidates) continue;
    if (!schemes.empty() && std::find(schemes.begin(), schemes.end(), url->scheme) == schemes.end()) continue;
    url->node_id = node.node_id;
    url->node_name = node.node_name;
    out.push_back(std::move(*url));
  }
  return out;
}

awaitable<Result<NodeServices>> query_node(std::vector<ConnectionUrl> urls, ServiceQueryOptions options) {
  std::vector<Runner<NodeServices>> runners;
  for (auto& url : urls) {
    Runner<NodeServices> runner;
    runner.name = format_url(url);
    runner.run = [url = std::move(url), options] { return query_services(url, options); };
    runners.push_back(std::move(runner));
  }
  const auto nothing = make_error(ErrorCode::connection_error, "node: no URL of it can be dialed");
  co_return co_await race(std::move(runners), candidate_stagger, nothing);
}

}  // namespace rr
