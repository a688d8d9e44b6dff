// A gateway with echoing devices, on a thread of its own.
#pragma once

#include <boost/asio/io_context.hpp>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "server/gateway/gateway.hpp"
#include "test/server/support/fake_device.hpp"
#include "test/server/support/test_client.hpp"

namespace rrgate::test {

class TestGateway {
 public:
  /// Devices "x", "y", ... with node names "node.x", ...; `change` may set limits before the start.
  explicit TestGateway(std::size_t device_count = 1, const std::function<void(Config&)>& change = {});
  ~TestGateway();

  std::uint16_t port() const { return port_; }
  FakeDevice& device(std::size_t index = 0) { return *devices_.at(index); }
  /// Ends a device, or starts it again at its port.
  void end_device(std::size_t index = 0);
  void restart_device(std::size_t index = 0);

  /// Asks /api/v1/devices until the device's entry is as wanted; returns it. Throws after 10 s.
  nlohmann::json wait_for_device(std::size_t index, const std::function<bool(const nlohmann::json&)>& is_wanted);
  /// Until its state is this one; returns its JSON text.
  std::string wait_for_state(std::string_view state, std::size_t index = 0);

  /// The gateway, whose configuration has "discover", hears of a node; or hears that it has left a URL.
  void announce(const rr::Announcement& announcement);
  void withdraw(const rr::NodeId& node_id, const std::string& url);
  /// Gateway::reconfigure, with the present configuration and what `change` makes of it.
  void reconfigure(const std::function<void(Config&)>& change);
  /// Calls `look` on the gateway's thread, and waits for it.
  void visit(const std::function<void(Gateway&)>& look);
  /// Asks `path` until the answer is as wanted; returns it. Throws after 10 s.
  nlohmann::json wait_for(const std::string& path, const std::function<bool(const nlohmann::json&)>& is_wanted);

  /// Gateway::stop; the future is ready when everything has ended.
  std::future<void> stop();

 private:
  boost::asio::io_context io_{1};
  std::vector<std::unique_ptr<FakeDevice>> devices_;
  std::vector<std::uint16_t> device_ports_;
  std::optional<Gateway> gateway_;
  std::uint16_t port_ = 0;
  std::optional<boost::asio::executor_work_guard<boost::asio::io_context::executor_type>> work_;
  std::thread thread_;
  bool is_stopped_ = false;
};

}  // namespace rrgate::test
