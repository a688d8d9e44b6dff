#include "node/discovery/discovery.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <iostream>
#include <list>
#include <map>

#include "core/discovery/schedules.hpp"
#include "core/support/random.hpp"
#include "node/discovery/machine_nodes.hpp"
#include "node/driver/clocks.hpp"
#include "node/service/node.hpp"

namespace rr {

namespace asio = boost::asio;
using std::chrono::milliseconds;

namespace {

constexpr std::size_t max_queries = 32;  // side by side

bool has_scheme(const NodeDiscoveryInfo& node, const std::vector<std::string>& schemes) {
  return schemes.empty() || std::any_of(node.urls.begin(), node.urls.end(), [&](const NodeDiscoveryUrl& url) {
           return std::any_of(schemes.begin(), schemes.end(),
                              [&](const std::string& scheme) { return url.url.rfind(scheme + "://", 0) == 0; });
         });
}

/// By which announcements are told apart whose sender claims to be many nodes.
std::string sender_of(const PacketSource& source) {
  const auto& bytes = source.address.bytes;
  return std::string(bytes.begin(), source.address.is_v6 ? bytes.end() : bytes.begin() + 4) + source.zone;
}

/// One search for services over many nodes. Shared by its queries, since they end a little after it.
struct TypeSearch {
  explicit TypeSearch(const asio::any_io_executor& executor) : changed(executor) {}

  std::string type;
  DialOptions dial;
  std::vector<std::vector<ConnectionUrl>> nodes;  ///< taken from the back
  std::size_t open_queries = 0;
  std::vector<ServiceInfo> found;
  asio::steady_timer changed;                    ///< cancelled when a query ends
  std::list<asio::cancellation_signal> queries;  ///< those that have ended, too
};

/// Cancels what is still asked when the search is over, also when it is given up.
class SearchGuard {
 public:
  explicit SearchGuard(std::shared_ptr<TypeSearch> search) : search_(std::move(search)) {}
  SearchGuard(const SearchGuard&) = delete;
  SearchGuard& operator=(const SearchGuard&) = delete;
  ~SearchGuard() {
    for (auto& query : search_->queries) query.emit(asio::cancellation_type::terminal);
  }

 private:
  std::shared_ptr<TypeSearch> search_;
};

awaitable<void> query_nodes(std::shared_ptr<TypeSearch> search, std::chrono::steady_clock::time_point deadline) {
  while (!search->nodes.empty()) {
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left <= milliseconds::zero()) break;
    auto urls = std::move(search->nodes.back());
    search->nodes.pop_back();
    ServiceQueryOptions options;
    options.dial = search->dial;
    options.dial.timeout = std::min(left, options.dial.timeout);
    auto answer = co_await query_node(std::move(urls), options);
    if (!answer) continue;  // gone, or not what it says it is
    for (auto& service : answer->services)
      if (service.implements(search->type)) search->found.push_back(std::move(service));
  }
  --search->open_queries;
  search->changed.cancel();
}

}  // namespace

class Discovery::Implementation : public std::enable_shared_from_this<Implementation> {
 public:
  Implementation(asio::io_context& io, DiscoveryOptions options)
      : io_(io), options_(std::move(options)), nodes_(options_.cache), timer_(io) {}

  void start() {
    if (options_.ip) {
      IpDiscovery::Callbacks callbacks;
      callbacks.received = [this](std::string_view packet, const PacketSource& source) { received(packet, source); };
      callbacks.addresses_changed = [this] { addresses_changed(); };
      callbacks.report = [this](const std::string& problem) { report(problem); };
      ip_.emplace(io_.get_executor(), *options_.ip, options_.listens, std::move(callbacks));
      if (options_.listens) requests_.start(std::chrono::steady_clock::now());
    }
    if (options_.listens && (options_.intra || options_.local || options_.hardware)) find_machine_nodes();
    wait();
  }

  void close() {
    is_closed_ = true;
    ip_.reset();
    machine_.reset();
    timer_.cancel();
    watchers_.clear();
    for (auto* waiting : waiting_) waiting->cancel();
  }

  asio::io_context& io_context() { return io_; }

  std::vector<NodeDiscoveryInfo> detected_nodes() const {
    std::vector<NodeDiscoveryInfo> out;
    for (const auto& [id, node] : nodes_.nodes()) out.push_back(node);
    return out;
  }

  WatchId watch(Watcher handler) {
    const auto id = ++last_watch_id_;
    const auto watcher = std::make_shared<Watcher>(std::move(handler));
    watchers_.emplace(id, watcher);
    for (const auto& node : detected_nodes()) (*watcher)({NodeEvent::Kind::found, node});
    return id;
  }
  void unwatch(WatchId id) { watchers_.erase(id); }

  void refresh() {
    if (machine_) machine_->refresh();
    if (!ip_) return;
    ip_->send_everywhere(format_discovery_request(listener_id_));
    requests_.start(std::chrono::steady_clock::now());
    wait();
  }

  static awaitable<std::vector<ServiceInfo>> find_service_by_type(std::shared_ptr<Implementation> self,
                                                                  std::string type, std::vector<std::string> schemes,
                                                                  milliseconds timeout) {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    self->refresh();
    asio::steady_timer pause(self->io_, timeout / 4);
    co_await self->wait_for(pause);

    auto search = std::make_shared<TypeSearch>(self->io_.get_executor());
    const SearchGuard guard(search);
    search->type = std::move(type);
    search->dial = self->options_.dial;
    for (const auto& [id, node] : self->nodes_.nodes())
      if (auto urls = candidate_urls(node, schemes); !urls.empty()) search->nodes.push_back(std::move(urls));
    search->open_queries = std::min(search->nodes.size(), max_queries);
    for (auto left = search->open_queries; left > 0; --left) {
      auto queries = query_nodes(search, deadline);
      auto& signal = search->queries.emplace_back();
      asio::co_spawn(self->io_, std::move(queries),
                     asio::bind_cancellation_slot(signal.slot(), [search](std::exception_ptr) {}));
    }
    while (search->open_queries > 0 && !self->is_closed_ && std::chrono::steady_clock::now() < deadline) {
      search->changed.expires_at(deadline);
      co_await self->wait_for(search->changed);
    }
    co_return std::move(search->found);
  }

  template <class F>
  static awaitable<std::vector<NodeDiscoveryInfo>> find_nodes(std::shared_ptr<Implementation> self, F is_wanted,
                                                              std::vector<std::string> schemes, milliseconds timeout) {
    asio::steady_timer pause(self->io_);
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    struct Unwatch {  // also where the search is cancelled
      Implementation& all;
      WatchId id;
      ~Unwatch() { all.unwatch(id); }
    };
    const Unwatch watching{*self, self->watch([&pause](const NodeEvent&) { pause.cancel(); })};
    std::vector<NodeDiscoveryInfo> found;
    bool has_asked = false;
    while (!self->is_closed_) {
      for (const auto& [id, node] : self->nodes_.nodes())
        if (is_wanted(node) && has_scheme(node, schemes)) found.push_back(node);
      if (!found.empty() || std::chrono::steady_clock::now() >= deadline) break;
      if (!std::exchange(has_asked, true)) self->refresh();
      pause.expires_at(deadline);
      co_await self->wait_for(pause);
    }
    co_return found;
  }

  void announce(NodeIdentity identity, std::function<std::vector<ListenAddress>()> listens,
                std::function<std::string()> make_nonce) {
    const auto id = identity.id;
    OwnNode own{
        std::move(identity), std::move(listens), std::move(make_nonce), AnnounceSchedule(options_.announce_period), {}};
    own_.insert_or_assign(id, std::move(own));
    services_changed(id);
  }

  void services_changed(const NodeId& node_id) {
    const auto own = own_.find(node_id);
    if (own == own_.end()) return;
    own->second.nonce = own->second.make_nonce();
    own->second.schedule.announce_soon(std::chrono::steady_clock::now());
    wait();
  }

  void withdraw(const NodeId& node_id) { own_.erase(node_id); }

  void handle_announcement(const Announcement& announcement, std::string_view sender = {}) {
    nodes_.handle_announcement(announcement, read_clocks(), sender);
    tell();
  }
  void confirm(const NodeId& node_id) { nodes_.confirm(node_id); }
  void handle_withdrawn(const NodeId& node_id, std::string_view url) {
    nodes_.handle_withdrawn(node_id, url);
    tell();
  }
  void forget(const NodeId& node_id) {
    nodes_.forget(node_id);
    tell();
  }

 private:
  struct OwnNode {
    NodeIdentity identity;
    std::function<std::vector<ListenAddress>()> listens;
    std::function<std::string()> make_nonce;
    AnnounceSchedule schedule;
    std::string nonce;
  };

  /// Timers of coroutines, so that close() ends their waits.
  awaitable<void> wait_for(asio::steady_timer& timer) {
    const auto self = shared_from_this();
    if (is_closed_) co_return;
    waiting_.push_back(&timer);
    co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
    waiting_.erase(std::find(waiting_.begin(), waiting_.end(), &timer));
  }

  void find_machine_nodes() {
    MachineNodesOptions machine;
    machine.intra = options_.intra;
    machine.local = options_.local;
    machine.hardware = options_.hardware;
    machine.refresh = std::min(machine.refresh, options_.cache.expiry * 9 / 10);
    MachineNodes::Callbacks callbacks;
    callbacks.is_own = [this](const NodeId& id) { return own_.contains(id); };
    callbacks.announced = [this](const Announcement& announcement) { handle_announcement(announcement); };
    callbacks.withdrawn = [this](const NodeId& id, const std::string& url) { handle_withdrawn(id, url); };
    callbacks.report = [this](const std::string& problem) { report(problem); };
    machine_.emplace(io_.get_executor(), machine, std::move(callbacks));
  }

  void received(std::string_view packet, const PacketSource& source) {
    std::vector<NodeId> own;
    for (const auto& [id, node] : own_) own.push_back(id);
    if (const auto announcement = parse_announcement(packet, source, own))
      return handle_announcement(*announcement, sender_of(source));
    const auto listener = parse_discovery_request(packet);
    // What is neither is somebody's mistake, and not worth a line for each.
    if (!listener || *listener == listener_id_) return;
    for (auto& [id, node] : own_) node.schedule.announce_soon(std::chrono::steady_clock::now());
    wait();
  }

  /// A cable was plugged in, say: who is there now?
  void addresses_changed() {
    const auto now = std::chrono::steady_clock::now();
    for (auto& [id, node] : own_) node.schedule.announce_soon(now);
    if (options_.listens) requests_.start(now);
    wait();
  }

  void tell() {
    while (auto event = nodes_.poll_event()) {
      const auto watchers = watchers_;  // each may watch and unwatch
      for (const auto& [id, watcher] : watchers)
        if (watchers_.contains(id)) (*watcher)(*event);
    }
    wait();
  }

  /// One timer for everything that is due some time.
  void wait() {
    if (is_closed_) return;
    std::optional<TimePoint> next;
    const auto consider = [&next](std::optional<TimePoint> at) {
      if (at && (!next || *at < *next)) next = at;
    };
    consider(nodes_.poll_timeout());
    consider(requests_.poll_timeout());
    for (const auto& [id, node] : own_) consider(node.schedule.poll_timeout());
    if (next == waits_until_) return;
    waits_until_ = next;
    timer_.cancel();
    if (!next) return;
    timer_.expires_at(*next);
    timer_.async_wait([self = shared_from_this()](const error_code& error) {
      if (!error && !self->is_closed_) self->due();
    });
  }

  void due() {
    waits_until_.reset();
    const auto now = read_clocks();
    if (requests_.take_due(now.steady) && ip_) ip_->send_everywhere(format_discovery_request(listener_id_));
    for (auto& [id, node] : own_)
      if (node.schedule.take_due(now.steady)) send_announcements(node);
    nodes_.handle_timeout(now);
    tell();
  }

  void send_announcements(const OwnNode& node) {
    if (!ip_) return;
    for (const auto& each : announced_urls(node.identity.id, node.listens(), ip_->addresses()))
      ip_->send(each.from, format_announcement({node.identity.id, node.identity.name, each.url, node.nonce}),
                each.stays_here);
  }

  void report(const std::string& problem) {
    if (options_.report)
      options_.report(problem);
    else
      std::cerr << "discovery: " << problem << '\n';
  }

  asio::io_context& io_;
  DiscoveryOptions options_;
  DetectedNodes nodes_;
  RequestSchedule requests_;
  NodeId listener_id_ = random_node_id();
  std::optional<IpDiscovery> ip_;
  std::optional<MachineNodes> machine_;
  std::map<NodeId, OwnNode> own_;
  std::map<WatchId, std::shared_ptr<Watcher>> watchers_;
  WatchId last_watch_id_ = 0;
  std::vector<asio::steady_timer*> waiting_;
  asio::steady_timer timer_;
  std::optional<TimePoint> waits_until_;
  bool is_closed_ = false;
};

Discovery::Discovery(asio::io_context& io, DiscoveryOptions options)
    : implementation_(std::make_shared<Implementation>(io, std::move(options))) {
  implementation_->start();
}
Discovery::~Discovery() {
  implementation_->close();
}

asio::io_context& Discovery::io_context() {
  return implementation_->io_context();
}
std::vector<NodeDiscoveryInfo> Discovery::detected_nodes() const {
  return implementation_->detected_nodes();
}
Discovery::WatchId Discovery::watch(Watcher handler) {
  return implementation_->watch(std::move(handler));
}
void Discovery::unwatch(WatchId id) {
  implementation_->unwatch(id);
}
void Discovery::refresh() {
  implementation_->refresh();
}

awaitable<std::vector<ServiceInfo>> Discovery::find_service_by_type(std::string type, std::vector<std::string> schemes,
                                                                    milliseconds timeout) {
  return Implementation::find_service_by_type(implementation_, std::move(type), std::move(schemes), timeout);
}
awaitable<std::vector<NodeDiscoveryInfo>> Discovery::find_node_by_id(NodeId id, std::vector<std::string> schemes,
                                                                     milliseconds timeout) {
  auto is_wanted = [id](const NodeDiscoveryInfo& node) { return node.node_id == id; };
  return Implementation::find_nodes(implementation_, std::move(is_wanted), std::move(schemes), timeout);
}
awaitable<std::vector<NodeDiscoveryInfo>> Discovery::find_node_by_name(std::string name,
                                                                       std::vector<std::string> schemes,
                                                                       milliseconds timeout) {
  auto is_wanted = [name = std::move(name)](const NodeDiscoveryInfo& node) { return node.node_name == name; };
  return Implementation::find_nodes(implementation_, std::move(is_wanted), std::move(schemes), timeout);
}

void Discovery::announce(Node& node) {
  const auto listens = [&node] {
    std::vector<ListenAddress> out;
    for (const auto& text : node.listen_urls())
      if (auto url = parse_url(text, ServiceInUrl::optional)) out.push_back({url->scheme, url->host, url->port});
    return out;
  };
  // The nonce that its info files have: who sees both must not take the node for one that changes all the time.
  implementation_->announce(node.identity(), listens, [&node] { return node.service_state_nonce(); });
  node.on_services_changed([weak = std::weak_ptr(implementation_), id = node.identity().id] {
    if (const auto discovery = weak.lock()) discovery->services_changed(id);
  });
}
void Discovery::announce(NodeIdentity identity, std::function<std::vector<ListenAddress>()> listens) {
  implementation_->announce(std::move(identity), std::move(listens), make_service_state_nonce);
}
void Discovery::services_changed(const NodeId& node_id) {
  implementation_->services_changed(node_id);
}
void Discovery::withdraw(const NodeId& node_id) {
  implementation_->withdraw(node_id);
}
void Discovery::confirm(const NodeId& node_id) {
  implementation_->confirm(node_id);
}

void Discovery::handle_announcement(const Announcement& announcement) {
  implementation_->handle_announcement(announcement);
}
void Discovery::handle_withdrawn(const NodeId& node_id, std::string_view url) {
  implementation_->handle_withdrawn(node_id, url);
}
void Discovery::forget(const NodeId& node_id) {
  implementation_->forget(node_id);
}

}  // namespace rr
