// One client of a shared service: a session of its own with the gateway. Layer: server/rr.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "node/driver/stream_driver.hpp"
#include "server/access/logins.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/rr/shared_service.hpp"

namespace rrgate {

class SessionRights;
class SharedNode;

class SharedClient final : public rr::SessionDriver<rr::ServiceSession>, private UpstreamClient {
 public:
  /// `node`  that it is connected to. `rights`  to locks and leases; null: it has all, but no role.
  SharedClient(SharedNode& node, rr::ServiceSessionOptions options, std::unique_ptr<rr::ByteStream> stream,
               ClientOrigin from, MemoryBudget::Charge memory, std::shared_ptr<SessionRights> rights, std::string key);

  const rr::ServiceSession& session() const { return session_; }
  /// For logs.
  const std::string& peer() const { return from_.client; }
  /// Null while it has not connected to a service.
  const std::shared_ptr<SharedService>& service() const { return service_; }
  /// By which the client names its session to the gateway's own service; nobody else knows it.
  const std::string& key() const { return key_; }
  /// Does something about a lease, as if the client had asked for it here. `done`  is called once, maybe at once.
  void ask_for_lease(rr::LockCommand command, const std::string& path, std::chrono::milliseconds deadman,
                     std::function<void(const rr::Result<>&)> done);
  /// Closes the wires and pipes that the client may not have any more, and gives back what it may not lock: rights have
  /// changed, or who has logged in.
  void review();
  /// Tells the client that its service ends, then closes.
  void close_service();
  /// Whether it is another gateway, which has clients of its own.
  bool is_gateway() const { return session_.connection().peer().name == gateway_node_name; }
  /// Why the gateway has closed it; empty where it has not.
  const std::string& end_reason() const { return end_reason_; }

 private:
  struct Endpoint {
    std::string path;
    const rr::MemberDefinition* member = nullptr;
  };

  /// What calls `work` while this client is there, and passes on what is due then.
  template <class F>
  auto while_here(F work);

  bool handle_event(rr::Now now) override;
  void ended() override;
  void has_written() override;
  void has_settled() override;

  void handle(const rr::Called& called);
  void handle(const rr::ClientConnected& connected);
  void handle(const rr::LoginRequested& login);
  void handle(const rr::LocksChanged&) {}
  void handle(const rr::WireConnected& connected);
  void handle(const rr::WireDisconnected& disconnected);
  void handle(const rr::WireReceived& received);
  void handle(const rr::PipeConnected& connected);
  void handle(const rr::PipeReceived& received);
  void handle(const rr::PipeAcknowledged&) {}
  void handle(const rr::PipeClosed& closed);
  void handle(const rr::GeneratorEnded& ended);
  void handle(const rr::CallbackCompleted& completed);
  void handle(const rr::UserChanged& changed);
  void handle(const rr::ObjectWanted& wanted);
  void handle(const rr::LockWanted& wanted);
  void handle(const rr::LeaveWanted& wanted);
  void handle(const rr::ClientGone& gone);

  // UpstreamClient
  std::weak_ptr<const void> life() const override { return weak_from_this(); }
  Subject lock_user() const override { return session_.user() ? subject_of(*session_.user()) : Subject(); }
  bool has_role(std::string_view role) const override;
  AuditEntryPtr begin_lease_end(const std::string& path) const override;
  bool may_lock(const std::string& path) const override;
  bool may_command(const std::string& path) const override;
  std::shared_ptr<Upstream> upstream_in_use() const override { return home_; }
  bool may_answer(const std::string& path, const rr::MemberDefinition& callback) const override {
    return session_.admits(rr::EntryType::callback_call_req, path, &callback);
  }
  void receive_event(rr::EventPacket& packet, rr::Now now) override;
  void receive_wire(rr::WirePacket& packet, rr::Now now) override;
  void answer_wire(const std::string& path, const rr::MemberDefinition& wire, const rr::Result<>& result) override;
  void note_conflated(const std::string& path, const rr::MemberDefinition& wire, std::uint64_t count) override;
  void close_wire(const std::string& path, const rr::MemberDefinition& wire) override;
  void accept_pipe(rr::PipeId id) override;
  void refuse_pipe(rr::PipeId id, const rr::Error& error) override;
  void receive_packet(rr::PipeId id, rr::SharedPipePacket& packet, rr::Now now) override;
  bool is_behind() const override { return is_behind_; }
  void acknowledge_packets(rr::PipeId id, std::span<const std::uint32_t> numbers) override;
  void close_pipe(rr::PipeId id) override;
  void release_path(const std::string& path) override;
  void call_callback(const std::string& path, const rr::MemberDefinition& callback,
                     std::span<const rr::Value> arguments, rr::ClientConnection::CallbackReply answer) override;
  void connection_lost(const rr::Error& error) override;

  void answer_login(const rr::LoginRequested& login, rr::Result<rr::AuthenticatedUser> result);
  static rr::awaitable<void> log_in_at_device(std::shared_ptr<SharedClient> self,
                                              std::shared_ptr<SharedService> service, rr::LoginRequested login);
  static rr::awaitable<void> answer_when_open(std::shared_ptr<SharedClient> self, std::shared_ptr<Upstream> upstream,
                                              rr::LoginId login, rr::AuthenticatedUser user);
  /// From now on all that the client does goes through `upstream`.
  void move_to(std::shared_ptr<Upstream> upstream);
  void leave_login();
  /// What is the client's own it may give back, whatever its rights are by now.
  rr::Result<> admit_lock(const rr::LockWanted& wanted);
  void begin_lock(const rr::LockWanted& wanted, std::function<void(const rr::Result<>&)> done);
  void end_too_slow(const rr::Error& error);
  void end_soon(std::string reason);
  /// Bytes that wait for the stream: above, the client is behind; below half of them it has caught up.
  std::size_t much_waiting() const { return session_.max_pipe_queued_bytes() / 4; }

  SharedNode& node_;
  ClientOrigin from_;
  MemoryBudget::Charge memory_;
  std::shared_ptr<SessionRights> rights_;
  std::string key_;
  std::string end_reason_;
  bool is_behind_ = false;
  bool was_refused_ = false;  ///< a wire's value, and it is in the log
  bool was_behind_ = false;   ///< and it is in the log
  std::shared_ptr<SharedService> service_;
  std::shared_ptr<Upstream> home_;   ///< the shared one, or that of the user who has logged in at the device
  std::shared_ptr<Upstream> login_;  ///< the latter; null: there is none
  /// By path and name, as the service defines them that the client is connected to.
  std::map<std::pair<std::string, std::string>, const rr::MemberDefinition*> wires_;
  std::unordered_map<rr::PipeId, Endpoint> pipes_;
  std::unordered_map<rr::CallbackId, rr::ClientConnection::CallbackReply> callbacks_;
};

}  // namespace rrgate
