#include "server/gateway/device.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <random>

#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// Many gateways, or many devices of one, must not knock in step: 75 to 125 percent.
milliseconds with_jitter(milliseconds wait) {
  static thread_local std::minstd_rand random(std::random_device{}());
  return wait * std::uniform_int_distribution<int>(75, 125)(random) / 100;
}

}  // namespace

std::string_view to_string(DeviceState state) {
  switch (state) {
    case DeviceState::connecting:
      return "connecting";
    case DeviceState::online:
      return "online";
    case DeviceState::offline:
      return "offline";
  }
  return "unknown";
}

Device::Device(const asio::any_io_executor& executor, DeviceConfig config, const Config& whole)
    : config_(std::move(config)),
      dial_options_{whole.timeouts.connect, whole.timeouts.send_stall},
      retry_(whole.retry),
      wake_(executor) {}

rr::awaitable<rr::Result<std::unique_ptr<rr::ByteStream>>> Device::connect() {
  auto stream = co_await rr::dial(config_.url, dial_options_);
  // News either way: it was thought online and can't be reached, or it is back before the next look was due.
  if (stream.has_value() != (state_ == DeviceState::online)) look_again();
  co_return stream;
}

std::optional<Device::Seat> Device::take_seat() {
  if (config_.max_clients != 0 && clients_ >= config_.max_clients) return std::nullopt;
  return Seat(*this);
}

rr::awaitable<void> Device::watch() {
  auto backoff = retry_.min;
  while (!is_stopping_) {
    looks_again_ = false;
    const auto result = co_await probe(config_.url, dial_options_);
    if (is_stopping_) break;
    note(result);
    const auto looked = std::chrono::steady_clock::now();
    wake_.expires_at(looked + with_jitter(result ? retry_.online : backoff));
    backoff = result ? retry_.min : std::min(backoff * 2, retry_.max);
    while (!is_stopping_) {
      // Looking again on demand keeps the shortest wait too, or a crowd of clients would make this loop spin.
      if (looks_again_) wake_.expires_at(std::min(wake_.expiry(), looked + retry_.min));
      if (std::chrono::steady_clock::now() >= wake_.expiry()) break;
      co_await wake_.async_wait(asio::as_tuple(asio::use_awaitable));
    }
  }
}

void Device::look_again() {
  looks_again_ = true;
  wake_.cancel();
}

void Device::stop() {
  is_stopping_ = true;
  wake_.cancel();
}

void Device::note(const rr::Result<ProbeResult>& result) {
  const auto before = state_;
  if (result) {
    if (state_ != DeviceState::online || identity_ != *result)
      log(LogLevel::info, "device online",
          {{"device", config_.name},
           {"node_id", rr::format_node_id(result->node_id, rr::NodeIdFormat::dashes)},
           {"node_name", result->node_name}});
    state_ = DeviceState::online;
    identity_ = *result;
    last_error_.clear();
    return;
  }
  state_ = DeviceState::offline;
  if (before != state_ || last_error_ != result.error().message)
    log(LogLevel::warning, "device offline", {{"device", config_.name}, {"error", result.error().message}});
  last_error_ = result.error().message;
}

DeviceRegistry::DeviceRegistry(const asio::any_io_executor& executor, const Config& config) : executor_(executor) {
  for (const auto& device : config.devices) devices_.push_back(std::make_unique<Device>(executor, device, config));
}

void DeviceRegistry::start() {
  for (const auto& device : devices_) asio::co_spawn(executor_, device->watch(), asio::detached);
}

void DeviceRegistry::stop() {
  for (const auto& device : devices_) device->stop();
}

Device* DeviceRegistry::find(std::string_view name) const {
  const auto found = std::find_if(devices_.begin(), devices_.end(),
                                  [name](const auto& device) { return device->config().name == name; });
  return found == devices_.end() ? nullptr : found->get();
}

Device* DeviceRegistry::route(const rr::NodeId& node_id, std::string_view node_name) const {
  if (node_id.is_any() && node_name.empty()) return devices_.size() == 1 ? devices_.front().get() : nullptr;
  for (const auto& device : devices_) {
    // Before the first answer, and for a device that is down, what the configured URL says must do.
    const auto& url = device->config().url;
    const auto& known = device->identity();
    const auto id = known ? known->node_id : url.node_id.value_or(rr::NodeId{});
    const auto& name = known ? known->node_name : url.node_name;
    if ((node_id.is_any() || node_id == id) && (node_name.empty() || node_name == name)) return device.get();
  }
  return nullptr;
}

}  // namespace rrgate
