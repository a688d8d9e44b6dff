// What a ServiceSubscription does: connects to services, again after each loss, and tells who follows. Layer:
// node/subscribe. Source: sessions spec section 2.17. For users there is service_subscription.hpp.
#pragma once

#include <boost/asio/io_context.hpp>
#include <compare>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "node/client/async_object.hpp"
#include "node/client/waiters.hpp"
#include "node/values/shared_function.hpp"

namespace rr {

struct SubscriptionOptions {
  ConnectOptions connect = {};  ///< for each connection
  std::chrono::milliseconds first_retry{500};
  std::chrono::milliseconds longest_retry{30'000};
  std::chrono::milliseconds next_url_after{250};  ///< of several URLs: the next one is tried beside those before it
  std::chrono::milliseconds member_retry{2'500};  ///< wires and pipes that could not be connected, or were closed
  std::size_t max_clients = 32;                   ///< services at a time, those that are being tried included
};

/// Which service of which node (ServiceSubscriptionClientID of the reference).
struct ServiceSubscriptionClientId {
  NodeId node_id;
  std::string service_name;
  auto operator<=>(const ServiceSubscriptionClientId&) const = default;
};

/// A service that a subscription is to be connected to.
struct WantedService {
  ServiceSubscriptionClientId id;
  std::vector<std::string> urls;  ///< in the order in which they are tried; not empty
  std::string username = {};      ///< instead of the one of the options
  Value credentials = {};
};

namespace detail {

/// A wire or pipe that follows the clients of a subscription.
class SubscriptionFollower {
 public:
  virtual ~SubscriptionFollower() = default;
  virtual void attach(const AsyncObject& root) = 0;
  virtual void detach(const AsyncObject& root) = 0;
  virtual void end() = 0;  ///< of the subscription; attached clients are still there
};

class SubscriptionLink;

/// Everything runs on the thread of the io_context. After close() it does nothing and calls nobody.
class SubscriptionCore : public std::enable_shared_from_this<SubscriptionCore> {
 public:
  SubscriptionCore(boost::asio::io_context& io, SubscriptionOptions options);

  // --- which services ---

  /// Wants a service, or hears of other ways to it. Returns false where there are max_clients others.
  bool offer(WantedService service);
  /// The service is not there any more: it goes with its connection, at once where there is none.
  void withdraw(const ServiceSubscriptionClientId& id);
  /// `ended` is called once, by close().
  void on_ended(std::function<void()> ended) { ended_ = std::move(ended); }
  /// `freed` is called when a service has gone: another one may be offered in its place.
  void on_freed(std::function<void()> freed) { freed_ = std::move(freed); }

  // --- for the user ---

  std::optional<AsyncObject> default_client() const;
  std::map<ServiceSubscriptionClientId, AsyncObject> clients() const;
  /// Completes at once, or is one of client_waiters().
  std::optional<Waiters<AsyncObject>::Id> wait_for_client(std::optional<std::chrono::milliseconds> timeout,
                                                          Waiters<AsyncObject>::Done done);
  Waiters<AsyncObject>& client_waiters() { return waiters_; }
  void close();
  bool is_closed() const { return is_closed_; }

  SharedFunction<void(const AsyncObject&)> connected;
  SharedFunction<void(const AsyncObject&, const Error&)> lost;
  SharedFunction<void(const Error&, const std::string& url)> failed;

  /// Attaches it to the clients that are there. Not for a closed subscription.
  void follow(std::shared_ptr<SubscriptionFollower> follower);
  void unfollow(const SubscriptionFollower* follower);
  /// Calls a handler of the user. What it throws is reported, and the subscription goes on.
  void call_handler(std::string_view kind, const std::function<void()>& call) const;

  boost::asio::io_context& io_context() { return io_; }
  const SubscriptionOptions& options() const { return options_; }

 private:
  friend class SubscriptionLink;

  void handle_connected(const AsyncObject& root, const ServiceSubscriptionClientId& id);
  void handle_lost(const AsyncObject& root, const Error& reason);
  void handle_failed(const Error& error, const std::string& url);
  void forget(const ServiceSubscriptionClientId& id);

  struct Client {
    ServiceSubscriptionClientId id;
    AsyncObject root;
  };

  boost::asio::io_context& io_;
  SubscriptionOptions options_;
  std::map<ServiceSubscriptionClientId, std::shared_ptr<SubscriptionLink>> links_;
  std::vector<Client> clients_;  ///< the one that is connected longest first
  std::vector<std::shared_ptr<SubscriptionFollower>> followers_;
  Waiters<AsyncObject> waiters_;
  std::function<void()> ended_;
  std::function<void()> freed_;
  bool is_closed_ = false;
};

inline Error subscription_closed() {
  return make_error(ErrorCode::invalid_operation, "the subscription is closed");
}

}  // namespace detail
}  // namespace rr
