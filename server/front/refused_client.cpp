#include "server/front/refused_client.hpp"

#include <functional>
#include <utility>

#include "core/session/service/service_session.hpp"
#include "node/driver/stream_driver.hpp"
#include "server/front/session_end.hpp"

namespace rrgate {

namespace {

/// A node without services.
struct EmptyNode {
  explicit EmptyNode(rr::NodeIdentity identity) : directory(std::move(identity)) {}
  rr::ServiceDirectory directory;
};

class RefusedClient final : private EmptyNode, public rr::SessionDriver<rr::ServiceSession> {
 public:
  RefusedClient(rr::NodeIdentity identity, rr::ServiceSessionOptions options, std::unique_ptr<rr::ByteStream> stream,
                std::function<void()> ended)
      : EmptyNode(std::move(identity)),
        SessionDriver(std::move(stream), directory, std::move(options), rr::read_clocks()),
        ended_(std::move(ended)) {}

 private:
  bool handle_event(rr::Now) override { return session_.poll_event().has_value(); }
  void ended() override { ended_(); }

  std::function<void()> ended_;
};

}  // namespace

rr::NodeIdentity relayed_identity(GatewayState& gateway, const Device& device) {
  if (const auto& known = device.identity()) return {known->node_id, known->node_name};
  const auto& url = device.config().url;
  return {url.node_id.value_or(gateway.node_id()), url.node_name};
}

rr::NodeIdentity unknown_identity(GatewayState& gateway, const rr::NodeId& asked_id, std::string_view asked_name) {
  return {asked_id.is_any() ? gateway.node_id() : asked_id, std::string(asked_name)};
}

rr::awaitable<void> refuse_in_session(GatewayState& gateway, Connection& connection, rr::NodeIdentity self,
                                      std::unique_ptr<rr::ByteStream> client, rr::Error refusal) {
  rr::ServiceSessionOptions options;
  options.connection.max_message_size = gateway.config().limits.max_message_size;
  options.connection.is_encrypted = connection.peer.is_encrypted;
  options.connection.handshake_timeout = options.connect_timeout = gateway.config().limits.header_timeout;
  options.refusal = std::move(refusal);
  SessionEnd end(client->executor());
  const auto session =
      std::make_shared<RefusedClient>(std::move(self), std::move(options), std::move(client), [&end] { end.reach(); });
  connection.stop = [session](const rr::EndReason& reason) {
    session->close(rr::make_error(rr::ErrorCode::connection_error, reason.text));
  };
  session->start();
  co_await end.wait();
  connection.stop = [](const rr::EndReason&) {};
}

}  // namespace rrgate
