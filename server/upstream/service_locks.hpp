// The locks of one service of a device, kept for the clients of all its upstreams. Layer: server/upstream.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/access/audit_entry.hpp"
#include "server/access/safe_answer.hpp"
#include "server/upstream/lease_table.hpp"
#include "server/upstream/lock_table.hpp"
#include "server/upstream/safe_values.hpp"

namespace rrgate {

class Device;
class Upstream;
class UpstreamClient;

/// What a client is about to do with an object or a member.
enum class MemberUse : std::uint8_t { read, connect, command };

/// What has become of a lease.
struct LeaseNews {
  std::string service;
  HeldLease lease;
  bool is_held = false;
  std::string why;  ///< it is held no more
};

/// Whether a client may use a member now: the one place where locks and leases decide. Drives a LockTable: asks the
/// device in the sessions that its clients use, tells them what came of it; and a LeaseTable, whose leases end with the
/// device made safe.
class ServiceLocks : public std::enable_shared_from_this<ServiceLocks> {
 public:
  /// `device`  outlives it.
  ServiceLocks(Device& device, std::string service);

  /// A client begins to use an upstream.
  void add(const UpstreamClient& client, Upstream& upstream);
  /// Gives back what it holds. `left`  is called once the device has it back, maybe at once.
  void remove(const UpstreamClient& client, std::function<void()> left = nullptr);
  /// `done`  is called exactly once; with invalid_operation where the client is removed before.
  void handle_wanted(const UpstreamClient& client, const rr::LockWanted& wanted,
                     std::function<void(const rr::Result<>&)> done);
  /// Gives back what the client has locked or leased, or waits for, where UpstreamClient::may_lock() says no by now;
  /// and its leases where may_command() does so, and did not when they were taken.
  void review(const UpstreamClient& client);
  /// Whether the client has a lock, a monitor or a lease of this object, or has lost one and not given it back.
  bool has_at(const UpstreamClient& client, std::string_view path) const;
  /// Whether the client may use a member now. Errors   those of LockTable::check() and LeaseTable::check().
  rr::Result<> check(const UpstreamClient& client, std::string_view path, const rr::MemberDefinition& member,
                     MemberUse use);
  /// The same for packets of what is connected already: locks leave them alone.
  rr::Result<> check_packet(const UpstreamClient& client, std::string_view path, const rr::MemberDefinition& member);
  /// Whether a command of the member passes whatever waits.
  bool is_urgent(std::string_view path, const rr::MemberDefinition& member) const;
  std::vector<HeldLock> held() const { return table_.held(); }
  std::vector<HeldLease> leases() const { return leases_.held(); }
  /// Sends the safe values at and below a path now, whoever has locks and leases there.
  /// Errors   not_implemented_error: none are declared; those of SafeValues::check(), where not all could be sent;
  /// connection_error: they are sent as soon as the device is back; those of the device.
  /// `done`  called once, at once or when the device has answered.
  void make_safe(std::string_view path, std::function<void(const rr::Result<>&)> done);
  /// Whether the device is still to be made safe, or may have to be made safe again: see SafeValues::is_owing().
  bool is_owing() const { return safe_->is_owing(); }
  /// Every lease ends, because the gateway or the device goes.
  void end_leases(const std::string& why);
  void handle_opened(const std::shared_ptr<Upstream>& upstream);
  /// The upstream has lost its session with the device.
  void handle_lost(const Upstream& upstream);
  /// The upstream has ended its session with the device, for good.
  void handle_closed(const Upstream& upstream);
  /// The device has replaced the objects at and below a path.
  void handle_released(std::string_view path);
  /// Holds what makes safe there against what the device has now.
  void check_safe_values(std::string_view path, const std::shared_ptr<Upstream>& upstream);

 private:
  struct Holder {
    std::weak_ptr<Upstream> upstream;
    AuditEntryPtr end;           ///< what is to be recorded of it
    bool could_command = false;  ///< when it took the lease; else that keeps others out
  };

  LeaseNeed need_of(std::string_view path, const rr::MemberDefinition& member) const;
  rr::Result<> handle_lease(const UpstreamClient& client, LockClient id, const rr::LockWanted& wanted);
  /// The device is made safe where leases have ended.
  void end_leases();
  void pay_or_wake();
  std::shared_ptr<Upstream> open_upstream(const std::shared_ptr<Upstream>& first);
  /// The session that has the lock of an object. Null: nobody has, or it is not open.
  std::shared_ptr<Upstream> locked_by(const std::string& path);

  /// Does what the table wants done.
  void settle();
  void handle(LockAsked&& asked);
  void handle(LockAnswered&& answered);
  void handle(LockClientLeft&& left);
  void handle(LockSessionInDoubt&& doubtful);

  Device& device_;
  std::string service_;
  LockTable table_;
  LeaseTable leases_;
  std::shared_ptr<SafeValues> safe_;
  std::map<std::string, Holder> holders_;  ///< by canonical path of the lease
  std::map<const UpstreamClient*, LockClient> clients_;
  std::map<LockSession, std::weak_ptr<Upstream>> upstreams_;  ///< by Upstream::number()
  std::map<std::pair<LockClient, rr::LockRequestId>, std::function<void(const rr::Result<>&)>> requests_;
  std::map<LockClient, std::function<void()>> leaving_;
  LockClient last_client_ = 0;
  bool is_settling_ = false;
  boost::asio::steady_timer timeout_;
};

}  // namespace rrgate
