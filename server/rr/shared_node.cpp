#include "server/rr/shared_node.hpp"

#include "core/support/random.hpp"
#include "server/log/log.hpp"

namespace rrgate {

std::shared_ptr<SharedClient> SharedNode::add(std::unique_ptr<rr::ByteStream> stream, SharedArrival arrival,
                                              std::function<void()> ended) {
  rr::ServiceSessionOptions options;
  options.connection.max_message_size = config_.limits.max_message_size;
  options.connection.max_queued_bytes = config_.limits.client_queue_bytes + config_.limits.max_message_size;
  options.max_pipe_queued_bytes = config_.limits.client_queue_bytes;
  options.connection.is_encrypted = arrival.is_encrypted;
  options.base_url = std::move(arrival.base_url);
  options.admit = std::move(arrival.admit);
  options.enter = std::move(arrival.enter);
  options.why_missing = std::move(arrival.why_missing);
  const auto key = rr::format_node_id(rr::random_node_id(), rr::NodeIdFormat::dashes);
  options.attributes.items.emplace_back(std::string(session_attribute), key);
  if (const auto verified = stream->verified_peer(); !verified.is_any()) options.verified_node_id = verified;
  auto client = std::make_shared<SharedClient>(*this, std::move(options), std::move(stream), std::move(arrival.from),
                                               std::move(arrival.memory), std::move(arrival.lock_rights), key);
  clients_.emplace(client.get(), client);
  ended_.emplace(client.get(), std::move(ended));
  client->start();
  return client;
}

void SharedNode::close() {
  const auto clients = clients_;  // each removes itself
  for (const auto& [key, client] : clients) {
    client->close_service();
    client->close(rr::make_error(rr::ErrorCode::connection_error, "the gateway stops, or shares the device no more"));
  }
}

void SharedNode::publish(const std::shared_ptr<rr::HostedService>& hosted, SharedService& service) {
  if (const auto known = services_.find(hosted->name());
      known != services_.end() && known->second.first == hosted.get())
    return;
  if (const auto added = directory_.add(hosted); !added) {
    if (!refused_.insert(hosted.get()).second) return;
    log(LogLevel::info, "a service is not offered on the gateway's own node: its name is taken there",
        {{"service", hosted->name()}, {"device", service.device()->config().name}});
    return;
  }
  refused_.erase(hosted.get());
  services_[hosted->name()] = {hosted.get(), service.weak_from_this()};
}

void SharedNode::withdraw(const rr::HostedService& hosted) {
  refused_.erase(&hosted);
  const auto found = services_.find(hosted.name());
  if (found == services_.end() || found->second.first != &hosted) return;
  services_.erase(found);
  directory_.remove(hosted.name());
}

std::string SharedNode::device_of(std::string_view service) const {
  const auto found = find_service(service);
  return found ? found->device()->config().name : std::string();
}

std::shared_ptr<SharedService> SharedNode::find_service(std::string_view name) const {
  const auto found = services_.find(name);
  return found == services_.end() ? nullptr : found->second.second.lock();
}

void SharedNode::client_ended(SharedClient& client) {
  const auto left = clients_.extract(&client);  // it is destroyed when this returns, at the earliest
  const auto ended = ended_.extract(&client);
  if (ended && ended.mapped()) ended.mapped()();
}

}  // namespace rrgate
