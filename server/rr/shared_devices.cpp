#include "server/rr/shared_devices.hpp"

#include <algorithm>
#include <boost/uuid/name_generator_sha1.hpp>

#include "core/session/service/service_index.hpp"
#include "server/access/replay_name.hpp"

namespace rrgate {

namespace {

/// A UUID of version 5 in the name space of the gateway's own: the same whenever the gateway has the same.
rr::NodeId derived_id(const rr::NodeId& gateway, std::string_view device) {
  boost::uuids::uuid space;
  std::copy(gateway.bytes.begin(), gateway.bytes.end(), space.begin());
  const auto derived = boost::uuids::name_generator_sha1(space)(std::string(device));
  rr::NodeId id;
  std::copy(derived.begin(), derived.end(), id.bytes.begin());
  return id;
}

/// Names of devices may have characters that names of nodes may not.
std::string node_name_of(const std::string& device) {
  return rr::is_valid_node_name(device) ? device : std::string();
}

}  // namespace

SharedDevice::SharedDevice(std::shared_ptr<Device> device, SharedNode& gateway_node, const Config& config,
                           Logins& logins, std::function<void()> name_is_free)
    : device_(std::move(device)),
      gateway_node_(gateway_node),
      config_(config),
      name_is_free_(std::move(name_is_free)),
      node_({derived_id(gateway_node.identity().id, device_->config().name), node_name_of(device_->config().name)},
            config, logins) {
  device_->on_change([this] { refresh(); });
  refresh();
}

SharedDevice::~SharedDevice() {
  device_->on_change(nullptr);
  for (const auto& [name, service] : services_) service->stop();
  node_.close();
}

void SharedDevice::refresh() {
  const auto& identity = device_->identity();
  if (!identity) return;
  const auto has = [&](const std::string& name) {
    return std::any_of(identity->services.begin(), identity->services.end(),
                       [&](const DeviceService& service) { return service.name == name; });
  };
  const auto before = services_.size();
  for (auto it = services_.begin(); it != services_.end();) {
    auto& service = *it->second;
    service.set_listed(has(it->first));
    // One that is not listed yet, since the device has just begun, is the same to those who wait for it.
    if (has(it->first) ? !service.upstream()->is_closed() : service.upstream()->has_clients()) {
      ++it;
      continue;
    }
    service.stop();
    it = services_.erase(it);
  }
  const bool have_gone = services_.size() < before;
  for (const auto& service : identity->services) {
    if (service.name == rr::service_index_name || services_.contains(service.name)) continue;
    std::vector<ServiceBoard*> boards{&node_};
    // Who asks the gateway for a service by its name alone wants the device, not what was recorded of it.
    if (!is_replay(device_->config().name)) boards.push_back(&gateway_node_);
    const auto shared = std::make_shared<SharedService>(device_, service.name, boards);
    services_.emplace(service.name, shared);
    shared->start(config_.timeouts.unused_session);
  }
  if (have_gone) name_is_free_();
}

bool SharedDevice::is_ready() const {
  if (!device_->identity()) return device_->state() == DeviceState::offline;
  return std::all_of(services_.begin(), services_.end(),
                     [](const auto& service) { return service.second->has_tried(); });
}

void SharedDevice::wake() {
  for (const auto& [name, service] : services_) service->upstream()->wake();
}

SharedDevices::SharedDevices(const rr::NodeId& id, const Config& config, Logins& logins)
    : config_(config), logins_(logins), node_({id, config.node.name}, config, logins) {}

void SharedDevices::sync(const DeviceRegistry& devices) {
  const auto have_gone = std::erase_if(devices_, [&](const auto& each) { return !devices.has(*each.first); });
  if (have_gone > 0) offer_again();
  for (const auto& device : devices.all())
    if (device->is_shared() && !devices_.contains(device.get()))
      devices_.emplace(device.get(),
                       std::make_unique<SharedDevice>(device, node_, config_, logins_, [this] { offer_again(); }));
}

void SharedDevices::offer_again() {
  for (const auto& [key, device] : devices_)
    for (const auto& [name, service] : device->services()) service->offer_again();
}

void SharedDevices::add_own(std::shared_ptr<Device> device, const std::string& service) {
  own_service_ = std::make_shared<SharedService>(std::move(device), service, std::vector<ServiceBoard*>{&node_});
  own_service_->start(config_.timeouts.unused_session);
}

void SharedDevices::stop() {
  devices_.clear();
  if (own_service_) own_service_->stop();
  own_service_.reset();
  node_.close();
}

void SharedDevices::renew_judges() {
  for (const auto& [key, device] : devices_)
    for (const auto& [name, service] : device->services()) service->renew_judge();
  if (own_service_) own_service_->renew_judge();
}

bool SharedDevices::is_ready() const {
  return (!own_service_ || own_service_->has_tried()) &&
         std::all_of(devices_.begin(), devices_.end(), [](const auto& device) { return device.second->is_ready(); });
}

void SharedDevices::wake(const std::function<bool(const Device&)>& wanted) {
  for (const auto& [key, device] : devices_)
    if (wanted(*key)) device->wake();
  if (own_service_ && wanted(*own_service_->device())) own_service_->upstream()->wake();
}

SharedDevice* SharedDevices::find(const Device& device) const {
  const auto found = devices_.find(&device);
  return found == devices_.end() ? nullptr : found->second.get();
}

SharedDevice* SharedDevices::find(const rr::NodeId& node_id, std::string_view node_name) const {
  if (node_id.is_any() && node_name.empty()) return nullptr;
  for (const auto& [key, device] : devices_) {
    const auto& identity = device->node().identity();
    if ((node_id.is_any() || node_id == identity.id) && (node_name.empty() || node_name == identity.name))
      return device.get();
  }
  return nullptr;
}

std::shared_ptr<SharedClient> SharedDevices::find_client(std::string_view key) const {
  for (const auto& [of, device] : devices_)
    for (const SharedNode* node : {static_cast<const SharedNode*>(&device->node()), &node_})
      for (const auto& [raw, client] : node->clients())
        if (client->key() == key) return client;
  return nullptr;
}

Traffic SharedDevices::traffic_of(const Device& device) const {
  auto traffic = device.traffic();
  if (const auto* shared = find(device))
    for (const auto& [name, service] : shared->services()) service->add_traffic(traffic);
  return traffic;
}

}  // namespace rrgate
