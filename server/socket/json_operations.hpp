// What a client of a JSON WebSocket asks for, and what is open for it. Layer: server/socket. See docs/http-api.md.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "server/access/standing.hpp"
#include "server/limits/outbox.hpp"
#include "server/socket/json_members.hpp"
#include "server/socket/json_questions.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

/// Which object a socket is about, in which form.
struct JsonSocketPlace {
  std::shared_ptr<Device> device;
  StandingPtr standing;  ///< of the gateway's users
  ClientOrigin from;
  SessionKey key;
  std::vector<std::string> segments;  ///< below the service's root
  rr::JsonForm form;
  std::string trace;  ///< W3C trace id of the upgrade; empty: none
};

/// Lives in a shared_ptr, which the requests under way keep. For the gateway's thread.
class JsonOperations : public std::enable_shared_from_this<JsonOperations> {
 public:
  JsonOperations(GatewayState& gateway, JsonSocketPlace place, std::shared_ptr<Outbox> outbox);

  /// Begins what one message asks for, and waits for a login alone: what a device does not answer stops no message
  /// behind it, which may be to stop the device. Packets are sent one after the other.
  rr::awaitable<void> take(const std::string& message);
  /// Ends subscriptions and callbacks that the client has no right to any more, and gives back what it may not lock.
  void review();
  /// Ends what is open. What is under way ends by itself, and answers nobody.
  void stop();

 private:
  using Perform = rr::awaitable<rr::OrderedJson> (JsonOperations::*)(JsonRequestPtr request, TargetPtr target);
  struct Traits {
    bool has_target = true;    ///< the request names an object or a member by its path
    bool needs_own = false;    ///< to be a client of its own
    bool keeps_order = false;  ///< goes behind those before it that do
    bool comes_first = false;  ///< the next message waits for it
    bool gives_back = false;   ///< what is the client's own: needs no right, and is never too much
    bool asks_shape = false;   ///< see AccessRequest::is_shape
    bool is_free = false;      ///< of bounds on requests: packets, and what ends something
    Recorded recorded = Recorded::each_time;
  };
  struct Operation {
    std::string_view name;
    Verb verb;
    Perform perform;
    Traits traits = {};
  };
  static const Operation operations[];
  /// For all names of which there is none; under the same bounds as others, and then refused.
  static const Operation unknown_operation;
  static const Operation& operation_of(const JsonRequest& request);

  /// What a request has opened; named by its id.
  struct Subscription {
    ValueClient::ListenerPtr listener;
    std::string path;  ///< of the object
    std::string member;
  };
  struct Generator {
    TargetPtr target;
    rr::GeneratorId id = 0;
  };
  struct Pending {};
  struct Open {
    explicit Open(std::shared_ptr<Outbox> outbox) : opening(std::move(outbox)) {}

    OutboxOpening opening;
    std::variant<Pending, Subscription, Generator> what;
  };
  /// An id, and which of all that have it one after the other.
  struct Reserved {
    std::string id;
    Outbox::Token token = 0;
  };
  struct Packet {
    JsonRequestPtr request;
    const Operation& operation;
    MemoryBudget::Charge memory;
  };

  using Passes = std::shared_ptr<const HttpAccess::Passes>;
  static rr::awaitable<void> run(std::shared_ptr<JsonOperations> self, JsonRequestPtr request,
                                 const Operation& operation, Passes passes, MemoryBudget::Charge memory);
  /// Sends a packet behind those that wait, or refuses it where too many do.
  rr::awaitable<void> queue(Packet packet);
  static rr::awaitable<void> send_queued(std::shared_ptr<JsonOperations> self);
  rr::awaitable<rr::OrderedJson> perform(JsonRequestPtr request, const Operation& operation);
  rr::awaitable<TargetPtr> find(JsonRequestPtr request, const Operation& operation);
  /// Throws   rr::Exception: there is no right to it, or it can't be recorded.
  AuditEntryPtr admit(const Target& target, const Operation& operation);
  rr::awaitable<std::shared_ptr<ValueClient>> client();
  rr::awaitable<std::shared_ptr<ValueClient>> shared_client();
  /// See LeaseConfig::is_urgent().
  bool is_urgent(const JsonRequest& request, const Operation& operation) const;
  JsonMaking making() const { return {gateway_.workers(), place_.form}; }
  void tell_error(const std::string& id, const rr::Error& error);

  /// To a function of json_members.hpp.
  template <auto Answer>
  rr::awaitable<rr::OrderedJson> pass_on(JsonRequestPtr request, TargetPtr target);
  rr::awaitable<rr::OrderedJson> open(JsonRequestPtr request, TargetPtr target);
  rr::awaitable<rr::OrderedJson> next(JsonRequestPtr request, TargetPtr);
  rr::awaitable<rr::OrderedJson> close(JsonRequestPtr request, TargetPtr);
  rr::awaitable<rr::OrderedJson> abort(JsonRequestPtr request, TargetPtr);
  rr::awaitable<rr::OrderedJson> subscribe(JsonRequestPtr request, TargetPtr target);
  rr::awaitable<rr::OrderedJson> unsubscribe(JsonRequestPtr request, TargetPtr);
  rr::awaitable<rr::OrderedJson> send(JsonRequestPtr request, TargetPtr target);
  rr::awaitable<rr::OrderedJson> callback(JsonRequestPtr request, TargetPtr target);
  rr::awaitable<rr::OrderedJson> answer(JsonRequestPtr request, TargetPtr);
  rr::awaitable<rr::OrderedJson> login(JsonRequestPtr request, TargetPtr);
  rr::awaitable<rr::OrderedJson> refuse_unknown(JsonRequestPtr request, TargetPtr);

  /// Takes the request's id for what it opens. Throws   rr::Exception: no id, one that is in use, too many.
  Reserved reserve(const JsonRequest& request);
  /// Null: it was ended meanwhile, and the id may be another one's.
  Open* find_open(const Reserved& reserved);
  /// The id is free again, unless it is another one's.
  void drop_open(const Reserved& reserved);
  /// Keeps what a reserved id has opened. Throws   rr::Exception: it could not be opened, and the id is free again; or
  /// it was ended meanwhile.
  void keep(const Reserved& reserved, rr::Result<ValueClient::ListenerPtr> listener, const Target& target);
  struct Step {
    Generator generator;
    Reserved reserved;
  };
  Step generator_of(const JsonRequest& request);
  rr::awaitable<rr::OrderedJson> end_generator(JsonRequestPtr request, rr::CallKind how);

  GatewayState& gateway_;
  JsonSocketPlace place_;
  std::shared_ptr<Outbox> outbox_;
  std::shared_ptr<ValueClient> own_;  ///< once something needs it; then everything uses it
  std::map<std::string, Open> open_;
  std::map<std::pair<std::string, std::string>, ValueClient::ListenerPtr> senders_;  ///< hold what is sent on
  JsonQuestions questions_;
  std::deque<Packet> packets_;  ///< that wait; the first one is on its way
  std::chrono::steady_clock::time_point last_sent_;
  boost::asio::steady_timer sent_;  ///< cancelled when a packet was sent
  std::size_t running_ = 0;
  bool is_stopped_ = false;
};

}  // namespace rrgate
