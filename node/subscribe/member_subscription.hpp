// Wires and pipes of a subscription: they go on from one connection to the next. Layer: node/subscribe.
// Source: sessions spec section 2.17.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "node/subscribe/subscription_core.hpp"

namespace rr {

/// A value of a wire, or a packet of a pipe, and where it came from.
struct ReceivedValue {
  ReceivedValue() = default;
  ReceivedValue(Value value_, TimeSpec time_, AsyncObject client_)
      : value(std::move(value_)), time(time_), client(std::move(client_)) {}

  Value value;
  TimeSpec time = {};  ///< that the service gave it; of a packet: none
  AsyncObject client;  ///< root object
};

namespace detail {

/// What wires and pipes have in common: connects the member of each client, again where that failed or the service
/// closed it.
class MemberFollower : public SubscriptionFollower, public std::enable_shared_from_this<MemberFollower> {
 public:
  /// `path`  of the object: "*" is the root, "*.arm" one of its object references.
  MemberFollower(std::shared_ptr<SubscriptionCore> core, std::string member, std::string path);

  void start();
  void close();
  bool is_closed() const { return is_closed_; }
  std::size_t connected_count() const;
  /// To every client that the member is connected of. Returns to how many.
  /// Errors   invalid_operation: to none; of sending, where that failed everywhere.
  Result<std::size_t> send(const Value& value);
  const std::string& member() const { return member_; }
  const std::string& path() const { return path_; }
  const std::shared_ptr<SubscriptionCore>& core() const { return core_; }
  const std::deque<ReceivedValue>& queue() const { return queue_; }

  /// Completes with what comes next, or is one of waiters().
  std::optional<Waiters<ReceivedValue>::Id> wait_for_next(std::optional<std::chrono::milliseconds> timeout,
                                                          Waiters<ReceivedValue>::Done done);
  Waiters<ReceivedValue>& waiters() { return waiters_; }

  SharedFunction<void(const ReceivedValue&)> received;
  SharedFunction<void(const AsyncObject& client, const Error&)> failed;

 protected:
  /// One client's object that has the member.
  struct Place {
    AsyncObject root;
    std::string path;
    std::int32_t index = 0;  ///< of the pipe endpoint
    RequestId request = 0;   ///< that has connected it
    bool is_connected = false;
    std::unique_ptr<boost::asio::steady_timer> retry = nullptr;
  };
  using PlaceId = std::uint64_t;

  virtual RequestId connect(PlaceId id, const Place& place, ClientConnection::Completion done) = 0;
  virtual void disconnect(const Place& place) = 0;
  virtual Result<> send_to(const Place& place, const Value& value) = 0;
  /// Keeps what nobody waits for; `queue` is what waits for the user.
  virtual void keep(std::deque<ReceivedValue>& queue, ReceivedValue value) = 0;
  /// The first of the queue goes to the user.
  virtual void note_taken(const ReceivedValue&) {}

  void handle_received(PlaceId id, Value value, TimeSpec time);
  void handle_closed(PlaceId id);

 private:
  void attach(const AsyncObject& root) final;
  void detach(const AsyncObject& root) final;
  void end() final;
  void begin(PlaceId id);
  void connect_member(PlaceId id);
  void handle_failed(PlaceId id, const Error& error);

  std::shared_ptr<SubscriptionCore> core_;
  std::string member_;
  std::string path_;
  std::map<PlaceId, Place> places_;
  PlaceId last_place_ = 0;
  Waiters<ReceivedValue> waiters_;
  std::deque<ReceivedValue> queue_;
  bool is_closed_ = false;
};

class WireFollower final : public MemberFollower {
 public:
  using MemberFollower::MemberFollower;
  std::optional<ReceivedValue> newest;

 private:
  RequestId connect(PlaceId id, const Place& place, ClientConnection::Completion done) override;
  void disconnect(const Place& place) override;
  Result<> send_to(const Place& place, const Value& value) override;
  void keep(std::deque<ReceivedValue>& queue, ReceivedValue value) override;
};

class PipeFollower final : public MemberFollower {
 public:
  PipeFollower(std::shared_ptr<SubscriptionCore> core, std::string member, std::string path, std::size_t packet_limit,
               std::size_t byte_limit)
      : MemberFollower(std::move(core), std::move(member), std::move(path)),
        packet_limit_(packet_limit),
        byte_limit_(byte_limit) {}
  std::uint64_t dropped = 0;

 private:
  RequestId connect(PlaceId id, const Place& place, ClientConnection::Completion done) override;
  void disconnect(const Place& place) override;
  Result<> send_to(const Place& place, const Value& value) override;
  void keep(std::deque<ReceivedValue>& queue, ReceivedValue value) override;
  void note_taken(const ReceivedValue& value) override;

  std::size_t packet_limit_;
  std::size_t byte_limit_;
  std::size_t bytes_ = 0;  ///< of what waits
};

}  // namespace detail

/// What WireSubscription and PipeSubscription share. Destroyed, or closed with its service's subscription, it ends.
template <class Follower>
class MemberSubscription {
 public:
  explicit MemberSubscription(std::shared_ptr<Follower> follower) : follower_(std::move(follower)) {}
  MemberSubscription(MemberSubscription&&) noexcept = default;
  MemberSubscription& operator=(MemberSubscription&& other) noexcept {
    std::swap(follower_, other.follower_);
    return *this;
  }
  ~MemberSubscription() {
    if (follower_) follower_->close();
  }

  /// The next one; waits for `timeout`, or for ever. Completes with a ReceivedValue. Throws ClientException
  /// request_timeout, invalid_operation (closed).
  template <class Token = boost::asio::use_awaitable_t<>>
  auto next(std::optional<std::chrono::milliseconds> timeout = std::nullopt, Token&& token = {}) {
    return detail::wait_in<ReceivedValue>(
        follower_, follower_->waiters(), follower_->core()->io_context().get_executor(), token,
        [timeout](Follower& follower, auto done) { return follower.wait_for_next(timeout, std::move(done)); });
  }
  /// Sends to all clients that it is connected of. Returns to how many.
  /// Errors   invalid_operation: to none, nothing is kept for later; those of sending, where it worked with none.
  Result<std::size_t> send(const Value& value) { return follower_->send(value); }
  /// Of how many clients the member is connected.
  std::size_t connected_count() const { return follower_->connected_count(); }
  /// Hears each time that the member of a client could not be connected, or was closed by the service; it is tried
  /// again. One handler.
  void on_failed(std::function<void(const AsyncObject& client, const Error& error)> handler) {
    follower_->failed = std::move(handler);
  }
  void close() { follower_->close(); }
  bool is_closed() const { return follower_->is_closed(); }

 protected:
  std::shared_ptr<Follower> follower_;
};

/// The newest value of a wire of all clients, by arrival.
class WireSubscription : public MemberSubscription<detail::WireFollower> {
 public:
  using MemberSubscription::MemberSubscription;

  /// Stays while there is no connection; nullopt before the first.
  const std::optional<ReceivedValue>& newest() const { return follower_->newest; }
  /// Gets each value. One handler; next() works beside it.
  void on_value(std::function<void(const ReceivedValue&)> handler) { follower_->received = std::move(handler); }
};

/// The packets of a pipe of all clients, in order for each; those that a service sends meanwhile are not there.
class PipeSubscription : public MemberSubscription<detail::PipeFollower> {
 public:
  using MemberSubscription::MemberSubscription;

  /// Gets each packet, and next() none. One handler.
  void on_packet(std::function<void(const ReceivedValue&)> handler) { follower_->received = std::move(handler); }
  /// How many packets wait for next().
  std::size_t available() const { return follower_->queue().size(); }
  /// The oldest packets, where more waited than the limit.
  std::uint64_t dropped() const { return follower_->dropped; }
};

}  // namespace rr
