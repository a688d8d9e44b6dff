// The gateway's own service: robdef/org.rrgate.gateway.robdef. Layer: server/gateway.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "node/service/node.hpp"
#include "node/service/service.hpp"
#include "server/access/access_rules.hpp"
#include "server/upstream/device.hpp"

namespace rrgate {

class GatewayState;

/// Runs on a node inside the process, which the gateway shares as it shares a device: its clients are clients of the
/// gateway, with all that holds for those.
class GatewayService {
 public:
  static constexpr std::string_view name = gateway_device;

  /// Both outlive it.
  GatewayService(boost::asio::io_context& io, GatewayState& gateway);

  /// What stands for it among the shared devices.
  const std::shared_ptr<Device>& device() const { return device_; }
  void start();
  void stop();
  /// Devices have joined or gone. Not at once: what is told of them may fail, and whoever brought them must not.
  void look_soon();

 private:
  /// Tells its clients what has become of the devices; leases are told of from then on.
  void look_at_devices();
  void add_members();
  void show_statistics();
  rr::Value describe(const Device& device) const;
  rr::Value list_devices() const;
  rr::Value list_statistics() const;
  rr::Value list_subscriptions() const;
  rr::Value list_locks() const;
  rr::Value list_leases() const;
  void add_leases();
  /// Throws   rr::Exception.
  void ask_for_lease(rr::LockCommand command, const std::string& session, const std::string& path,
                     std::uint32_t deadman);

  GatewayState& gateway_;
  rr::Node node_;
  std::shared_ptr<rr::Service> service_;
  std::shared_ptr<Device> device_;
  std::map<std::string, DeviceState> known_;
  bool looks_soon_ = false;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};

}  // namespace rrgate
