// rrgate top: what passes through a gateway, for the terminal. Layer: server/cli.
#include <unistd.h>

#include <iomanip>
#include <iostream>
#include <map>
#include <sstream>
#include <thread>

#include "server/cli/printable.hpp"
#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace {

using std::chrono::steady_clock;

struct Counts {
  double messages = 0;
  double bytes = 0;
  double losses = 0;  ///< values that were lost, or that a newer one replaced before they were handed on
};

struct DeviceLine {
  std::string name;
  std::string state;
  std::string mode;
  std::uint32_t clients = 0;
  Counts counts;  ///< since the gateway began, or since its clients came
};

struct Snapshot {
  steady_clock::time_point time = steady_clock::now();
  std::string version;
  double uptime = 0;  ///< in s
  std::vector<DeviceLine> devices;
};

/// Of a field: 64-bit integers are text in JSON.
double number(const rr::OrderedJson& value) {
  return value.is_string() ? std::stod(value.get_ref<const std::string&>()) : value.get<double>();
}

/// Reads properties and the wire of the gateway's service as JSON.
class GatewayReader {
 public:
  explicit GatewayReader(rr::RemoteObject gateway) : gateway_(std::move(gateway)) {}

  Snapshot read() const {
    Snapshot out;
    out.version = property("version").get<std::string>();
    out.uptime = property("uptime").get<double>();
    std::map<std::string, Counts> counts;
    for (const auto& each : statistics()) {
      auto& of_device = counts[each["device"]];
      of_device.messages += number(each["messages_to_device"]) + number(each["messages_to_clients"]);
      of_device.bytes += number(each["bytes_to_device"]) + number(each["bytes_to_clients"]);
    }
    for (const auto& each : property("subscriptions")) {
      auto& of_device = counts[each["device"]];
      of_device.messages += number(each["delivered"]);
      of_device.losses += number(each["dropped"]) + number(each["conflated"]);
    }
    for (const auto& each : property("devices"))
      out.devices.push_back({each["name"], each["state"], each["mode"], each["clients"], counts[each["name"]]});
    return out;
  }

 private:
  rr::OrderedJson as_json(const rr::Value& value, std::string_view member) const {
    const auto found = find_member(gateway_, member);
    return to_json(value, found.member->type, found.types());
  }
  rr::OrderedJson property(std::string_view name) const { return as_json(gateway_.get(name), name); }
  /// Of relayed devices, once the gateway has run for a second.
  rr::OrderedJson statistics() const {
    try {
      return as_json(gateway_.peek_in("statistics"), "statistics");
    } catch (const rr::ClientException& failure) {
      if (failure.error().code != rr::ErrorCode::value_not_set) throw;
      return rr::OrderedJson::array();
    }
  }

  rr::RemoteObject gateway_;
};

std::string duration_text(double seconds) {
  const auto whole = static_cast<std::uint64_t>(seconds);
  std::ostringstream out;
  if (whole >= 86'400) out << whole / 86'400 << " d ";
  out << std::setfill('0') << std::setw(2) << whole / 3600 % 24 << ":" << std::setw(2) << whole / 60 % 60 << ":"
      << std::setw(2) << whole % 60;
  return out.str();
}

/// A second's difference; clients that left take their counts with them.
double rate(double now, double before, double seconds) {
  return std::max(0.0, (now - before) / seconds);
}

rr::OrderedJson rates_of(const Snapshot& before, const Snapshot& now) {
  const auto seconds = std::chrono::duration<double>(now.time - before.time).count();
  auto out = rr::OrderedJson::object();
  out["version"] = now.version;
  out["uptime"] = now.uptime;
  out["devices"] = rr::OrderedJson::array();
  for (const auto& device : now.devices) {
    Counts old = device.counts;
    for (const auto& each : before.devices)
      if (each.name == device.name) old = each.counts;
    auto line = rr::OrderedJson::object();
    line["device"] = device.name;
    line["state"] = device.state;
    line["mode"] = device.mode;
    line["clients"] = device.clients;
    line["messages_per_second"] = rate(device.counts.messages, old.messages, seconds);
    line["bytes_per_second"] = rate(device.counts.bytes, old.bytes, seconds);
    line["dropped_per_second"] = rate(device.counts.losses, old.losses, seconds);
    out["devices"].push_back(std::move(line));
  }
  return out;
}

void print_table(const std::string& url, const rr::OrderedJson& rates) {
  std::ostringstream out;
  if (::isatty(STDOUT_FILENO)) out << "\x1b[H\x1b[2J";
  out << "rrgate " << printable(rates["version"].get<std::string>()) << " at " << url << ", up "
      << duration_text(rates["uptime"].get<double>()) << "\n\n"
      << std::left << std::setw(24) << "device" << std::setw(12) << "state" << std::setw(8) << "mode" << std::right
      << std::setw(8) << "clients" << std::setw(14) << "messages/s" << std::setw(12) << "kB/s" << std::setw(12)
      << "dropped/s"
      << "\n"
      << std::fixed;
  for (const auto& each : rates["devices"])
    out << std::left << std::setw(23) << printable(each["device"].get<std::string>()) << " " << std::setw(12)
        << printable(each["state"].get<std::string>()) << std::setw(8) << printable(each["mode"].get<std::string>())
        << std::right << std::setw(8) << each["clients"].get<std::uint32_t>() << std::setprecision(1) << std::setw(14)
        << each["messages_per_second"].get<double>() << std::setw(12) << each["bytes_per_second"].get<double>() / 1000
        << std::setw(12) << each["dropped_per_second"].get<double>() << "\n";
  std::cout << out.str() << std::flush;
}

struct TopOptions : RemoteOptions {
  std::uint32_t count = 0;  ///< 0: without end
};

int top(const TopOptions& options) {
  return run_remote("top", options.url, [&] {
    if (!options.url.starts_with("http")) throw NotUnderstood("expected a gateway's http(s)://HOST:PORT");
    const GatewayReader gateway(open_gateway(remote_address(options)));
    auto before = gateway.read();
    for (std::uint32_t shown = 0; options.count == 0 || shown < options.count; ++shown) {
      std::this_thread::sleep_for(std::chrono::seconds(1));
      auto now = gateway.read();
      const auto rates = rates_of(before, now);
      if (options.is_json)
        print_value(rates, true);
      else
        print_table(options.url, rates);
      before = std::move(now);
    }
  });
}

}  // namespace

void add_top(Commands& commands) {
  const auto [app, options] = commands.add("top", "Show the devices and clients of a gateway", top);
  options.url = "http://127.0.0.1:8080";
  takes_websocket_url(app.add_option("GATEWAY", options.url, "The gateway, as http(s)://HOST:PORT"))
      ->option_text("[http://127.0.0.1:8080]");
  add_count(app, "--count", options.count, "Stop after this number of seconds");
  add_json(app, options);
  add_connection_options(app, options);
}

}  // namespace rrgate
