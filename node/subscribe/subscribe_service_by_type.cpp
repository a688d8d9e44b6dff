#include "node/subscribe/subscribe_service_by_type.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <set>

#include "core/discovery/service_refresh.hpp"
#include "node/driver/clocks.hpp"
#include "node/driver/post_cancel.hpp"

namespace rr {

namespace asio = boost::asio;
using detail::SubscriptionCore;

namespace {

constexpr std::size_t max_open_queries = 8;

/// Where a scheme comes in the order of candidates.
std::size_t rank(std::string_view scheme) {
  constexpr std::array<std::string_view, 6> order{"rr+intra", "rr+local", "rr+pci", "rr+usb", "rrs+tcp", "rr+tcp"};
  return static_cast<std::size_t>(std::find(order.begin(), order.end(), scheme) - order.begin());
}

/// Follows a Discovery, asks nodes for their services, and tells the subscription which are wanted. Lives as long as
/// that is not closed.
class TypeFollower : public std::enable_shared_from_this<TypeFollower> {
 public:
  TypeFollower(Discovery& discovery, std::vector<std::string> types, ServiceSubscriptionFilter filter,
               std::shared_ptr<SubscriptionCore> core)
      : discovery_(discovery),
        types_(std::move(types)),
        filter_(std::move(filter)),
        core_(std::move(core)),
        timer_(discovery.io_context()) {}

  void start() {
    watch_ = discovery_.watch([weak = weak_from_this()](const NodeEvent& event) {
      if (const auto self = weak.lock()) self->handle(event);
    });
    core_->on_ended([self = shared_from_this()] { self->end(); });
    core_->on_freed([weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->review_all();
    });
    discovery_.refresh();
  }

 private:
  struct FoundNode {
    NodeDiscoveryInfo info;
    ServiceRefresh refresh;
    std::vector<ServiceInfo> services;  ///< that are wanted, as the node said last
    std::set<ServiceSubscriptionClientId> offered;
  };

  void end() {
    discovery_.unwatch(watch_);
    timer_.cancel();
    nodes_.clear();
    for (const auto& query : queries_) post_cancel(discovery_.io_context().get_executor(), query);
    core_.reset();
  }

  void handle(const NodeEvent& event) {
    const auto& info = event.node;
    if (event.kind == NodeEvent::Kind::lost || !filter_.takes_node({info.node_id, info.node_name}))
      return drop(info.node_id);
    auto& node = nodes_[info.node_id];
    node.info = info;
    node.refresh.handle_nonce(info.service_state_nonce, std::chrono::steady_clock::now());
    offer(node);
    ask_those_due();
  }

  void drop(const NodeId& id) {
    const auto dropped = nodes_.extract(id);
    if (!dropped) return;
    for (const auto& service : dropped.mapped().offered)
      if (core_) core_->withdraw(service);
  }

  void ask_those_due() {
    const auto now = std::chrono::steady_clock::now();
    std::optional<TimePoint> next;
    for (auto& [id, node] : nodes_) {
      if (queries_.size() >= max_open_queries) return;  // the end of one calls again
      if (node.refresh.take_due(now)) begin_query(node);
      if (const auto due = node.refresh.poll_timeout(); due && (!next || *due < *next)) next = due;
    }
    timer_.cancel();
    if (!next) return;
    timer_.expires_at(*next);
    timer_.async_wait([weak = weak_from_this()](const error_code& error) {
      if (const auto self = weak.lock(); self && !error && self->core_) self->ask_those_due();
    });
  }

  void begin_query(const FoundNode& node) {
    const auto query = *queries_.insert(std::make_shared<asio::cancellation_signal>()).first;
    ServiceQueryOptions options;
    options.dial.tls = core_->options().connect.dial.tls;
    auto urls = candidate_urls(node.info, filter_.transport_schemes);
    auto asked = ask(shared_from_this(), node.info.node_id, std::move(urls), std::move(options));
    asio::co_spawn(discovery_.io_context(), std::move(asked),
                   asio::bind_cancellation_slot(query->slot(), [self = shared_from_this(), query](std::exception_ptr) {
                     self->queries_.erase(query);
                     if (self->core_) self->ask_those_due();
                   }));
  }

  /// Throws   boost::system::system_error: it was cancelled.
  static awaitable<void> ask(std::shared_ptr<TypeFollower> self, NodeId id, std::vector<ConnectionUrl> urls,
                             ServiceQueryOptions options) {
    auto answer = co_await query_node(std::move(urls), std::move(options));
    const auto asked = self->nodes_.find(id);  // it may have been lost meanwhile
    if (asked == self->nodes_.end()) co_return;
    auto& node = asked->second;
    const auto now = std::chrono::steady_clock::now();
    if (!answer) co_return node.refresh.handle_failure(now);
    node.refresh.handle_success(now);
    if (self->core_) self->discovery_.confirm(id);
    node.services = std::move(answer->services);
    std::erase_if(node.services, [&](const ServiceInfo& service) { return !self->wants(service); });
    self->offer(node);
  }

  bool wants(const ServiceInfo& service) const {
    const auto is_of = [&](const std::string& type) { return service.implements(type); };
    return (types_.empty() || std::any_of(types_.begin(), types_.end(), is_of)) && filter_.takes(service);
  }

  std::vector<std::string> urls_of(const FoundNode& node, const ServiceInfo& service) const {
    auto ways = candidate_urls(node.info, filter_.transport_schemes);
    std::stable_sort(ways.begin(), ways.end(),
                     [](const auto& a, const auto& b) { return rank(a.scheme) < rank(b.scheme); });
    std::vector<std::string> out;
    for (auto& way : ways) out.push_back(url_of_service(std::move(way), service.node, service.name));
    return out;
  }

  /// Tells what is wanted of a node, and what is not there any more.
  void offer(FoundNode& node) {
    std::set<ServiceSubscriptionClientId> there;
    for (const auto& service : node.services) {
      auto urls = urls_of(node, service);
      const ServiceSubscriptionClientId id{service.node.id, service.name};
      WantedService wanted{id, std::move(urls), {}, {}};
      if (const auto* rule = filter_.find_node(service.node)) {
        wanted.username = rule->username;
        wanted.credentials = rule->credentials;
      }
      if (!wanted.urls.empty() && core_ && core_->offer(std::move(wanted))) there.insert(id);
    }
    for (const auto& id : std::exchange(node.offered, there))
      if (!there.contains(id) && core_) core_->withdraw(id);
  }

  /// There is room again.
  void review_all() {
    asio::post(discovery_.io_context(), [weak = weak_from_this()] {
      const auto self = weak.lock();
      if (!self || !self->core_) return;
      for (auto& [id, node] : self->nodes_) self->offer(node);
    });
  }

  Discovery& discovery_;
  std::vector<std::string> types_;
  ServiceSubscriptionFilter filter_;
  std::shared_ptr<SubscriptionCore> core_;  ///< null once it has ended
  Discovery::WatchId watch_ = 0;
  std::map<NodeId, FoundNode> nodes_;
  std::set<std::shared_ptr<asio::cancellation_signal>> queries_;  ///< under way
  asio::steady_timer timer_;
};

}  // namespace

ServiceSubscription subscribe_service_by_type(Discovery& discovery, std::vector<std::string> types,
                                              ServiceSubscriptionFilter filter, SubscriptionOptions options) {
  auto core = std::make_shared<SubscriptionCore>(discovery.io_context(), std::move(options));
  ServiceSubscription subscription(core);
  std::make_shared<TypeFollower>(discovery, std::move(types), std::move(filter), core)->start();
  return subscription;
}

}  // namespace rr
