#include "server/http/endpoints/metrics.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "server/gateway/gateway.hpp"
#include "server/gateway/http_access.hpp"

namespace rrgate {

namespace {

/// The names of devices need no escapes: check_device_name() and those of nodes allow no quote and no backslash, but
/// what comes from the network is escaped all the same.
std::string label(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\' || c == '"') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

class Exposition {
 public:
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_.append("# HELP ").append(name).append(" ").append(help).append("\n# TYPE ");
    text_.append(name).append(" ").append(type).append("\n");
  }
  void sample(std::uint64_t value, std::string_view labels = {}) {
    text_ += name_;
    if (!labels.empty()) text_.append("{").append(labels).append("}");
    text_.append(" ").append(std::to_string(value)).append("\n");
  }
  void single(std::string_view name, std::string_view type, std::string_view help, std::uint64_t value) {
    family(name, type, help);
    sample(value);
  }
  std::string take() { return std::move(text_); }

 private:
  std::string name_;
  std::string text_;
};

using Devices = std::vector<std::shared_ptr<Device>>;

void write_flows(Exposition& out, const Devices& devices, std::uint64_t Flow::*member) {
  for (const auto& device : devices) {
    const auto name = "device=\"" + label(device->config().name) + "\",direction=\"";
    out.sample(device->traffic().to_device.*member, name + "to_device\"");
    out.sample(device->traffic().to_clients.*member, name + "to_clients\"");
  }
}

void write_devices(Exposition& out, const Devices& devices) {
  const auto each = [&](const auto& value) {
    for (const auto& device : devices) out.sample(value(*device), "device=\"" + label(device->config().name) + "\"");
  };
  out.family("rrgate_device_up", "gauge", "Whether the device answers.");
  each([](const Device& device) { return device.state() == DeviceState::online ? 1u : 0u; });
  out.family("rrgate_sessions", "gauge", "Clients that are connected to the device.");
  each([](const Device& device) { return device.clients(); });
  out.family("rrgate_sessions_total", "counter", "Clients that were ever connected to the device.");
  each([](const Device& device) { return device.traffic().sessions; });
  out.family("rrgate_relayed_bytes_total", "counter", "Bytes that were passed on.");
  write_flows(out, devices, &Flow::bytes);
  out.family("rrgate_relayed_messages_total", "counter",
             "Messages that were begun to be passed on, TLS sessions apart.");
  write_flows(out, devices, &Flow::messages);
  out.family("rrgate_waiting_bytes", "gauge", "Bytes that their reader has not taken yet.");
  write_flows(out, devices, &Flow::waiting);
}

/// Of all clients of a device and kind of member together: labels must not grow with clients.
void write_ledgers(Exposition& out, const SharedDevices& shared) {
  std::map<std::string, rr::Ledger> ledgers;
  shared.visit_ledgers([&](const SharedDevice& device, const SharedClient&, const std::string&,
                           const rr::MemberDefinition& member, const rr::Ledger& ledger) {
    const auto key = "device=\"" + label(device.device()->config().name) + "\",kind=\"" +
                     std::string(member_kind_name(member.kind)) + "\"";
    ledgers[key].add(ledger);
  });
  const auto each = [&](std::string_view name, std::string_view help, std::uint64_t rr::Ledger::*count) {
    out.family(name, "gauge", help);
    for (const auto& [key, ledger] : ledgers) out.sample(ledger.*count, key);
  };
  each("rrgate_subscription_delivered", "Values that the subscriptions of now were handed.", &rr::Ledger::delivered);
  each("rrgate_subscription_conflated", "Values that were replaced by newer ones.", &rr::Ledger::conflated);
  each("rrgate_subscription_dropped", "Values that were lost.", &rr::Ledger::dropped);
  out.family("rrgate_subscription_age_us", "gauge", "Age of values when they left the gateway, in microseconds.");
  for (const auto& [key, ledger] : ledgers)
    for (const auto& [name, share] : {std::pair("0.5", 0.5), std::pair("0.99", 0.99)})
      out.sample(static_cast<std::uint64_t>(ledger.ages.quantile(share).count()), key + ",quantile=\"" + name + "\"");
  out.family("rrgate_shared_session_up", "gauge", "Whether the session with a service of a shared device is open.");
  for (const auto& [key, device] : shared.all())
    for (const auto& [name, service] : device->services())
      out.sample(service->upstream()->is_open() ? 1 : 0,
                 "device=\"" + label(device->device()->config().name) + "\",service=\"" + label(name) + "\"");
}

std::uint64_t resident_bytes() {
  std::ifstream in("/proc/self/statm");
  std::uint64_t whole = 0;
  std::uint64_t resident = 0;
  in >> whole >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::uint64_t open_files() {
  std::error_code error;
  std::uint64_t count = 0;
  for (auto it = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && it != std::filesystem::directory_iterator(); it.increment(error))
    ++count;
  return count;
}

}  // namespace

Handler metrics_endpoint(Gateway& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (const auto allowed = gateway.access().check(request.identity, {.verb = Verb::metrics}); !allowed)
      return gateway.http_access().refusal(request.identity, allowed.error());
    const auto& metrics = gateway.metrics();
    Exposition out;
    out.family("rrgate_build_info", "gauge", "Which rrgate this is.");
    out.sample(1, "version=\"" RRGATE_VERSION "\"");
    out.single("rrgate_connections", "gauge", "Open connections of all kinds.", gateway.admission().open());
    out.single("rrgate_connections_total", "counter", "Connections that were accepted.", metrics.connections);
    out.single("rrgate_http_requests_total", "counter", "HTTP requests, upgrades to WebSockets among them.",
               metrics.requests);
    out.family("rrgate_rejected_total", "counter", "Connections and requests that were turned away.");
    for (std::size_t i = 0; i < rejection_names.size(); ++i)
      out.sample(metrics.rejected[i], "reason=\"" + std::string(rejection_names[i]) + "\"");
    write_devices(out, gateway.devices().all());
    write_ledgers(out, gateway.shared());
    out.family("rrgate_config_reloads_total", "counter", "Times that the configuration was read anew.");
    out.sample(metrics.reloads, "result=\"ok\"");
    out.sample(metrics.failed_reloads, "result=\"failed\"");
    out.single("process_resident_memory_bytes", "gauge", "Memory in use.", resident_bytes());
    out.single("process_open_fds", "gauge", "Open file descriptors.", open_files());
    auto response = text_response(200, "text/plain; version=0.0.4; charset=utf-8", out.take());
    response.set("Cache-Control", "no-store");
    return response;
  };
}

}  // namespace rrgate
