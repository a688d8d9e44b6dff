#include "server/upstream/device_registry.hpp"

#include <algorithm>
#include <utility>

#include "server/access/replay_name.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

bool is_configured(const Device& device) {
  const auto& config = device.config();
  return !config.is_found && !config.is_served && !is_replay(config.name);
}

}  // namespace

DeviceRegistry::DeviceRegistry(const asio::any_io_executor& executor, const Config& config)
    : executor_(executor), config_(config) {
  for (const auto& device : config.devices) devices_.push_back(make(device, config));
}

std::shared_ptr<Device> DeviceRegistry::make(DeviceConfig device, const Config& whole, std::shared_ptr<TlsFiles> tls,
                                             std::shared_ptr<PageLink> page) {
  auto made = std::make_shared<Device>(executor_, std::move(device), whole, std::move(tls), std::move(page));
  made->share_pace(pace_);
  made->share_definitions(definitions_);
  return made;
}

rr::Result<> DeviceRegistry::load_tls() {
  for (const auto& device : devices_)
    if (auto loaded = device->load_tls(); !loaded) return loaded;
  return {};
}

void DeviceRegistry::reload_tls(bool is_forced) {
  for (const auto& device : devices_)
    if (is_configured(*device)) device->reload_tls(is_forced);  // others have theirs together
}

void DeviceRegistry::start() {
  for (const auto& device : devices_) device->start();
}

rr::Result<std::vector<std::shared_ptr<Device>>> DeviceRegistry::prepare(const Config& next) {
  std::vector<std::shared_ptr<Device>> out;
  for (const auto& config : next.devices) {
    const auto stays =
        std::find_if(devices_.begin(), devices_.end(), [&](const auto& device) { return device->can_become(config); });
    if (stays != devices_.end()) {
      out.push_back(*stays);
      continue;
    }
    out.push_back(make(config, next));
    if (auto loaded = out.back()->load_tls(); !loaded) return loaded.error();
  }
  return out;
}

void DeviceRegistry::replace(std::vector<std::shared_ptr<Device>> configured) {
  const auto before = std::exchange(devices_, std::move(configured));
  ++changes_;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    devices_[i]->become(config_.devices[i], config_);
    if (std::find(before.begin(), before.end(), devices_[i]) == before.end()) devices_[i]->start();
  }
  for (const auto& device : before) {
    if (has(*device)) continue;
    const auto& config = device->config();
    if (!is_configured(*device) && !find(config.name)) {
      device->become(config, config_);
      devices_.push_back(device);
    } else {
      device->stop();
    }
  }
}

bool DeviceRegistry::has(const Device& device) const {
  return std::any_of(devices_.begin(), devices_.end(), [&](const auto& each) { return each.get() == &device; });
}

bool DeviceRegistry::are_closing() const {
  return std::any_of(devices_.begin(), devices_.end(), [](const auto& each) { return each->is_closing(); });
}

Device& DeviceRegistry::add(DeviceConfig device, std::shared_ptr<TlsFiles> tls, std::shared_ptr<PageLink> page) {
  devices_.push_back(make(std::move(device), config_, std::move(tls), std::move(page)));
  auto& added = *devices_.back();
  added.start();
  ++changes_;
  if (on_change_) on_change_();
  return added;
}

void DeviceRegistry::remove(const Device& device) {
  const auto found =
      std::find_if(devices_.begin(), devices_.end(), [&](const auto& each) { return each.get() == &device; });
  if (found == devices_.end()) return;
  (*found)->stop();
  devices_.erase(found);
  ++changes_;
  if (on_change_) on_change_();
}

void DeviceRegistry::stop() {
  for (const auto& device : devices_) device->stop();
}

Device* DeviceRegistry::find(std::string_view name) const {
  const auto found = std::find_if(devices_.begin(), devices_.end(),
                                  [name](const auto& device) { return device->config().name == name; });
  return found == devices_.end() ? nullptr : found->get();
}

namespace {

/// Before the first answer, and for a device that is down, what the URL says must do.
rr::NodeIdentity identity_of(const Device& device) {
  if (const auto& known = device.identity()) return {known->node_id, known->node_name};
  const auto& url = device.config().url;
  return {url.node_id.value_or(rr::NodeId{}), url.node_name};
}

/// A client that asks for one that is away gets another way to the same node: not another robot of that name, and
/// nothing that says itself which node it is where the configuration says it of one.
bool is_way_to(const Device& away, const Device& online) {
  const auto id = identity_of(away).id;
  return (id.is_any() || id == identity_of(online).id) && (is_configured(online) || !is_configured(away));
}

}  // namespace

Device* DeviceRegistry::find_configured(const rr::NodeId& node_id) const {
  for (const auto& device : devices_)
    if (is_configured(*device) && identity_of(*device).id == node_id) return device.get();
  return nullptr;
}

Device* DeviceRegistry::route(const rr::NodeId& node_id, std::string_view node_name) const {
  if (node_id.is_any() && node_name.empty()) {
    const auto is_choice = [this](const auto& device) {
      return config_.devices.empty() ? !is_replay(device->config().name) : is_configured(*device);
    };
    if (std::count_if(devices_.begin(), devices_.end(), is_choice) != 1) return nullptr;
    return std::find_if(devices_.begin(), devices_.end(), is_choice)->get();
  }
  Device* away = nullptr;
  for (const auto& device : devices_) {
    if (device->is_shared()) continue;  // a node of the gateway's own stands for it
    const auto identity = identity_of(*device);
    const bool is_it =
        (node_id.is_any() || node_id == identity.id) && (node_name.empty() || node_name == identity.name);
    if (!is_it) continue;
    if (device->state() == DeviceState::online && (!away || is_way_to(*away, *device))) return device.get();
    if (!away) away = device.get();
  }
  return away;
}

}  // namespace rrgate
