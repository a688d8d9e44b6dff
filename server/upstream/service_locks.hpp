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

#include "server/upstream/lock_table.hpp"

namespace rrgate {

class Upstream;
class UpstreamClient;

/// Drives a LockTable: asks the device in the sessions that its clients use, tells them what came of it.
class ServiceLocks : public std::enable_shared_from_this<ServiceLocks> {
 public:
  explicit ServiceLocks(const boost::asio::any_io_executor& executor) : timeout_(executor) {}

  /// A client begins to use an upstream.
  void add(const UpstreamClient& client, Upstream& upstream);
  /// Gives back what it holds. `left`  is called once the device has it back, maybe at once.
  void remove(const UpstreamClient& client, std::function<void()> left = nullptr);
  /// `done`  is called exactly once, unless the client is removed before.
  void handle_wanted(const UpstreamClient& client, const rr::LockWanted& wanted,
                     std::function<void(const rr::Result<>&)> done);
  /// Whether the client may use an object now. See LockTable.
  rr::Result<> check(const UpstreamClient& client, std::string_view path, bool is_exempt);
  std::vector<HeldLock> held() const { return table_.held(); }
  /// The upstream has lost its session with the device.
  void handle_lost(const Upstream& upstream);
  /// The device has replaced the objects at and below a path.
  void handle_released(std::string_view path);

 private:
  /// Does what the table wants done.
  void settle();
  void handle(LockAsked&& asked);
  void handle(LockAnswered&& answered);
  void handle(LockClientLeft&& left);
  void handle(LockSessionInDoubt&& doubtful);

  LockTable table_;
  std::map<const UpstreamClient*, LockClient> clients_;
  std::map<LockSession, std::weak_ptr<Upstream>> upstreams_;  ///< by Upstream::number()
  std::map<std::pair<LockClient, rr::LockRequestId>, std::function<void(const rr::Result<>&)>> requests_;
  std::map<LockClient, std::function<void()>> leaving_;
  LockClient last_client_ = 0;
  boost::asio::steady_timer timeout_;
};

}  // namespace rrgate
