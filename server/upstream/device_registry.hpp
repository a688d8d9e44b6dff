// The devices behind the gateway, by name and by node. Layer: server/upstream.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "server/upstream/device.hpp"
#include "server/upstream/device_definitions.hpp"

namespace rrgate {

class DeviceRegistry {
 public:
  /// `config`  must outlive it.
  DeviceRegistry(const boost::asio::any_io_executor& executor, const Config& config);

  /// Errors   those of make_node_tls(), with the device's name.
  [[nodiscard]] rr::Result<> load_tls();
  void reload_tls(bool is_forced);
  void start();
  void stop();

  /// The devices of another configuration, which must outlive this call alone: those that stay as they are, and new
  /// ones. Errors   as load_tls(); nothing has changed.
  [[nodiscard]] rr::Result<std::vector<std::shared_ptr<Device>>> prepare(const Config& next);
  /// Takes what prepare() made, once the configuration has been replaced. Devices that are not configured stay
  /// whose names no other device has now.
  void replace(std::vector<std::shared_ptr<Device>> configured);
  bool has(const Device& device) const;
  /// See Device::begin_closing().
  bool are_closing() const;

  /// Another number whenever devices have joined or gone.
  std::uint64_t changes() const { return changes_; }
  /// Called when devices have joined or gone.
  void on_change(std::function<void()> handler) { on_change_ = std::move(handler); }
  /// A device that is found, is a page or plays a recording joins; its name is nobody's yet.
  Device& add(DeviceConfig device, std::shared_ptr<TlsFiles> tls, std::shared_ptr<PageLink> page = nullptr);
  /// Such a device goes; clients that are connected to it stay so.
  void remove(const Device& device);

  const std::vector<std::shared_ptr<Device>>& all() const { return devices_; }
  /// Null when no device has this name.
  Device* find(std::string_view name) const;
  /// The configured device that is this node, as far as is known. Null when there is none.
  Device* find_configured(const rr::NodeId& node_id) const;
  /// The device that a client asks for by node id and name (any id and "" ask for none in particular: it gets the only
  /// configured device, or where none is configured the only one that plays no recording). Of several that are this
  /// node, the first that is online. Null when there is none.
  Device* route(const rr::NodeId& node_id, std::string_view node_name) const;

 private:
  std::shared_ptr<Device> make(DeviceConfig device, const Config& whole, std::shared_ptr<TlsFiles> tls = nullptr,
                               std::shared_ptr<PageLink> page = nullptr);

  boost::asio::any_io_executor executor_;
  const Config& config_;
  // Devices may outlive this.
  std::shared_ptr<LookPace> pace_ = std::make_shared<LookPace>();
  std::shared_ptr<rr::ReadDefinitions> definitions_ = std::make_shared<DeviceDefinitions>();
  std::vector<std::shared_ptr<Device>> devices_;
  std::function<void()> on_change_;
  std::uint64_t changes_ = 0;
};

}  // namespace rrgate
