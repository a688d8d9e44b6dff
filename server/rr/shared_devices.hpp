// The devices that the gateway shares, each behind a node of its own. Layer: server/rr.
// Source: sessions spec sections 2.16 and 2.20.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "server/rr/shared_node.hpp"
#include "server/upstream/device_registry.hpp"

namespace rrgate {

/// The services of one device, kept open as long as it lives.
class SharedDevice {
 public:
  /// The other arguments outlive it. `name_is_free`  is called when services have gone, whose names others may wait
  /// for.
  SharedDevice(std::shared_ptr<Device> device, SharedNode& gateway_node, const Config& config, Logins& logins,
               std::function<void()> name_is_free);
  ~SharedDevice();

  SharedNode& node() { return node_; }
  const std::shared_ptr<Device>& device() const { return device_; }
  const std::map<std::string, std::shared_ptr<SharedService>>& services() const { return services_; }
  /// Whether clients find what there is: not while the gateway itself is only just connecting.
  bool is_ready() const;
  /// A client comes: sessions that rest are opened.
  void wake();

 private:
  void refresh();

  std::shared_ptr<Device> device_;
  SharedNode& gateway_node_;
  const Config& config_;
  std::function<void()> name_is_free_;
  SharedNode node_;
  std::map<std::string, std::shared_ptr<SharedService>> services_;
};

class SharedDevices {
 public:
  /// `config` and `logins` outlive it.
  SharedDevices(const rr::NodeId& id, const Config& config, Logins& logins);
  ~SharedDevices() { stop(); }

  /// The gateway's own node: services of shared devices whose names are free there.
  SharedNode& node() { return node_; }
  /// The gateway's own service: offered on that node alone.
  void add_own(std::shared_ptr<Device> device, const std::string& service);
  /// Begins to share those that are to be shared, ends those that are not there any more.
  void sync(const DeviceRegistry& devices);
  void stop();
  /// Logins are judged by whoever Logins::authenticator() says now, also at services that are offered already.
  void renew_judges();

  bool is_ready() const;
  /// Of all devices that are `wanted`, and of the gateway itself, which is one here.
  void wake(const std::function<bool(const Device&)>& wanted);
  /// Null where the device is not shared.
  SharedDevice* find(const Device& device) const;
  /// By the identity of the node that stands for a device.
  SharedDevice* find(const rr::NodeId& node_id, std::string_view node_name) const;
  const std::map<const Device*, std::unique_ptr<SharedDevice>>& all() const { return devices_; }
  /// By SharedClient::key(). Null: no such session.
  std::shared_ptr<SharedClient> find_client(std::string_view key) const;
  /// Of a device, the clients that are there included.
  Traffic traffic_of(const Device& device) const;
  /// Calls `visit(device, client, path, member, ledger)` for every subscription of every client.
  template <class Visit>
  void visit_ledgers(Visit&& visit) const {
    for (const auto& [key, device] : devices_)
      for (const auto& [name, service] : device->services())
        for (const auto* client : service->clients())
          client->session().visit_ledgers(  // by a name of its own: clang 14 captures no structured binding
              [&, &of = *device](const std::string& path, const rr::MemberDefinition& member,
                                 const rr::Ledger& ledger) { visit(of, *client, path, member, ledger); });
  }

 private:
  /// Services whose names others had on the gateway's node.
  void offer_again();

  const Config& config_;
  Logins& logins_;
  SharedNode node_;
  std::map<const Device*, std::unique_ptr<SharedDevice>> devices_;
  std::shared_ptr<SharedService> own_service_;
};

}  // namespace rrgate
