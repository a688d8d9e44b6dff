#include "server/front/page_device.hpp"

#include "node/http/upgrade.hpp"
#include "node/transport/websocket.hpp"
#include "node/transport/wrapped_stream.hpp"
#include "server/access/standing.hpp"
#include "server/front/session_end.hpp"
#include "server/json/json.hpp"
#include "server/log/log.hpp"
#include "server/socket/message_socket.hpp"

namespace rrgate {

namespace {

constexpr std::string_view prefix = "/serve/";
/// A page says nothing on the socket by which it is told.
constexpr std::size_t largest_message = 1024;

std::string_view name_of(const Request& request) {
  return request.path().substr(prefix.size());
}

/// The stream of one connection to a page. It is used by whoever has dialed, and can be closed from here.
class LentStream final : public rr::WrappedStream {
 public:
  LentStream(std::unique_ptr<rr::ByteStream> inner, std::function<void()> returned)
      : WrappedStream(std::move(inner)), returned_(std::move(returned)) {}
  ~LentStream() override { returned_(); }

 private:
  std::function<void()> returned_;
};

/// 101. `request` is not needed behind it.
rr::awaitable<bool> accept(GatewayState& gateway, rr::ByteStream& stream, const Request& request, rr::ByteSpan unread) {
  gateway.metrics().respond(101);
  const auto text = format_upgrade_response(request, page_subprotocol(request));
  const auto slice = rr::as_bytes(text);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  const auto failed = co_await stream.write(slices);
  stream.put_back(unread);
  co_return !failed;
}

/// Until whoever has dialed has had enough of it.
rr::awaitable<void> serve_connection_of_page(Connection& connection, std::unique_ptr<rr::ByteStream> stream,
                                             std::shared_ptr<PageLink> link, std::string key) {
  const auto executor = stream->executor();
  SessionEnd end(executor);
  auto lent = std::make_unique<LentStream>(std::move(stream), [&connection, &end] {
    connection.stop = [](const rr::EndReason&) {};
    connection.is_good = nullptr;
    end.reach();
  });
  connection.stop = [stream = lent.get()](const rr::EndReason&) { stream->close(); };
  connection.is_good = [link] { return !link->is_closed(); };
  link->take(key, std::move(lent));
  co_await end.wait();
}

/// What keeps a page from being a device of this name.
rr::Result<> may_serve(GatewayState& gateway, const Identity& who, const std::string& name) {
  const auto& config = gateway.config().serve;
  const auto refusal = [](std::string text) {
    return rr::make_error(rr::ErrorCode::invalid_operation, std::move(text));
  };
  if (!config.is_enabled)
    return refusal("pages can't be devices here; the configuration of the gateway has no \"serve\"");
  if (auto allowed = gateway.access().check(who, {.device = name, .verb = Verb::serve}); !allowed) {
    gateway.reject(allowed.error());
    return allowed;
  }
  if (const auto wrong = check_device_name(name); !wrong.empty()) return refusal("name of a device: " + wrong);
  if (gateway.devices().find(name)) return refusal("there is a device " + rr::quote(name) + " already");
  if (gateway.pages().size() >= config.max_devices)
    return refusal("as many pages are devices as may be (" + std::to_string(config.max_devices) + ")");
  return {};
}

/// A page that is a device, from the beginning to the end.
class PageDevice {
 public:
  PageDevice(GatewayState& gateway, Connection& connection, std::shared_ptr<MessageSocket> socket, std::string name)
      : gateway_(gateway), name_(std::move(name)), socket_(std::move(socket)) {
    const auto timeout = gateway.config().timeouts.connect;
    PageLink::Page page{.ask =
                            [outbox = socket_->outbox()](const std::string& key) {
                              outbox->add(nlohmann::json{{"open", key}}.dump());
                            },
                        .silent =
                            [socket = socket_] {
                              socket->stop({1008, "the page opened no connection in time"});
                            }};
    link_ = std::make_shared<PageLink>(socket_->outbox()->news().get_executor(), timeout, std::move(page));
    gateway.pages()[name_] = link_;
    DeviceConfig config;
    config.name = name_;
    config.url.scheme = "page";
    config.url.host = name_;
    config.is_served = true;
    config.mode = gateway.config().serve.mode;
    device_ = gateway.devices().add(std::move(config), nullptr, link_).shared_from_this();
    socket_->outbox()->add(nlohmann::json{{"served", name_}}.dump());
    log(LogLevel::info, "page is a device", {{"device", name_}, {"peer", connection.client}});
  }
  PageDevice(const PageDevice&) = delete;
  PageDevice& operator=(const PageDevice&) = delete;
  ~PageDevice() {
    gateway_.pages().erase(name_);
    link_->close();
    gateway_.devices().remove(*device_);
  }

  /// Whether the configuration leaves it its place.
  bool is_wanted() const { return gateway_.config().serve.is_enabled && gateway_.devices().has(*device_); }

 private:
  GatewayState& gateway_;
  std::string name_;
  std::shared_ptr<MessageSocket> socket_;
  std::shared_ptr<PageLink> link_;
  std::shared_ptr<Device> device_;
};

rr::awaitable<void> serve_page(GatewayState& gateway, Connection& connection, std::unique_ptr<rr::ByteStream> stream,
                               Identity who, std::string name) {
  const auto socket =
      std::make_shared<MessageSocket>(std::move(stream), largest_message, gateway.memory().charge(connection.network));
  const auto standing = std::make_shared<Standing>(gateway.access(), who);
  const AccessRequest wanted{.device = name, .verb = Verb::serve};
  const auto allowed = may_serve(gateway, who, name);
  if (const auto entry = allowed ? gateway.access().begin(who, wanted) : nullptr) entry->finish({});
  std::optional<PageDevice> device;
  if (allowed) {
    device.emplace(gateway, connection, socket, name);
  } else {
    gateway.log_refusal(LogLevel::info, "page refused", connection.client,
                        {{"peer", connection.client}, {"error", allowed.error().message}});
    socket->stop({1008, allowed.error().message});
  }
  connection.stop = [socket](rr::EndReason reason) { socket->stop(std::move(reason)); };
  connection.is_good = [&, standing] {
    return !device || (device->is_wanted() && standing->is_good() &&
                       gateway.access().state().rules.check(standing->identity(), wanted).has_value());
  };
  // g++ 12 destroys functions twice where they are made within an expression that waits.
  std::function<rr::awaitable<void>(const std::string&)> take = [socket](const std::string&) -> rr::awaitable<void> {
    socket->stop({1008, "a page has nothing to say here"});
    co_return;
  };
  // The device is gone as soon as its page is, not once the socket is closed.
  std::function<void()> stopped = [&device] { device.reset(); };
  const auto reason = co_await socket->run(std::move(take), std::move(stopped));
  device.reset();
  connection.is_good = nullptr;
  connection.stop = [](const rr::EndReason&) {};
  if (allowed)
    log(LogLevel::info, "page is no device any more",
        {{"device", name}, {"peer", connection.client}, {"reason", reason}});
}

}  // namespace

bool is_page_device(const Request& request) {
  return request.path().starts_with(prefix);
}

bool is_awaited_page(GatewayState& gateway, const Request& request) {
  if (!is_page_device(request)) return false;
  const auto key = rr::query_value(request.query(), "key");
  const auto link = gateway.pages().find(name_of(request));
  return key && link != gateway.pages().end() && link->second->is_awaited(*key);
}

std::string_view page_subprotocol(const Request& request) {
  return rr::query_value(request.query(), "key") ? rr::websocket_subprotocol : serve_subprotocol;
}

rr::awaitable<rr::awaitable<void>> accept_page_device(GatewayState& gateway, Connection& connection,
                                                      std::unique_ptr<rr::ByteStream> stream, const Request& request,
                                                      rr::ByteSpan unread) {
  using Continuation = rr::awaitable<void>;
  if (!co_await accept(gateway, *stream, request, unread)) co_return Continuation();
  auto key = rr::query_value(request.query(), "key");
  std::string name(name_of(request));
  if (!key) co_return serve_page(gateway, connection, std::move(stream), request.identity, std::move(name));
  auto socket = std::make_unique<rr::WebSocketStream>(std::move(stream), rr::WebSocketRole::server, true);
  const auto link = gateway.pages().find(name);
  if (link == gateway.pages().end() || !link->second->is_awaited(*key)) {
    const rr::EndReason reason{1008, "nobody has asked for this connection, or waits for it any more"};
    co_await socket->end(reason);
    co_return Continuation();
  }
  co_return serve_connection_of_page(connection, std::move(socket), link->second, std::move(*key));
}

}  // namespace rrgate
