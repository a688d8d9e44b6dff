#include "node/service/node.hpp"

#include <algorithm>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <system_error>

#include "core/discovery/announcement.hpp"
#include "core/session/url.hpp"
#include "core/support/random.hpp"
#include "node/driver/accept.hpp"
#include "node/driver/clocks.hpp"
#include "node/driver/post_cancel.hpp"
#include "node/platform/node_id_store.hpp"
#include "node/service/login_judge.hpp"
#include "node/service/node_listeners.hpp"
#include "node/service/service_client.hpp"
#include "node/transport/tcp.hpp"

namespace rr {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

constexpr std::chrono::milliseconds stop_deadline{500};

NodeIdentity make_identity(std::string name, const NodeId& id) {
  if (!name.empty() && !is_valid_node_name(name))
    throw std::invalid_argument("node name " + rr::quote(name) +
                                " is not valid: expected letters, digits, '_', '-', '.'");
  return {id.is_any() ? random_node_id() : id, std::move(name)};
}

/// The NodeID that this machine keeps for the name, while nobody else uses it.
std::optional<NodeIdClaim> claim_stored_id(const std::string& name, const NodeOptions& options) {
  if (!options.keeps_id) return std::nullopt;
  auto claim = NodeIdClaim::take(name);
  if (!claim) throw std::runtime_error("node " + rr::quote(name) + ": " + claim.error().message);
  return std::move(*claim);
}

/// Runs work at multiples of a period.
struct Repeat {
  Repeat(asio::io_context& io, std::chrono::nanoseconds interval, std::function<void()> what)
      : timer(io), period(interval), work(std::move(what)) {}
  asio::steady_timer timer;
  std::chrono::nanoseconds period;
  std::function<void()> work;
  bool is_stopped = false;
};

void repeat(const std::shared_ptr<Repeat>& job) {
  job->timer.async_wait([job](const error_code&) {
    if (!job->is_stopped) job->work();  // throws nothing
    if (job->is_stopped) return;
    const auto late = std::chrono::steady_clock::now() - job->timer.expiry();
    job->timer.expires_at(job->timer.expiry() + job->period * std::max<std::int64_t>(1, late / job->period + 1));
    repeat(job);
  });
}

}  // namespace

class Node::Implementation final : public ServiceClientOwner, public ServiceHost, public NodeListeners::Owner {
 public:
  Implementation(asio::io_context* io, std::string name, NodeOptions options)
      : options_(std::move(options)),
        own_io_(io ? nullptr : std::make_unique<asio::io_context>(1)),
        io_(io ? *io : *own_io_),
        claim_(claim_stored_id(name, options_)),
        directory_(make_identity(std::move(name), claim_ ? claim_->id() : options_.id)),
        listeners_(io_.get_executor(), options_, *this),
        thread_(std::make_shared<NodeThread>(io_.get_executor())),
        blocking_pool_(std::max<std::size_t>(1, options_.max_blocking)),
        stop_timer_(io_) {}

  ~Implementation() {
    alive_.reset();
    close_listeners();
    stop_timer_.cancel();
    for (const auto& service : services_) service->detach();
    for (const auto& [id, client] : std::exchange(clients_, {})) client->abandon();
    blocking_pool_.stop();
    thread_->close();
  }

  void add(const std::shared_ptr<Service>& service) {
    auto hosted = service->attach(*this);
    if (auto added = directory_.add(hosted); !added) {
      service->detach();
      throw std::invalid_argument(added.error().message);
    }
    services_.push_back(service);
    nonce_ = make_service_state_nonce();
    listeners_.publish(nonce_);
    if (services_changed_) services_changed_();
  }

  std::uint16_t listen(std::string_view url) {
    const auto port = listeners_.listen(url, identity(), nonce_);
    if (port != 0 && services_changed_) services_changed_();
    return port;
  }

  void run() {
    const auto signals = std::make_shared<asio::signal_set>(io_, SIGINT, SIGTERM);
    signals->async_wait([this](const error_code& error, int) {
      if (!error) stop();
    });
    signals_ = signals;
    io_.run();  // may end by an exception of what else runs there
  }

  void stop() {
    if (std::exchange(is_stopping_, true)) return;
    if (const auto signals = signals_.lock()) signals->cancel();
    close_listeners();
    for (const auto& service : services_) {
      service->on_client_connected(nullptr);
      service->on_client_gone(nullptr);
    }
    const auto clients = clients_;  // each removes itself
    for (const auto& [id, client] : clients) client->close_service();
    if (clients_.empty()) return stopped();
    stop_timer_.expires_after(stop_deadline);
    stop_timer_.async_wait([this, alive = std::weak_ptr(alive_)](const error_code& error) {
      if (error || alive.expired()) return;
      const auto stubborn = clients_;
      for (const auto& [id, client] : stubborn)
        client->close(make_error(ErrorCode::connection_error, "the node stops"));
    });
  }

  void accept(std::unique_ptr<ByteStream> stream, std::string_view url) {
    const auto colon = url.find("://");
    if (colon == std::string_view::npos || !url.starts_with("rr"))
      throw std::invalid_argument("accept for " + rr::quote(url) + ": expected a URL as \"rr+ws://HOST:PORT/\"");
    Door door{std::string(url.substr(0, colon)), std::string(url.substr(colon + 3)), options_.require_tls};
    if (door.address.ends_with('/')) door.address.pop_back();
    if (!is_stopping_ && !is_full()) welcome(std::move(stream), std::move(door));
  }

  void accept(asio::ip::tcp::socket socket, bool requires_tls, ByteSpan seen = {}) {
    error_code error;
    const auto local = socket.local_endpoint(error);
    if (error || is_stopping_ || is_full()) return;  // an error: gone already
    const auto host = local.address().to_string();
    auto stream = make_tcp_stream(std::move(socket), NodeListeners::send_stall);
    stream->put_back(seen);
    welcome(std::move(stream), {{}, format_host_port(without_zone(host), local.port()), requires_tls});
  }

  void every(std::chrono::nanoseconds period, std::function<void()> work) {
    if (period <= std::chrono::nanoseconds::zero())
      throw std::invalid_argument("Node::every: the period must be longer than nothing");
    auto guarded = [this, work = std::move(work)] { run_handler("Node", "every", work); };
    const auto job = std::make_shared<Repeat>(io_, period, std::move(guarded));
    job->timer.expires_after(period);
    repeats_.push_back(job);
    repeat(job);
  }

  void post(std::function<void()> work) {
    asio::post(io_, [this, alive = still_there_, work = std::move(work)] {
      if (alive.expired()) return work();  // the node's io_context is somebody else's, and outlives it
      run_handler("Node", "post", work);
    });
  }

  std::vector<std::string> listen_urls() const { return listeners_.urls(identity().id); }
  const std::string& nonce() const { return nonce_; }
  void on_services_changed(std::function<void()> handler) { services_changed_ = std::move(handler); }

  asio::io_context& io() { return io_; }
  bool requires_tls() const { return options_.require_tls; }
  const NodeIdentity& identity() const { return directory_.identity(); }
  std::size_t client_count() const {
    return static_cast<std::size_t>(
        std::count_if(clients_.begin(), clients_.end(), [](const auto& client) { return client.second->service(); }));
  }

  // NodeListeners::Owner: who comes in

  void accept_tcp(asio::ip::tcp::socket socket, bool requires_tls) override { accept(std::move(socket), requires_tls); }
  /// Nothing has to be found out first.
  void accept_near(std::unique_ptr<ByteStream> stream, std::string scheme) override {
    if (is_stopping_ || is_full()) return;
    Accepted accepted;
    accepted.stream = std::move(stream);
    accepted.scheme = std::move(scheme);
    add_client(std::move(accepted), "");
  }

  // ServiceHost: from services to clients

  void send_event(const Service& service, EventPacket& packet) override {
    for_clients_of(service, [&](ServiceClient& client) { client.send_event(packet); });
  }
  void send_wire(WirePacket& packet, const std::shared_ptr<const Value>& newest) override {
    const auto found = followers_.find(PathMemberView{packet.path(), packet.member().name});
    if (found == followers_.end()) return;
    // Meanwhile some may leave, others come, who are sent the newest by that, and a handler may set another value.
    const auto followers = found->second;
    const auto value = newest;
    const std::weak_ptr alive = alive_;
    for (const auto id : followers)
      if (!alive.expired() && newest == value) send_wire_to(id, packet);
  }
  void send_wire_to(ClientId id, WirePacket& packet) override {
    const auto found = clients_.find(id);
    if (found == clients_.end()) return;
    const auto client = found->second;
    client->send_wire(packet);
  }
  void release_path(const Service& service, const std::string& path) override {
    for_clients_of(service, [&](ServiceClient& client) { client.release_path(path); });
  }
  void call_callback(const Service& service, ClientId id, const std::vector<std::string>& paths,
                     const MemberDefinition& callback, std::span<const Value> arguments, CallbackDone done) override {
    const auto client = clients_.find(id);
    if (client != clients_.end() && client->second->service() == &service)
      return client->second->call_callback(paths, callback, arguments, std::move(done));
    if (!done) return;
    asio::post(io_, [this, alive = std::weak_ptr(alive_), done = std::move(done), name = callback.name] {
      if (alive.expired()) return;
      run_handler("callback", name, [&] {
        done(make_error(ErrorCode::connection_error, "callback '" + name + "': the client is not connected"));
      });
    });
  }
  std::size_t max_message_size() const override { return options_.max_message_size; }
  ClientId current_client() const override { return current_client_; }
  Caller find_client(ClientId id) const override {
    const auto found = clients_.find(id);
    if (found == clients_.end() || !found->second->service()) return {};
    const ServiceSession& session = found->second->session();
    const auto* user = session.user();
    return {id, user ? user->name : std::string(), session.endpoint(), session.connection().peer(),
            found->second->verified_peer()};
  }

  // ServiceClientOwner: from clients

  std::shared_ptr<Service> find_service(const HostedService& hosted) override {
    for (const auto& service : services_)
      if (service->name() == hosted.name()) return service;
    return nullptr;  // the service index
  }
  const std::shared_ptr<NodeThread>& thread() override { return thread_; }
  BlockingPool& blocking_pool() override { return blocking_pool_; }
  ClientId set_current_client(ClientId id) override { return std::exchange(current_client_, id); }
  void report(const std::string& problem) override {
    if (options_.report)
      options_.report(problem);
    else
      std::cerr << identity().name << ": " << problem << '\n';
  }
  void judge_login(const LoginRequested& login, const std::shared_ptr<ServiceClient>& client) override {
    judge_.judge(login, io_.get_executor(), [id = login.id, weak = std::weak_ptr(client)](const auto& result) {
      if (const auto still_there = weak.lock()) still_there->answer_login(id, result);
    });
  }
  void locks_changed(const Service& service) override {
    for_clients_of(service, [](ServiceClient& client) { client.handle_locks_changed(); });
  }
  void follow_wire(ClientId client, const PathMember& wire) override { followers_[wire].push_back(client); }
  void leave_wire(ClientId client, const PathMember& wire) override {
    const auto found = followers_.find(wire);
    std::erase(found->second, client);
    if (found->second.empty()) followers_.erase(found);
  }
  void client_ended(ServiceClient& client) override {
    clients_.erase(client.id());
    if (is_stopping_ && clients_.empty()) stopped();
  }

 private:
  using Arrival = std::shared_ptr<asio::cancellation_signal>;

  /// `kind`, `name`  of what the work was given to.
  void run_handler(std::string_view kind, std::string_view name, const std::function<void()>& work) {
    const std::weak_ptr alive = alive_;
    try {
      work();
    } catch (...) {
      if (alive.expired()) throw;  // there is nobody to report it
      report(describe_failure(kind, name, handler_error(std::current_exception())));
    }
  }

  /// Clients that are lost while they are sent to, or by what handlers do then, leave clients_ meanwhile.
  template <class F>
  void for_clients_of(const Service& service, F&& what) {
    const std::weak_ptr alive = alive_;  // a handler may end the node
    for (auto next = clients_.begin(); next != clients_.end();) {
      const auto client = next->second;
      if (client->service() == &service) what(*client);
      if (alive.expired()) return;
      next = clients_.upper_bound(client->id());
    }
  }

  /// Where clients come in: of the URL that they may have used.
  struct Door {
    std::string scheme = {};  ///< empty: the stream says it
    std::string address = {};
    bool requires_tls = false;
  };

  void welcome(std::unique_ptr<ByteStream> stream, Door door) {
    const auto arrival = std::make_shared<asio::cancellation_signal>();
    arriving_.insert(arrival);
    const auto keep = [arrival](const std::exception_ptr&) {};  // the coroutine uses the slot until this is called
    asio::co_spawn(io_, find_out(std::move(stream), std::move(door), arrival, alive_),
                   asio::bind_cancellation_slot(arrival->slot(), keep));
  }

  bool is_full() const { return clients_.size() + arriving_.size() >= options_.max_clients; }

  /// `alive`  the node may go while a client says nothing.
  awaitable<void> find_out(std::unique_ptr<ByteStream> stream, Door door, Arrival arrival,
                           std::weak_ptr<const bool> alive) {
    AcceptOptions how;
    how.allowed_origins = options_.allowed_origins;
    how.self = identity();
    how.tls = options_.tls;
    how.requires_tls = door.requires_tls;
    auto accepted = co_await accept_stream(std::move(stream), std::move(how));
    if (alive.expired()) co_return;
    arriving_.erase(arrival);
    if (!accepted && accepted.error().code == ErrorCode::authentication_error) report(accepted.error().message);
    if (!accepted || is_stopping_) co_return;
    if (!door.scheme.empty()) accepted->scheme = accepted->is_encrypted ? "rrs" + door.scheme.substr(2) : door.scheme;
    add_client(std::move(*accepted), door.address);
  }

  void add_client(Accepted accepted, const std::string& local) {
    ServiceSessionOptions session;
    session.connection.features = options_.features;
    session.connection.max_message_size = options_.max_message_size;
    const auto heartbeat = options_.heartbeat.value_or(heartbeat_of(accepted.scheme));
    session.connection.heartbeat_period = bounded(heartbeat.period) * 12 / 10;
    session.connection.receive_timeout = bounded(heartbeat.timeout);
    session.connection.known_peer = accepted.known_peer;
    session.connection.is_encrypted = accepted.is_encrypted;
    if (const auto verified = accepted.stream->verified_peer(); !verified.is_any()) session.verified_node_id = verified;
    session.base_url = accepted.scheme + "://" + local + "/";
    const ClientId id = ++last_client_id_;
    const auto client =
        std::make_shared<ServiceClient>(id, *this, directory_, std::move(session), std::move(accepted.stream));
    clients_.emplace(id, client);
    client->start();
  }

  void stopped() {
    stop_timer_.cancel();
    if (own_io_) own_io_->stop();  // whatever else runs on it ends with the node
  }

  void close_listeners() {
    listeners_.close();
    for (const auto& arrival : std::exchange(arriving_, {})) post_cancel(io_.get_executor(), arrival);
    for (const auto& job : repeats_) {
      job->is_stopped = true;
      job->timer.cancel();
    }
    repeats_.clear();
  }

  NodeOptions options_;
  std::unique_ptr<asio::io_context> own_io_;
  asio::io_context& io_;
  std::optional<NodeIdClaim> claim_;
  ServiceDirectory directory_;
  std::vector<std::shared_ptr<Service>> services_;
  std::string nonce_ = make_service_state_nonce();
  std::function<void()> services_changed_;
  NodeListeners listeners_;
  std::vector<std::shared_ptr<Repeat>> repeats_;
  std::map<ClientId, std::shared_ptr<ServiceClient>> clients_;
  std::map<PathMember, std::vector<ClientId>, PathMemberLess> followers_;  ///< of the wires that anybody has connected
  std::set<Arrival> arriving_;  ///< connections whose first bytes are awaited
  ClientId last_client_id_ = 0;
  ClientId current_client_ = 0;
  bool is_stopping_ = false;
  std::shared_ptr<const bool> alive_ = std::make_shared<const bool>(true);  ///< gone: handlers keep away from the node
  const std::weak_ptr<const bool> still_there_ = alive_;  ///< for other threads: alive_ may be let go meanwhile
  const std::shared_ptr<NodeThread> thread_;
  BlockingPool blocking_pool_;
  asio::steady_timer stop_timer_;
  std::weak_ptr<asio::signal_set> signals_;  ///< of run()
  LoginJudge judge_;
};

Node::Node(std::string name, NodeOptions options)
    : implementation_(std::make_unique<Implementation>(nullptr, std::move(name), std::move(options))) {}
Node::Node(asio::io_context& io, std::string name, NodeOptions options)
    : implementation_(std::make_unique<Implementation>(&io, std::move(name), std::move(options))) {}
Node::~Node() = default;

void Node::add(const std::shared_ptr<Service>& service) {
  implementation_->add(service);
}
std::uint16_t Node::listen(std::string_view url) {
  return implementation_->listen(url);
}
void Node::accept(std::unique_ptr<ByteStream> stream, std::string_view url) {
  implementation_->accept(std::move(stream), url);
}
void Node::accept(asio::ip::tcp::socket socket, ByteSpan seen) {
  implementation_->accept(std::move(socket), implementation_->requires_tls(), seen);
}
void Node::run() {
  implementation_->run();
}
void Node::stop() {
  implementation_->stop();
}
void Node::post(std::function<void()> work) {
  implementation_->post(std::move(work));
}
void Node::every(std::chrono::nanoseconds period, std::function<void()> work) {
  implementation_->every(period, std::move(work));
}
const NodeIdentity& Node::identity() const {
  return implementation_->identity();
}
std::vector<std::string> Node::listen_urls() const {
  return implementation_->listen_urls();
}
const std::string& Node::service_state_nonce() const {
  return implementation_->nonce();
}
void Node::on_services_changed(std::function<void()> handler) {
  implementation_->on_services_changed(std::move(handler));
}
asio::io_context& Node::io_context() {
  return implementation_->io();
}
std::size_t Node::client_count() const {
  return implementation_->client_count();
}

}  // namespace rr
