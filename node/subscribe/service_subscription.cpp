#include "node/subscribe/service_subscription.hpp"

#include <set>
#include <stdexcept>

#include "core/session/url.hpp"

namespace rr {

namespace {

std::string one_service_of(const std::vector<std::string>& urls) {
  std::set<std::string> services;
  std::string found;
  for (const auto& text : urls) {
    const auto url = parse_url(text);
    if (!url) throw std::invalid_argument("subscribe_service: " + url.error().message);
    if (services.insert(url->service).second) found += (found.empty() ? "" : ", ") + quote(url->service);
  }
  if (services.size() == 1) return *services.begin();
  throw std::invalid_argument("subscribe_service: found " + (found.empty() ? "no URL" : "the services " + found) +
                              ", expected URLs of one service");
}

void check_path(const std::string& path) {
  if (path != "*" && !path.starts_with("*."))
    throw std::invalid_argument("path " + quote(path) + " of a subscription: expected \"*\" or \"*.OBJREF...\"");
}

}  // namespace

void ServiceSubscription::on_connected(std::function<void(const AsyncObject&)> handler) {
  if (core_->is_closed()) return;
  core_->connected = std::move(handler);
  const auto core = core_;  // the handler may let go of this
  const auto connected = core->connected;
  for (const auto& [id, client] : core->clients())
    if (connected && !core->is_closed()) connected(client);
}

WireSubscription ServiceSubscription::wire(std::string member, const MemberSubscriptionOptions& options) const {
  check_path(options.path);
  const auto follower = std::make_shared<detail::WireFollower>(core_, std::move(member), options.path);
  follower->start();
  return WireSubscription(follower);
}

PipeSubscription ServiceSubscription::pipe(std::string member, const MemberSubscriptionOptions& options) const {
  check_path(options.path);
  const auto follower = std::make_shared<detail::PipeFollower>(core_, std::move(member), options.path,
                                                               options.packet_limit, options.byte_limit);
  follower->start();
  return PipeSubscription(follower);
}

ServiceSubscription subscribe_service(boost::asio::io_context& io, std::vector<std::string> urls,
                                      SubscriptionOptions options) {
  auto service = one_service_of(urls);
  auto core = std::make_shared<detail::SubscriptionCore>(io, std::move(options));
  ServiceSubscription subscription(core);
  core->offer({{NodeId{}, std::move(service)}, std::move(urls), {}, {}});
  return subscription;
}

ServiceSubscription subscribe_service(boost::asio::io_context& io, std::string url, SubscriptionOptions options) {
  std::vector<std::string> urls;
  urls.push_back(std::move(url));
  return subscribe_service(io, std::move(urls), std::move(options));
}

}  // namespace rr
