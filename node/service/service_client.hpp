// One client of a node: its session, driven over its stream, and the way from its requests to handlers. Layer:
// node/service.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>

#include "core/session/service/service_session.hpp"
#include "node/driver/stream_driver.hpp"
#include "node/service/service.hpp"

namespace rr {

class ServiceClient;

/// What a client needs of its node.
class ServiceClientOwner {
 public:
  virtual std::shared_ptr<Service> find_service(const HostedService& hosted) = 0;
  virtual Caller find_client(ClientId id) const = 0;
  /// For handlers that answer later.
  virtual const std::shared_ptr<NodeThread>& thread() = 0;
  virtual BlockingPool& blocking_pool() = 0;
  virtual ClientId set_current_client(ClientId id) = 0;  ///< 0: no handler runs; returns whose handler ran till now
  /// A handler failed by mistake, or no client waits for its answer.
  virtual void report(const std::string& problem) = 0;
  /// Has the login judged, away from the node's thread, and answers it with client.answer_login() unless that is gone.
  virtual void judge_login(const LoginRequested& login, const std::shared_ptr<ServiceClient>& client) = 0;
  virtual void locks_changed(const Service& service) = 0;
  /// The client is sent what the wire's values are from now on, until it leaves.
  virtual void follow_wire(ClientId client, const PathMember& wire) = 0;
  virtual void leave_wire(ClientId client, const PathMember& wire) = 0;
  virtual void client_ended(ServiceClient& client) = 0;

 protected:
  ~ServiceClientOwner() = default;
};

class ServiceClient final : public SessionDriver<ServiceSession>, private PipeSender {
 public:
  ServiceClient(ClientId id, ServiceClientOwner& owner, ServiceDirectory& directory, ServiceSessionOptions options,
                std::unique_ptr<ByteStream> stream);

  ClientId id() const { return id_; }
  const ServiceSession& session() const { return session_; }
  void handle_locks_changed();
  void answer_login(LoginId id, Result<AuthenticatedUser> result);
  /// Null while the client is in no service of ours.
  Service* service() const { return service_.get(); }
  void send_event(EventPacket& packet);
  void send_wire(WirePacket& packet);
  void release_path(const std::string& path);
  void call_callback(const std::vector<std::string>& paths, const MemberDefinition& callback,
                     std::span<const Value> arguments, CallbackDone done);
  /// Tells the client that its service ends, then closes.
  void close_service();
  /// The owner goes away: nothing is told to it or to handlers any more.
  void abandon();

 private:
  bool handle_event(Now now) override;
  void ended() override;
  /// Reports what could not be sent on a connection that goes on.
  void note_sent(const MemberDefinition& member, const Result<>& sent);

  struct RunningGenerator {
    std::shared_ptr<const Generator> generator;
    bool is_stepping = false;          ///< a step answers later
    std::vector<Called> waiting = {};  ///< what the client asks of it meanwhile
  };

  void handle(Called& called, Now now);
  std::shared_ptr<LateCall> begin_late_call(const Called& called);
  void finish_late_call(CallId id, const Result<Value>& answer);
  /// Nobody waits for answers any more.
  void cancel_late_calls();
  std::optional<Result<Value>> answer_generator(Called& called);
  Result<Value> take_step(const Called& called);
  void finish_step(GeneratorId id, bool has_failed);
  void abort_steps(GeneratorId id, const RunningGenerator& ended);
  /// Tells a generator that nobody will ask it any more.
  void abandon_generator(const Generator& generator);
  void handle(const ClientConnected& connected, Now now);
  void handle(const LoginRequested& login, Now now);
  void handle(const LocksChanged& changed, Now now);
  void handle(const WireConnected& connected, Now now);
  void handle(const WireReceived& received, Now now);
  void handle(const WireDisconnected& disconnected, Now now);
  /// Those that `ended` says so of.
  template <class Ended>
  void leave_wires(Ended&& ended);
  void handle(const UserChanged&, Now) {}  // no service of ours is remote
  void handle(const ObjectWanted&, Now) {}
  void handle(const LockWanted&, Now) {}
  void handle(const LeaveWanted&, Now) {}
  void handle(const PipeConnected& connected, Now now);
  void handle(const PipeReceived& received, Now now);
  void handle(const PipeAcknowledged& acknowledged, Now now);
  void handle(const PipeClosed& closed, Now now);
  void handle(const GeneratorEnded& ended, Now now);
  void handle(const CallbackCompleted& completed, Now now);
  void handle(const ClientGone& gone, Now now);

  // PipeSender: from endpoints
  Result<std::uint32_t> send_pipe_packet(PipeId id, const Value& value) override;
  Result<std::uint32_t> send_pipe_packet(PipeId id, SharedPipePacket& packet) override;
  void close_pipe(PipeId id) override;
  std::size_t queued_bytes() const override { return session_.queued_bytes(); }
  void end_pipe(PipeId id, bool tells_handler);
  /// Runs a handler for this client. Returns what it threw, which is reported where it was not thrown for the client.
  template <class F>
  std::optional<Error> run_handler(std::string_view kind, std::string_view name, F&& handler);
  /// The same where no client waits for the outcome: whatever it throws is reported.
  template <class F>
  void notify(std::string_view kind, std::string_view name, F&& handler);

  ClientId id_;
  ServiceClientOwner* owner_;
  std::shared_ptr<Service> service_;
  std::set<PathMember, PathMemberLess> wires_;  ///< that it follows
  std::unordered_map<PipeId, PipeEndpoint> pipes_;
  std::unordered_map<GeneratorId, RunningGenerator> generators_;  ///< as many as the session allows
  /// Requests whose handlers answer later.
  struct Late {
    std::weak_ptr<LateCall> call;
    const MemberDefinition* member = nullptr;
    GeneratorId generator = 0;  ///< 0: it is no step
  };
  std::unordered_map<CallId, Late> late_calls_;
  struct CalledCallback {
    const MemberDefinition* member = nullptr;
    CallbackDone done;
  };
  std::unordered_map<CallbackId, CalledCallback> callbacks_;
};

}  // namespace rr
