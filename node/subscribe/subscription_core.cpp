#include "node/subscribe/subscription_core.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <iostream>

#include "node/driver/backoff.hpp"
#include "node/driver/clocks.hpp"

namespace rr::detail {

namespace asio = boost::asio;
using std::chrono::milliseconds;

/// One service of a subscription: connected, connecting, or waiting for the next attempt.
class SubscriptionLink : public std::enable_shared_from_this<SubscriptionLink> {
 public:
  SubscriptionLink(std::shared_ptr<SubscriptionCore> core, WantedService service)
      : core_(core),
        service_(std::move(service)),
        backoff_(core->options().first_retry, core->options().longest_retry),
        timer_(core->io_context()) {}

  /// One attempt: the first URL that works.
  void begin() {
    timer_.cancel();
    is_waiting_ = false;
    attempt_ = std::make_shared<Attempt>();
    attempt_->urls = service_.urls;
    open_next();
  }

  /// Other ways to the service, or it is there again.
  void update(WantedService service) {
    const bool is_news = !is_wanted_ || service.urls != service_.urls;
    is_wanted_ = true;
    service_ = std::move(service);
    if (!is_news || !is_waiting_) return;
    backoff_.reset();
    wait(random_between(milliseconds(100), milliseconds(600)));
  }

  /// Returns whether it is over.
  bool withdraw() {
    is_wanted_ = false;
    return !connection_;
  }

  void close() {
    is_closed_ = true;
    timer_.cancel();
    give_up_attempt();
    if (connection_) connection_->disconnect();
  }

 private:
  struct Attempt {
    std::vector<std::string> urls;
    std::size_t next = 0;
    std::size_t open = 0;
    std::vector<std::shared_ptr<ClientOpening>> openings;
  };

  void give_up_attempt() {
    const auto attempt = std::exchange(attempt_, nullptr);
    if (!attempt) return;
    for (const auto& opening : attempt->openings) opening->cancel();
  }

  void open_next() {
    const std::string url = attempt_->urls[attempt_->next++];
    ++attempt_->open;
    auto options = core_->options().connect;
    options.known_definitions = known_;
    if (!service_.username.empty()) {
      options.username = service_.username;
      options.credentials = service_.credentials;
    }
    auto opened = [self = shared_from_this(), attempt = attempt_,
                   url](Result<std::shared_ptr<ClientConnection>> result) {
      if (self->attempt_ != attempt) return;
      if (result) return self->take(std::move(*result));
      --attempt->open;
      self->core_->handle_failed(result.error(), url);
      if (self->attempt_ != attempt) return;
      if (attempt->next < attempt->urls.size())
        self->open_next();
      else if (attempt->open == 0)
        self->retry();
    };
    attempt_->openings.push_back(
        ClientConnection::open(core_->io_context(), url, std::move(options), std::move(opened)));
    timer_.cancel();
    if (attempt_->next == attempt_->urls.size()) return;
    timer_.expires_after(core_->options().next_url_after);
    timer_.async_wait([self = shared_from_this(), attempt = attempt_](const error_code& error) {
      if (!error && self->attempt_ == attempt && attempt->next < attempt->urls.size()) self->open_next();
    });
  }

  void take(std::shared_ptr<ClientConnection> connection) {
    timer_.cancel();
    give_up_attempt();
    backoff_.reset();
    connection_ = std::move(connection);
    // Held weakly: this holds the connection.
    connection_->on_closed([weak = weak_from_this()](const Error& reason) {
      if (const auto self = weak.lock()) self->handle_lost(reason);
    });
    const AsyncObject root(connection_, connection_->root_path());
    core_->handle_connected(root, {connection_->session().connection().peer().id, root.path()});
  }

  void handle_lost(const Error& reason) {
    const auto connection = std::exchange(connection_, nullptr);
    if (is_closed_) return;
    if (const auto& known = connection->session().known_definitions()) known_ = *known;
    core_->handle_lost(AsyncObject(connection, connection->root_path()), reason);
    if (!is_closed_) retry();
  }

  void retry() {
    attempt_.reset();
    if (!is_wanted_) return core_->forget(service_.id);
    wait(backoff_.next());
  }

  void wait(milliseconds duration) {
    is_waiting_ = true;
    timer_.expires_after(duration);
    timer_.async_wait([self = shared_from_this()](const error_code& error) {
      if (error || self->is_closed_ || !self->is_waiting_) return;
      self->begin();
    });
  }

  std::shared_ptr<SubscriptionCore> core_;
  WantedService service_;
  Backoff backoff_;
  asio::steady_timer timer_;
  std::shared_ptr<Attempt> attempt_;  ///< null while there is none
  std::shared_ptr<ClientConnection> connection_;
  std::vector<KnownDefinitions> known_;  ///< of the connections before
  bool is_waiting_ = false;
  bool is_wanted_ = true;
  bool is_closed_ = false;
};

SubscriptionCore::SubscriptionCore(asio::io_context& io, SubscriptionOptions options)
    : io_(io), options_(std::move(options)), waiters_(io) {
  for (auto* each : {&options_.first_retry, &options_.longest_retry, &options_.next_url_after, &options_.member_retry})
    *each = bounded(*each);
}

bool SubscriptionCore::offer(WantedService service) {
  if (is_closed_) return false;
  if (const auto known = links_.find(service.id); known != links_.end()) {
    known->second->update(std::move(service));
    return true;
  }
  if (links_.size() >= options_.max_clients) return false;
  const auto id = service.id;
  const auto link = std::make_shared<SubscriptionLink>(shared_from_this(), std::move(service));
  links_.emplace(id, link);
  link->begin();
  return true;
}

void SubscriptionCore::withdraw(const ServiceSubscriptionClientId& id) {
  const auto known = links_.find(id);
  if (known != links_.end() && known->second->withdraw()) forget(id);
}

void SubscriptionCore::forget(const ServiceSubscriptionClientId& id) {
  const auto known = links_.extract(id);
  if (!known) return;
  known.mapped()->close();
  if (freed_ && !is_closed_) freed_();
}

std::optional<AsyncObject> SubscriptionCore::default_client() const {
  if (clients_.empty()) return std::nullopt;
  return clients_.front().root;
}

std::map<ServiceSubscriptionClientId, AsyncObject> SubscriptionCore::clients() const {
  std::map<ServiceSubscriptionClientId, AsyncObject> out;
  for (const auto& client : clients_) out.emplace(client.id, client.root);
  return out;
}

std::optional<Waiters<AsyncObject>::Id> SubscriptionCore::wait_for_client(std::optional<milliseconds> timeout,
                                                                          Waiters<AsyncObject>::Done done) {
  if (!is_closed_ && clients_.empty()) return waiters_.add(std::move(done), timeout, shared_from_this());
  Result<AsyncObject> result = subscription_closed();
  if (!is_closed_) result = clients_.front().root;
  asio::post(io_, [done = std::move(done), result = std::move(result)] { done(result); });
  return std::nullopt;
}

void SubscriptionCore::follow(std::shared_ptr<SubscriptionFollower> follower) {
  followers_.push_back(follower);
  for (const auto& client : std::vector(clients_)) follower->attach(client.root);
}

void SubscriptionCore::unfollow(const SubscriptionFollower* follower) {
  std::erase_if(followers_, [&](const auto& each) { return each.get() == follower; });
}

// Whoever is called here may close the subscription, or let go of it.

void SubscriptionCore::handle_connected(const AsyncObject& root, const ServiceSubscriptionClientId& id) {
  const auto keep = shared_from_this();
  clients_.push_back({id, root});
  for (const auto& follower : std::vector(followers_)) follower->attach(root);
  if (const auto handler = connected) call_handler("connected", [&] { handler(root); });
  if (!is_closed_) waiters_.complete_all(root);
}

void SubscriptionCore::handle_lost(const AsyncObject& root, const Error& reason) {
  const auto keep = shared_from_this();
  std::erase_if(clients_, [&](const Client& client) { return client.root.connection() == root.connection(); });
  for (const auto& follower : std::vector(followers_)) follower->detach(root);
  if (const auto handler = lost) call_handler("lost", [&] { handler(root, reason); });
}

void SubscriptionCore::handle_failed(const Error& error, const std::string& url) {
  const auto keep = shared_from_this();
  if (const auto handler = failed) call_handler("failed", [&] { handler(error, url); });
}

void SubscriptionCore::call_handler(std::string_view kind, const std::function<void()>& call) const {
  try {
    call();
  } catch (...) {
    const auto problem = describe_failure("subscription", kind, handler_error(std::current_exception()));
    if (const auto& report = options_.connect.report)
      report(problem);
    else
      std::cerr << problem << '\n';
  }
}

void SubscriptionCore::close() {
  if (std::exchange(is_closed_, true)) return;
  const auto keep = shared_from_this();
  connected = nullptr;
  lost = nullptr;
  failed = nullptr;
  freed_ = nullptr;
  if (const auto ended = std::exchange(ended_, nullptr)) ended();
  for (const auto& follower : std::exchange(followers_, {})) follower->end();
  for (const auto& [id, link] : std::exchange(links_, {})) link->close();
  clients_.clear();
  waiters_.complete_all(subscription_closed());
}

}  // namespace rr::detail
