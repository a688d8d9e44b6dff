// A service for as long as it is wanted, whatever becomes of connections. Layer: node/subscribe. Source: sessions spec
// section 2.17.
//
//   auto thermostat = rr::subscribe_service(io, "rr+tcp://127.0.0.1:52230/?service=Thermostat");
//   auto reading = thermostat.wire("reading");            // goes on from one connection to the next
//   const auto client = co_await thermostat.client(std::chrono::seconds(5));
//   co_await client.set("target", 21.0);
//   const auto now = co_await reading.next();
//
// By type, as they are found on the network: rr::subscribe_service_by_type() in
// node/subscribe/subscribe_service_by_type.hpp.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "node/client/async_stub.hpp"
#include "node/subscribe/member_subscription.hpp"
#include "node/subscribe/subscription_core.hpp"

namespace rr {

struct MemberSubscriptionOptions {
  std::string path = "*";  ///< of the object: "*" is the root, "*.arm" one of its object references
  /// Of what waits for PipeSubscription::next(): of more the oldest are dropped, of bytes all but the newest.
  std::size_t packet_limit = 10'000;
  std::size_t byte_limit = 64u << 20;
};

/// A wire with the C++ type of generated classes; next() has the value as it came.
template <class T>
class TypedWireSubscription : public WireSubscription {
 public:
  explicit TypedWireSubscription(WireSubscription wire) : WireSubscription(std::move(wire)) {}
  /// nullopt before the first value.
  std::optional<T> value() const {
    return newest() ? std::optional<T>(unpack_value<T>(newest()->value)) : std::nullopt;
  }
  /// handler(T) gets each value. One handler.
  template <class F>
  void on_value(F handler) {
    WireSubscription::on_value([handler = std::move(handler)](const ReceivedValue& received) mutable {
      handler(unpack_value<T>(received.value));
    });
  }
};

/// The same for a pipe.
template <class T>
class TypedPipeSubscription : public PipeSubscription {
 public:
  explicit TypedPipeSubscription(PipeSubscription pipe) : PipeSubscription(std::move(pipe)) {}
  /// handler(T) gets each packet, and next() none. One handler.
  template <class F>
  void on_packet(F handler) {
    PipeSubscription::on_packet([handler = std::move(handler)](const ReceivedValue& received) mutable {
      handler(unpack_value<T>(received.value));
    });
  }
};

/// Services that are wanted; owns its connections. Calls that are under way when one is lost fail: they are not
/// repeated. For the thread of its io_context, which must outlive it.
class ServiceSubscription {
 public:
  explicit ServiceSubscription(std::shared_ptr<detail::SubscriptionCore> core) : core_(std::move(core)) {}
  ServiceSubscription(ServiceSubscription&&) noexcept = default;
  ServiceSubscription& operator=(ServiceSubscription&& other) noexcept {
    std::swap(core_, other.core_);
    return *this;
  }
  ~ServiceSubscription() {
    if (core_) core_->close();
  }

  /// The root object of the connection that has been up longest; nullopt while there is none. Another one after each
  /// loss.
  std::optional<AsyncObject> default_client() const { return core_->default_client(); }
  /// All root objects.
  std::map<ServiceSubscriptionClientId, AsyncObject> clients() const { return core_->clients(); }
  /// The default client as soon as there is one; waits for `timeout`, or for ever. Completes with an AsyncObject.
  /// Throws ClientException request_timeout, invalid_operation (closed).
  template <class Token = boost::asio::use_awaitable_t<>>
  auto client(std::optional<std::chrono::milliseconds> timeout = std::nullopt, Token&& token = {}) const {
    return detail::wait_in<AsyncObject>(core_, core_->client_waiters(), core_->io_context().get_executor(), token,
                                        [timeout](detail::SubscriptionCore& core, auto done) {
                                          return core.wait_for_client(timeout, std::move(done));
                                        });
  }

  /// Hears of each new root object, and now of those that are there. One handler, as for the others.
  void on_connected(std::function<void(const AsyncObject& client)> handler);
  /// Hears of each connection that ends, but not by close(), and why.
  void on_lost(std::function<void(const AsyncObject& client, const Error& reason)> handler) {
    core_->lost = std::move(handler);
  }
  /// Hears of each URL that an attempt could not connect to.
  void on_failed(std::function<void(const Error& error, const std::string& url)> handler) {
    core_->failed = std::move(handler);
  }

  /// A wire of all clients. Once for each wire: a client has one connection of it.
  WireSubscription wire(std::string member, const MemberSubscriptionOptions& options = {}) const;
  PipeSubscription pipe(std::string member, const MemberSubscriptionOptions& options = {}) const;
  /// The same by the member of a generated class: wire(&ThermostatAsyncClient::reading).
  template <class Client, class T, MemberDirection direction>
  TypedWireSubscription<T> wire(AsyncWire<T, direction> (Client::*member)() const,
                                const MemberSubscriptionOptions& options = {}) const {
    return TypedWireSubscription<T>(wire(std::string((Client().*member)().name()), options));
  }
  template <class Client, class T, MemberDirection direction>
  TypedPipeSubscription<T> pipe(AsyncPipe<T, direction> (Client::*member)() const,
                                const MemberSubscriptionOptions& options = {}) const {
    return TypedPipeSubscription<T>(pipe(std::string((Client().*member)().name()), options));
  }

  /// Ends connections and attempts, its wires and pipes, and whoever waits for it. Services are told, which takes half
  /// a second at most.
  void close() { core_->close(); }
  bool is_closed() const { return core_->is_closed(); }

 private:
  std::shared_ptr<detail::SubscriptionCore> core_;
};

/// Stays connected to a service: connects, and connects again after each loss, until it is closed or destroyed.
/// `urls`   one service, or several ways to it; each attempt tries them in order.
/// Throws   std::invalid_argument: URLs that name different services, or none; not a URL. What fails later is told to
///          on_failed() and tried again.
ServiceSubscription subscribe_service(boost::asio::io_context& io, std::vector<std::string> urls,
                                      SubscriptionOptions options = {});
ServiceSubscription subscribe_service(boost::asio::io_context& io, std::string url, SubscriptionOptions options = {});

}  // namespace rr
