#include "server/rr/shared_service.hpp"

#include <map>

#include "server/log/log.hpp"
#include "server/rr/shared_client.hpp"

namespace rrgate {

namespace {

/// Stands for the device, which judges logins itself: see SharedClient.
class JudgedByDevice final : public rr::Authenticator {
 public:
  rr::Result<rr::AuthenticatedUser> authenticate(const rr::LoginAttempt&) const override {
    return rr::make_error(rr::ErrorCode::authentication_error, "Authentication Failed");
  }
};

/// What clients may want to know, because some things differ from a session of their own.
rr::MapString with_mode(rr::MapString attributes) {
  constexpr std::string_view mode = "rrgate.mode";
  // The second is that of the session with the device, where this is another gateway.
  std::erase_if(attributes.items,
                [mode](const auto& item) { return item.first == mode || item.first == session_attribute; });
  attributes.items.emplace_back(std::string(mode), rr::Value("shared"));
  return attributes;
}

void add_to(Traffic& traffic, const rr::ServiceSession& session) {
  const auto& stats = session.connection().stats();
  traffic.to_device.bytes += stats.bytes_received;
  traffic.to_device.messages += stats.messages_received;
  traffic.to_clients.bytes += stats.bytes_sent;
  traffic.to_clients.messages += stats.messages_sent;
  traffic.ledgers.add(session.total_ledgers());
}

}  // namespace

SharedService::SharedService(std::shared_ptr<Device> device, std::string name, std::vector<ServiceBoard*> boards)
    : device_(std::move(device)),
      name_(std::move(name)),
      boards_(std::move(boards)),
      upstream_(std::make_shared<Upstream>(device_, name_, device_->config().login)),
      for_device_(std::make_shared<JudgedByDevice>()) {
  device_->share(name_, upstream_);
}

std::shared_ptr<Upstream> SharedService::make_own_upstream(UpstreamLogin login) const {
  auto upstream = std::make_shared<Upstream>(device_, name_, std::move(login), UpstreamUse::one_client);
  forget_released(*upstream);
  return upstream;
}

/// Objects that one session finds to be others now are not offered as what they were, whoever had found them.
void SharedService::forget_released(Upstream& upstream) const {
  upstream.on_released([weak = weak_from_this()](const std::string& path) {
    if (const auto self = weak.lock(); self && self->hosted_) self->hosted_->forget_path(path);
  });
}

void SharedService::start(std::chrono::milliseconds rests_after) {
  upstream_->rest_unused(rests_after);
  forget_released(*upstream_);
  upstream_->on_types_replaced([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->publish_anew();
  });
  upstream_->keep_open([weak = weak_from_this()] {
    const auto self = weak.lock();
    return self ? self->publish() : rr::Result<>();
  });
}

void SharedService::stop() {
  upstream_->end_leases("the gateway stops, or shares the device no more");
  withdraw();
  upstream_->close();
}

void SharedService::set_listed(bool is_listed) {
  upstream_->close_unused(!is_listed);
  if (!is_listed)
    withdraw();
  else if (!hosted_ && upstream_->is_open())
    (void)publish();  // what can't be offered is told when the session is opened anew
  else if (!hosted_)
    upstream_->retry_now();
}

/// Offers the service as it is now. Where it is as it was, clients notice nothing.
rr::Result<> SharedService::publish() {
  if (!upstream_->is_open()) return upstream_->lost_error();  // again, at once
  const auto& session = upstream_->connection()->session();
  const auto& root_type = session.object_type(name_)->qualified_name;
  const auto attributes = with_mode(session.attributes());
  if (hosted_) {
    if (types_ == upstream_->types() && hosted_->policy().require_valid_user == upstream_->requires_user() &&
        hosted_->root_type_name() == root_type && hosted_->attributes() == rr::Value(attributes))
      return {};
    log(LogLevel::warning, "a shared service has changed: its clients have to connect anew",
        {{"device", device_->config().name}, {"service", name_}, {"clients", clients_.size()}});
    withdraw();
  }
  types_ = upstream_->types();
  const auto root = std::make_shared<SharedObject>(name_, root_type);
  auto hosted =
      rr::HostedService::make(name_, root, types_, attributes, rr::unimported_definitions(*types_, root_type));
  if (!hosted) return hosted.error();
  hosted_ = std::move(*hosted);
  hosted_->set_remote();
  renew_judge();
  offer_again();
  return {};
}

/// Objects behind a varobject bring definitions that nobody has asked for when the session was opened.
void SharedService::publish_anew() {
  if (!hosted_ || !upstream_->is_open()) return;  // else it is published when the session is opened, or never
  if (!publish()) upstream_->break_off();         // what can't be offered is told when the session is opened anew
}

void SharedService::offer_again() {
  if (!hosted_) return;
  for (auto* board : boards_) board->publish(hosted_, *this);
}

void SharedService::renew_judge() {
  if (!hosted_) return;
  rr::SecurityPolicy policy;
  policy.authenticator = boards_.front()->authenticator();
  if (!policy.authenticator) policy.authenticator = for_device_;
  policy.require_valid_user = upstream_->requires_user();
  hosted_->set_policy(policy);
}

void SharedService::withdraw() {
  const auto hosted = std::exchange(hosted_, nullptr);
  if (!hosted) return;
  for (auto* board : boards_) board->withdraw(*hosted);
  // Each removes itself; what one gives back may go to another, which may be lost by that.
  std::map<SharedClient*, std::shared_ptr<rr::StreamDriver>> clients;
  for (auto* client : clients_) clients.emplace(client, client->shared_from_this());
  for (const auto& [client, kept] : clients)
    if (clients_.contains(client)) client->close_service();
}

/// While it has clients, also such as use sessions of their own, the gateway hears what becomes of the service.
void SharedService::add(SharedClient& client) {
  clients_.insert(&client);
  upstream_->hold(true);
}

void SharedService::remove(SharedClient& client) {
  if (clients_.erase(&client) == 0) return;
  add_to(device_->traffic(), client.session());
  if (clients_.empty()) upstream_->hold(false);
}

void SharedService::add_traffic(Traffic& traffic) const {
  for (const auto* client : clients_) {
    add_to(traffic, client->session());
    traffic.to_clients.waiting += client->session().queued_bytes();
  }
}

void SharedService::find_object(Upstream& by, const std::string& path, std::function<void(rr::Result<>)> done) {
  by.find_object(path, [weak = weak_from_this(), finder = by.weak_from_this(), path,
                        done = std::move(done)](const rr::Result<rr::Value>& found) {
    const auto self = weak.lock();
    const auto found_by = finder.lock();
    if (!self || !self->hosted_) return;  // whoever asked has been told that the service is gone
    if (!found) return done(found.error());
    const std::string type(found->to_text().value());
    if (found_by && found_by != self->upstream_) {
      self->upstream_->take_over_definitions(*found_by->types());
      self->upstream_->note_object(path, type);
    }
    done(self->hosted_->add_object(path, std::make_shared<SharedObject>(path, type)));
  });
}

}  // namespace rrgate
