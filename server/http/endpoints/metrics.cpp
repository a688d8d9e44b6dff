#include "server/http/endpoints/metrics.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>

#include "server/config/version.hpp"
#include "server/log/log.hpp"
#include "server/state/gateway_state.hpp"
#include "server/state/http_access.hpp"

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

std::string seconds(std::uint64_t microseconds) {
  auto digits = std::to_string(microseconds % 1'000'000);
  return std::to_string(microseconds / 1'000'000) + "." + std::string(6 - digits.size(), '0') + digits;
}

class Exposition {
 public:
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_.append("# HELP ").append(name).append(" ").append(help).append("\n# TYPE ");
    text_.append(name).append(" ").append(type).append("\n");
  }
  void sample(std::uint64_t value, std::string_view labels = {}, std::string_view suffix = {}) {
    sample(std::to_string(value), labels, suffix);
  }
  /// In seconds.
  void time_sample(std::uint64_t microseconds, std::string_view labels = {}, std::string_view suffix = {}) {
    sample(seconds(microseconds), labels, suffix);
  }
  void single(std::string_view name, std::string_view type, std::string_view help, std::uint64_t value) {
    family(name, type, help);
    sample(value);
  }
  /// In seconds. Every second of its buckets, from 128 us on: each is a series of its own.
  void histogram(const rr::AgeHistogram& ages, const std::string& labels) {
    const auto bound = labels + (labels.empty() ? "" : ",") + "le=\"";
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < rr::AgeHistogram::bucket_count; ++i) {
      count += ages.counts()[i];
      if (i < 7 || i % 2 == 0 || i == rr::AgeHistogram::bucket_count - 1) continue;
      sample(count, bound + seconds(rr::AgeHistogram::upper_bound(i).count()) + "\"", "_bucket");
    }
    sample(count, bound + "+Inf\"", "_bucket");
    time_sample(ages.sum_us(), labels, "_sum");
    sample(count, labels, "_count");
  }
  std::string take() { return std::move(text_); }

 private:
  void sample(const std::string& value, std::string_view labels, std::string_view suffix) {
    text_.append(name_).append(suffix);
    if (!labels.empty()) text_.append("{").append(labels).append("}");
    text_.append(" ").append(value).append("\n");
  }

  std::string name_;
  std::string text_;
};

struct DeviceNow {
  const Device* device;
  std::string label;  ///< device="name"
  Traffic traffic;
};
using Devices = std::vector<DeviceNow>;

Devices look_at(GatewayState& gateway) {
  Devices out;
  for (const auto& device : gateway.devices().all())
    out.push_back(
        {device.get(), "device=\"" + label(device->config().name) + "\"", gateway.shared().traffic_of(*device)});
  return out;
}

void write_flows(Exposition& out, const Devices& devices, std::uint64_t Flow::*member) {
  for (const auto& each : devices) {
    out.sample(each.traffic.to_device.*member, each.label + ",direction=\"to_device\"");
    out.sample(each.traffic.to_clients.*member, each.label + ",direction=\"to_clients\"");
  }
}

void write_devices(Exposition& out, const Devices& devices) {
  const auto each = [&](const auto& value) {
    for (const auto& one : devices) out.sample(value(*one.device), one.label);
  };
  out.family("rrgate_device_up", "gauge", "Whether the device answers.");
  each([](const Device& device) { return device.state() == DeviceState::online ? 1u : 0u; });
  out.family("rrgate_sessions", "gauge", "Clients that are connected to the device.");
  each([](const Device& device) { return device.clients(); });
  out.family("rrgate_sessions_total", "counter", "Clients that were ever connected to the device.");
  each([](const Device& device) { return device.traffic().sessions; });
  out.family("rrgate_relayed_bytes_total", "counter",
             "Bytes that were passed on, or, of a shared device, that its clients sent and were sent.");
  write_flows(out, devices, &Flow::bytes);
  out.family("rrgate_relayed_messages_total", "counter",
             "Messages that were begun to be passed on, TLS sessions apart.");
  write_flows(out, devices, &Flow::messages);
  out.family("rrgate_waiting_bytes", "gauge", "Bytes that their reader has not taken yet.");
  write_flows(out, devices, &Flow::waiting);
}

/// Of all clients of a shared device together: labels must not grow with clients.
void write_ledgers(Exposition& out, const Devices& devices, const SharedDevices& shared) {
  const auto each = [&](const auto& write) {
    for (const auto& one : devices)
      if (shared.find(*one.device)) {
        write(one.label + ",kind=\"wire\"", one.traffic.ledgers.wires);
        write(one.label + ",kind=\"pipe\"", one.traffic.ledgers.pipes);
      }
  };
  const auto count = [&](std::string_view name, std::string_view help, std::uint64_t rr::Ledger::*member) {
    out.family(name, "counter", help);
    each([&](const std::string& labels, const rr::Ledger& ledger) { out.sample(ledger.*member, labels); });
  };
  count("rrgate_subscription_delivered_total", "Values that were handed to clients' connections.",
        &rr::Ledger::delivered);
  count("rrgate_subscription_conflated_total", "Values that were replaced by newer ones.", &rr::Ledger::conflated);
  count("rrgate_subscription_dropped_total", "Values that were lost.", &rr::Ledger::dropped);
  out.family("rrgate_subscription_age_seconds", "histogram",
             "How long values were in the gateway when they were handed to clients' connections.");
  for (const auto& one : devices)  // packets of pipes are handed on at once
    if (shared.find(*one.device)) out.histogram(one.traffic.ledgers.wires.ages, one.label + ",kind=\"wire\"");
  out.family("rrgate_shared_session_up", "gauge",
             "Whether the session with a service of a shared device is open, or rests since no client uses it.");
  for (const auto& one : devices)
    if (const auto* device = shared.find(*one.device))
      for (const auto& [name, service] : device->services())
        out.sample(service->upstream()->is_open() || service->upstream()->is_resting() ? 1 : 0,
                   one.label + ",service=\"" + label(name) + "\"");
}

std::uint64_t resident_bytes() {
  std::ifstream in("/proc/self/statm");
  std::uint64_t whole = 0;
  std::uint64_t resident = 0;
  in >> whole >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::uint64_t most_files() {
  rlimit files{};
  return ::getrlimit(RLIMIT_NOFILE, &files) == 0 ? files.rlim_cur : 0;
}

std::uint64_t open_files() {
  std::error_code error;
  std::uint64_t count = 0;
  for (auto it = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && it != std::filesystem::directory_iterator(); it.increment(error))
    ++count;
  if (error == std::errc::too_many_files_open) return most_files();  // the count takes one
  return count;
}

std::uint64_t cpu_microseconds() {
  timespec used{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<std::uint64_t>(used.tv_sec) * 1'000'000 + static_cast<std::uint64_t>(used.tv_nsec) / 1000;
}

void write_audit(Exposition& out, const AuditLog::State& audit) {
  out.single("rrgate_audit_up", "gauge", "Whether the audit log can be written; 1 where there is none.",
             audit.failure.empty() ? 1 : 0);
  out.single("rrgate_audit_records_total", "counter", "Records that were written into the audit log.", audit.records);
  out.single("rrgate_audit_lost_total", "counter", "Records that will never be there.", audit.lost);
  out.single("rrgate_audit_refused_total", "counter", "What was refused since it could not be recorded.",
             audit.refused);
  out.single("rrgate_audit_waiting", "gauge", "Records that are not written yet.", audit.waiting);
}

}  // namespace

Handler metrics_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (const auto allowed = gateway.access().check(request.identity, {.verb = Verb::metrics}); !allowed)
      return gateway.http_access().refusal(request, allowed.error());
    const auto& metrics = gateway.metrics();
    Exposition out;
    out.family("rrgate_build_info", "gauge", "Which rrgate this is.");
    out.sample(1, "version=\"" + std::string(version) + "\"");
    out.single("rrgate_connections", "gauge", "Open connections of all kinds.", gateway.admission().open());
    out.single("rrgate_connections_total", "counter", "Connections that were accepted.", metrics.connections);
    out.single("rrgate_unaccepted_total", "counter",
               "Times that connections had to wait: there were no file descriptors left, or no memory.",
               metrics.unaccepted);
    out.single("rrgate_http_requests_total", "counter", "HTTP requests, upgrades to WebSockets among them.",
               metrics.requests);
    out.family("rrgate_http_responses_total", "counter", "Responses of HTTP by status, 101 for WebSockets among them.");
    for (std::size_t i = 0; i < metrics.responses.size(); ++i)
      out.sample(metrics.responses[i], "code=\"" + std::to_string(i + 1) + "xx\"");
    out.family("rrgate_http_request_duration_seconds", "histogram",
               "From the end of a request until its response, without streams and images.");
    out.histogram(metrics.request_ages, {});
    out.family("rrgate_rejected_total", "counter", "Connections and requests that were turned away.");
    for (std::size_t i = 0; i < rejection_names.size(); ++i)
      out.sample(metrics.rejected[i], "reason=\"" + std::string(rejection_names[i]) + "\"");
    const auto& memory = gateway.memory();
    out.single("rrgate_memory_budget_bytes", "gauge", "What clients may make the gateway hold.", memory.total());
    out.single("rrgate_memory_budget_used_bytes", "gauge", "What they make it hold.", memory.used());
    out.single("rrgate_memory_budget_refusals_total", "counter", "What was refused because that was too much.",
               memory.refusals());
    out.single("rrgate_log_lost_total", "counter", "Lines of the log that were dropped because it was read too slowly.",
               lost_log_lines());
    write_audit(out, gateway.access().audit().state());
    const auto devices = look_at(gateway);
    write_devices(out, devices);
    write_ledgers(out, devices, gateway.shared());
    out.single("rrgate_clock_jumps_total", "counter",
               "Times that the clock of the machine was set by a second or more.", metrics.clock_jumps);
    out.family("rrgate_config_reloads_total", "counter", "Times that the configuration was read anew.");
    out.sample(metrics.reloads, "result=\"ok\"");
    out.sample(metrics.failed_reloads, "result=\"failed\"");
    out.family("process_cpu_seconds_total", "counter", "Processor time that was used.");
    out.time_sample(cpu_microseconds());
    out.single("process_resident_memory_bytes", "gauge", "Memory in use.", resident_bytes());
    out.single("process_open_fds", "gauge", "Open file descriptors.", open_files());
    out.single("process_max_fds", "gauge", "File descriptors that may be open.", most_files());
    auto response = text_response(200, "text/plain; version=0.0.4; charset=utf-8", out.take());
    response.set("Cache-Control", "no-store");
    return response;
  };
}

}  // namespace rrgate
