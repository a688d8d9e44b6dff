// One session with a service of a device, used for several clients. Layer: server/upstream.
// Source: sessions spec section 2.20, "one shared upstream session".
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/session/service/service_session.hpp"
#include "node/client/client_connection.hpp"
#include "server/access/identity.hpp"
#include "server/upstream/callback_routes.hpp"
#include "server/upstream/device.hpp"
#include "server/upstream/service_locks.hpp"
#include "server/upstream/shared_reads.hpp"

namespace rrgate {

/// For requests whose answer nobody waits for.
inline constexpr auto ignore_result = [](const rr::Result<rr::Value>&) {};

/// Whether a session with another login may get what was refused.
bool is_refusal(const rr::Error& error);

/// An object of the device. What its members do is asked of the device.
class SharedObject final : public rr::ServiceObject {
 public:
  SharedObject(std::string path, std::string type) : path_(std::move(path)), type_(std::move(type)) {}
  const std::string& path() const { return path_; }
  const std::string& type_name() const override { return type_; }
  rr::Result<std::shared_ptr<rr::ServiceObject>> find_child(const rr::MemberDefinition&,
                                                            const std::optional<std::string>&) override {
    return rr::make_error(rr::ErrorCode::object_not_found, "not looked up yet");
  }

 private:
  std::string path_;
  std::string type_;
};

class Upstream;

/// What an upstream tells a client of it.
class UpstreamClient {
 public:
  /// Ends when the client does.
  virtual std::weak_ptr<const void> life() const = 0;
  /// Whose user locks are this client's too.
  virtual Subject lock_user() const { return {}; }
  /// Of its identity at the gateway: who may take leases over.
  virtual bool has_role(std::string_view) const { return false; }
  /// What is to be recorded of the end of its lease; null: nothing.
  virtual AuditEntryPtr begin_lease_end(const std::string&) const { return nullptr; }
  /// Whether it may have a lock or a lease of an object still, as its rights are now; see ServiceLocks::review().
  virtual bool may_lock(const std::string&) const { return true; }
  /// Whether it may write or call anything at or below an object still: who may not has no use for its lease.
  virtual bool may_command(const std::string&) const { return true; }
  /// Its lease has ended. `safe`  what the device answers to that.
  virtual void lease_ended(const std::string&, const std::string&, const SafeAnswerPtr&) const {}
  /// The one that its requests go by.
  virtual std::shared_ptr<Upstream> upstream_in_use() const = 0;
  /// Whether the device may ask it by this callback.
  virtual bool may_answer(const std::string& path, const rr::MemberDefinition& callback) const = 0;
  // What many are sent one after the other: `now`, which it is sent at, is read once for several of them.
  virtual void receive_event(rr::EventPacket& packet, rr::Now now) = 0;
  virtual void receive_wire(rr::WirePacket& packet, rr::Now now) = 0;
  virtual void answer_wire(const std::string& path, const rr::MemberDefinition& wire, const rr::Result<>& result) = 0;
  /// So many values were replaced by the one that comes next.
  virtual void note_conflated(const std::string& path, const rr::MemberDefinition& wire, std::uint64_t count) = 0;
  /// Also where it was not answered yet.
  virtual void close_wire(const std::string& path, const rr::MemberDefinition& wire) = 0;
  virtual void accept_pipe(rr::PipeId id) = 0;
  virtual void refuse_pipe(rr::PipeId id, const rr::Error& error) = 0;
  virtual void receive_packet(rr::PipeId id, rr::SharedPipePacket& packet, rr::Now now) = 0;
  /// Whether much waits for its stream: what it has joined should be sent no faster than it reads. It says with
  /// Upstream::pace() when this has changed.
  virtual bool is_behind() const = 0;
  /// Packets of its own have arrived.
  virtual void acknowledge_packets(rr::PipeId id, std::span<const std::uint32_t> numbers) = 0;
  virtual void close_pipe(rr::PipeId id) = 0;
  virtual void release_path(const std::string& path) = 0;
  virtual void call_callback(const std::string& path, const rr::MemberDefinition& callback,
                             std::span<const rr::Value> arguments, rr::ClientConnection::CallbackReply answer) = 0;
  /// The device is away. Wires and pipes are answered anew once they are joined again.
  virtual void connection_lost(const rr::Error&) {}
  /// The device is back, and this object with it.
  virtual void found_again(const std::string&) {}

 protected:
  ~UpstreamClient() = default;
};

/// Who uses a session with a device.
enum class UpstreamUse : std::uint8_t {
  all_clients,  ///< with the login that is for all services of a device
  one_user,     ///< who has given a login for this service
  one_client,
};

/// All of it runs on the gateway's thread. Paths are the device's and the clients' alike: the service has one name.
class Upstream : public std::enable_shared_from_this<Upstream> {
 public:
  using Completion = rr::ClientConnection::Completion;

  Upstream(std::shared_ptr<Device> device, std::string service, UpstreamLogin login,
           UpstreamUse use = UpstreamUse::all_clients);
  ~Upstream();
  Upstream(const Upstream&) = delete;
  Upstream& operator=(const Upstream&) = delete;

  /// Connects, and attaches again what clients had joined. Errors   those of reaching the device and of the login.
  rr::awaitable<rr::Result<>> open();
  /// Opens it, again and again, until close(). `is_used`: says whether a session that was opened is of use.
  void keep_open(std::function<rr::Result<>()> is_used = nullptr);
  /// The same, but without clients for this time it rests: the device has no session to keep. Until the first client
  /// comes it is opened to see what there is, and rests at once.
  void rest_unused(std::chrono::milliseconds after) { rests_after_ = after; }
  bool is_resting() const { return stage_ == Stage::resting; }
  bool is_attempting() const { return stage_ == Stage::attempting; }  ///< it is being opened
  /// Whether it stays open though none of its own clients uses it.
  void hold(bool is_held);
  /// A client is about to come: opened again where it rests, and open for the whole time without clients from now on.
  void wake();
  /// The device answers again: one that waits for its next attempt makes it now.
  void retry_now();
  /// Whether the first attempt to open it, or to open it again after a rest, is over, well or not.
  bool has_tried() const { return attempts_ > 0 && !is_waking_; }
  /// For one that is kept open: waits for an attempt that is under way, or begins one now. Errors   those of open().
  rr::awaitable<rr::Result<>> opened();
  /// As soon as the last client has left, close() follows; or not any more.
  void close_unused(bool closes) { closes_unused_ = closes; }
  bool has_clients() const { return !clients_.empty(); }
  /// `closed`  is called once the device knows, or after half a second.
  void close(std::function<void()> closed = nullptr);
  /// Ends the session with the device as if it were lost.
  void break_off();
  bool is_open() const { return connection_ != nullptr; }
  /// Also while the session has ended, and says so next: what failed has failed by that.
  bool is_lost() const;
  /// For good: whoever wants more of the service begins anew.
  bool is_closed() const { return is_closed_; }
  Device& device() const { return *device_; }
  const std::string& service() const { return service_; }
  /// What the service is made of, and what its objects have brought since: the same as long as the device says the
  /// same, with or without a session. Null before the first.
  const std::shared_ptr<rr::TypeRegistry>& types() const { return types_; }
  /// The type of an object that was found, from types(). Null: it was not, or there is no session.
  const rr::EntityDefinition* object_type(const std::string& path) const;
  /// Adds to types() what another session with the service has found.
  void take_over_definitions(const rr::TypeRegistry& from);
  /// Whether the service is for users who have logged in, and this session is nobody's.
  bool requires_user() const { return requires_user_; }
  /// Whether it is open, and the device lets it do anything.
  bool may_act() const { return !is_lost() && !requires_user_; }
  /// Null while it is not open.
  const std::shared_ptr<rr::ClientConnection>& connection() const { return connection_; }
  /// What requests fail with while the device is away.
  rr::Error lost_error() const;
  /// Why there is no session, where the last attempt to open one has failed; nullopt also: there is no such service.
  /// Errors   connection_error.
  std::optional<rr::Error> failure() const;
  rr::Error lost_error(const std::optional<rr::Error>& reason) const;
  /// The objects at and below a path were replaced.
  void on_released(std::function<void(const std::string& path)> handler) { on_released_ = std::move(handler); }
  /// types() is another one, since the device defines something that was known in another way now. Called later, not
  /// by whoever has found that out.
  void on_types_replaced(std::function<void()> handler) { on_types_replaced_ = std::move(handler); }

  void add(UpstreamClient& client);
  /// Ends all that the client has here. `left`  is called once the device has its locks back, maybe at once.
  void remove(UpstreamClient& client, std::function<void()> left = nullptr);
  /// The client goes on as another user: what it has locked is given back.
  void change_user(UpstreamClient& client);

  /// Another session of this service has found an object: this one hears what becomes of it, too.
  void note_object(const std::string& path, const std::string& type);
  /// Completes with the object's type. Errors   those of the device; invalid_argument: an index of a plain objref.
  void find_object(const std::string& path, Completion done);
  /// Asks the device; the object of the call is a SharedObject that find_object() has found here.
  void request(UpstreamClient& client, const rr::Called& called, Completion done);
  bool has_generator(UpstreamClient& client, rr::GeneratorId id) const { return generators_.contains({&client, id}); }
  /// A generator of this client that is over without having been closed.
  void drop_generator(UpstreamClient& client, rr::GeneratorId id);
  /// Of the client, not of the session: other clients are kept out by the gateway.
  void lock(UpstreamClient& client, const rr::LockWanted& wanted, std::function<void(const rr::Result<>&)> done);

  /// See ServiceLocks::review().
  void review_locks(const UpstreamClient& client) { locks_->review(client); }
  /// See ServiceLocks::has_at().
  bool has_lock(const UpstreamClient& client, std::string_view path) const { return locks_->has_at(client, path); }

  /// The gateway stops, or shares the device no more: the device is made safe where a lease is held.
  void end_leases(const std::string& why) { locks_->end_leases(why); }

  /// See ServiceLocks::make_safe().
  void stop_object(std::string_view path, std::function<void(const rr::Result<>&)> done) {
    locks_->make_safe(path, std::move(done));
  }

  // For ServiceLocks.
  std::uint64_t number() const { return number_; }
  bool is_for_one_client() const { return use_ == UpstreamUse::one_client; }
  void ask_for_lock(rr::LockCommand command, const std::string& path, std::chrono::milliseconds timeout,
                    Completion done);

  /// Drops what clients have sent to wires at and below a path and the device has not been sent yet: they command no
  /// more. What passes all locks and leases stays.
  void forget_commands(std::string_view path);
  /// Sent past whatever waits, and once more behind it where something waits.
  void make_safe(const SafeRequest& request, Completion done);

  /// Answered with answer_wire(). A client that joins a wire gets the newest value at once.
  void join_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& wire);
  void leave_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& wire);
  /// Errors   those of packing; without a session the newest is sent once there is one.
  /// Also object_locked_error: another client has the lease.
  rr::Result<> send_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& wire,
                         const rr::Value& value);

  /// Clients of a readonly pipe share one endpoint at the device; others have one each. Answered with accept_pipe() or
  /// refuse_pipe().
  void join_pipe(UpstreamClient& client, rr::PipeId id, const std::string& path, const rr::MemberDefinition& pipe);
  void leave_pipe(UpstreamClient& client, rr::PipeId id);
  /// What the device does not take, or can't because it is away, ends the endpoint; that is the error, too.
  /// `wants_ack`  the client's number of the packet, for acknowledge_packets(), where it wants to hear of it.
  rr::Result<> send_pipe(UpstreamClient& client, rr::PipeId id, const rr::Value& packet,
                         std::optional<std::uint32_t> wants_ack);
  /// The client is behind now, or not any more.
  void pace(UpstreamClient& client);
  /// Which of the packets that are on their way will arrive nobody knows: the endpoints that the client has sent on
  /// end.
  void end_sent_pipes(UpstreamClient& client);

 private:
  using MemberKey = std::pair<std::string, std::string>;  // path, member
  using EndpointKey = std::pair<UpstreamClient*, rr::PipeId>;

  /// Of one that is kept open; others wait all the time.
  enum class Stage : std::uint8_t {
    waiting,  ///< for the next attempt
    attempting,
    watched,  ///< it is open, and watch_use() waits
    resting,
  };
  /// Of a wire or pipe, at the device.
  enum class AttachState : std::uint8_t { detached, attaching, attached };
  struct Follower {
    UpstreamClient* client = nullptr;
    std::uint64_t count = 0;  ///< Wire::count of the newest that it was sent
  };
  /// A wire's value as the turns send it: encoded once for all of them.
  struct Outgoing {
    Outgoing(const std::string& path, const rr::MemberDefinition& member, std::shared_ptr<const rr::WireValue> newest,
             rr::TimePoint arrived, std::uint64_t its_count)
        : value(std::move(newest)), packet(path, member, value->value, value->time, arrived), count(its_count) {}

    const std::shared_ptr<const rr::WireValue> value;
    rr::WirePacket packet;
    const std::uint64_t count;  ///< Wire::count of it
  };
  struct OutValue {
    UpstreamClient* sender;  ///< null: it makes the device safe
    rr::Value value;
  };
  struct Wire {
    Wire(std::string its_path, rr::MemberDefinition its_member)
        : path(std::move(its_path)), member(std::move(its_member)) {}

    const std::string path;
    const rr::MemberDefinition member;  ///< a copy: the client that has brought it may leave first
    std::vector<Follower> followers;
    std::size_t next = 0;  ///< before the follower whose turn it is
    std::shared_ptr<const rr::WireValue> newest;
    rr::TimePoint arrived;              ///< of the newest
    std::optional<Outgoing> outgoing;   ///< while hand_out() is at it
    std::uint64_t count = 0;            ///< values that have come
    std::optional<OutValue> out_value;  ///< the newest that could not be sent yet
    AttachState state = AttachState::detached;
    bool is_due = false;  ///< hand_out() is due
  };
  struct Pipe {
    std::string path;
    rr::MemberDefinition member = {};  ///< a copy, as for wires
    std::vector<EndpointKey> endpoints;
    std::int32_t index = 0;
    AttachState state = AttachState::detached;
    bool has_sent = false;                                       ///< packets of its client are with the device
    bool is_held = false;                                        ///< a client is behind: the device hears nothing of it
    std::map<std::uint32_t, std::uint32_t> unacknowledged = {};  ///< number at the device -> that of the one client
  };
  using PipeNumber = std::uint64_t;
  struct Generator {
    std::string path;
    std::string function;
    std::int32_t index = 0;
  };

  /// For what is answered when the upstream has gone.
  static rr::Error session_has_ended();
  rr::awaitable<rr::Result<std::shared_ptr<rr::ClientConnection>>> open_connection(std::string username,
                                                                                   bool is_stepwise);
  rr::awaitable<rr::Result<>> log_in(std::shared_ptr<rr::ClientConnection> connection);
  /// Whether the client is there still: what is told to one may end it.
  bool has(const UpstreamClient& client) const;
  /// Calls `tell` for each client that is there still when it is its turn.
  template <class F>
  void for_each_client(F&& tell) {
    const auto clients = clients_;
    const auto left = clients_left_;
    for (auto* client : clients)
      if (clients_left_ == left || has(*client)) tell(*client);
  }
  static rr::awaitable<void> run(std::shared_ptr<Upstream> self, std::function<rr::Result<>()> is_used);
  /// Until it is lost or closed; returns whether it has had no clients for too long instead.
  rr::awaitable<bool> watch_use();
  rr::awaitable<void> rest();
  void disconnect_when_safe(const std::shared_ptr<rr::ClientConnection>& connection);
  void lost(const rr::Error& reason);
  void tell_lost(const rr::Error& reason);
  rr::Result<> check_index(std::string_view path) const;
  void look_up(const std::string& path, Completion done);
  void watch_object(const std::string& path, const rr::EntityDefinition& type);
  void look_up_again();
  /// `known_type`  what it was before; empty: that is not known.
  void handle_looked_up(const std::string& path, const std::string& known_type, const rr::Result<rr::Value>& found);
  /// What this session knows of the objects at and below a path ends; its clients are told.
  void drop_objects(const std::string& path);
  void handle_released(const std::string& path);
  void begin_request(const UpstreamClient& client, const rr::Called& called, const std::string& path, Completion done);
  void send_safe(const SafeRequest& request, Completion done);
  void answer_generator(UpstreamClient& client, const rr::Called& called, const std::string& path, Completion done);
  /// Of a generator, which has given no value.
  void handle_failed_step(UpstreamClient& client, rr::GeneratorId id, const rr::Error& error);
  void attach_wire(const MemberKey& key);
  bool has_joined(const UpstreamClient& client, const MemberKey& key) const;
  void publish_wire(const MemberKey& key, const rr::Value& value, rr::TimeSpec time);
  void hand_out_later(const std::shared_ptr<Wire>& wire);
  void hand_out(const std::shared_ptr<Wire>& wire);
  /// `reason`  why, for clients that still wait to join; null: they are told by other means.
  void drop_wire(const MemberKey& key, const rr::Error* reason);
  void attach_pipe(PipeNumber number);
  void pipe_attached(PipeNumber number, const std::string& path, const std::string& member,
                     const rr::Result<rr::Value>& result, bool is_first);
  void drop_pipe(PipeNumber number);
  void end_pipe(UpstreamClient& client, rr::PipeId id);
  void end_endpoint(const EndpointKey& endpoint);
  std::vector<PipeNumber> pipes_of(const UpstreamClient& client) const;
  /// Lets the device go on, or not, as the slowest client of the pipe can take it.
  void pace_pipe(PipeNumber number);
  rr::Result<> pass_on(Pipe& pipe, const EndpointKey& endpoint, const rr::Value& packet,
                       std::optional<std::uint32_t> wants_ack);
  void pass_back_acks(PipeNumber number, std::span<const std::uint32_t> numbers);
  void route_callback(const std::string& path, const rr::MemberDefinition& callback,
                      std::span<const rr::Value> arguments, const rr::ClientConnection::CallbackReply& answer);

  std::shared_ptr<Device> device_;
  std::string service_;
  UpstreamLogin login_;
  std::shared_ptr<ServiceLocks> locks_;  ///< of the service, for all of its upstreams
  UpstreamUse use_;
  std::uint64_t number_;  ///< no other upstream has it
  std::shared_ptr<rr::ClientConnection> connection_;
  /// What makes the device safe, and it has not answered. Outlives this.
  struct Unanswered {
    std::size_t count = 0;
    std::function<void()> on_none = {};
  };
  std::shared_ptr<Unanswered> unanswered_ = std::make_shared<Unanswered>();
  std::optional<rr::Error> loss_;
  rr::Result<> last_attempt_;  ///< to open it
  std::uint64_t attempts_ = 0;
  std::chrono::milliseconds rests_after_{0};  ///< without clients; 0: never
  Stage stage_ = Stage::waiting;
  bool is_held_ = false;
  bool is_wanted_ = false;  ///< a client has come, or was about to
  bool is_waking_ = false;  ///< has rested, and the attempt to open it again is not over
  bool is_closed_ = false;
  bool closes_unused_ = false;
  bool requires_user_ = false;
  boost::asio::steady_timer wake_;       ///< what run() waits for
  boost::asio::steady_timer attempted_;  ///< cancelled when an attempt is over
  std::shared_ptr<rr::TypeRegistry> types_;
  std::function<void(const std::string&)> on_released_;
  std::function<void()> on_types_replaced_;
  std::vector<UpstreamClient*> clients_;        ///< in the order in which they came
  std::uint64_t clients_left_ = 0;              ///< how many ever have: while none does, nobody has to be looked up
  std::map<std::string, std::string> objects_;  ///< paths that were found -> what they are of
  std::map<MemberKey, std::shared_ptr<Wire>> wires_;
  std::map<PipeNumber, Pipe> pipes_;
  std::map<MemberKey, PipeNumber> shared_pipes_;
  std::map<EndpointKey, PipeNumber> endpoints_;
  std::uint64_t endpoints_left_ = 0;  ///< how many ever have: while none does, nobody has to be looked up in endpoints_
  PipeNumber last_pipe_ = 0;
  std::map<std::pair<UpstreamClient*, rr::GeneratorId>, Generator> generators_;
  CallbackRoutes callback_routes_;
  SharedReads shared_reads_;
};

}  // namespace rrgate
