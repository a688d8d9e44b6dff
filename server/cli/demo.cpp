// rrgate demo: two simulated devices and a gateway to them, on free ports. Layer: server/cli.
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <csignal>
#include <filesystem>
#include <iostream>

#include "server/cli/command.hpp"
#include "server/cli/run_gateway.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::uint16_t preferred_port = 8080;

struct DemoDevice {
  std::string_view name;
  std::string_view program;
  std::string_view service;
  DeviceMode mode = DeviceMode::relay;
  std::string path = {};
  std::uint16_t port = 0;
  std::vector<std::string> arguments = {};
  pid_t process = -1;

  std::string url() const { return "rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=" + std::string(service); }
  std::string command() const {
    auto text = path;
    for (const auto& argument : arguments) text += ' ' + argument;
    return text;
  }
};

/// The program beside rrgate (installed) or below it (in the build tree).
std::string find_program(std::string_view name) {
  for (const auto folder : {".", "../examples/demo", "../libexec/rrgate"}) {
    const auto path = std::filesystem::path(program_folder()) / folder / name;
    std::error_code error;
    if (std::filesystem::exists(path, error)) return std::filesystem::canonical(path, error).string();
  }
  return {};
}

bool is_port_free(std::uint16_t port) {
  asio::io_context io;
  asio::ip::tcp::acceptor acceptor(io);
  rr::error_code error;
  acceptor.open(asio::ip::tcp::v4(), error);
  acceptor.set_option(asio::socket_base::reuse_address(true), error);
  acceptor.bind({asio::ip::make_address("127.0.0.1"), port}, error);
  return !error;
}

/// Free at this moment: the device binds it a moment later.
std::uint16_t find_free_port() {
  asio::io_context io;
  asio::ip::tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.1"), 0});
  return acceptor.local_endpoint().port();
}

/// Starts a device that ends with us, however we end.
pid_t start_program(const std::string& path, const std::vector<std::string>& arguments) {
  std::vector<char*> texts{const_cast<char*>(path.c_str())};
  for (const auto& argument : arguments) texts.push_back(const_cast<char*>(argument.c_str()));
  texts.push_back(nullptr);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(1);
  ::setpgid(0, 0);  // Ctrl-C reaches us alone; we stop the devices when the gateway has let them go
  ::execv(path.c_str(), texts.data());
  ::_exit(127);
}

/// Until it takes connections, has ended, or five seconds are over: the gateway reaches it at its first attempt then.
void wait_until_listening(const DemoDevice& device) {
  asio::io_context io;
  for (int waited_ms = 0; waited_ms < 5000; waited_ms += 10) {
    asio::ip::tcp::socket probe(io);
    rr::error_code error;
    probe.connect({asio::ip::address_v4::loopback(), device.port}, error);
    siginfo_t ended{};
    ::waitid(P_PID, static_cast<id_t>(device.process), &ended, WEXITED | WNOHANG | WNOWAIT);
    if (!error || ended.si_pid != 0) return;
    ::usleep(10'000);
  }
}

void note_dead_devices(std::vector<DemoDevice>& devices) {
  for (auto& device : devices) {
    if (device.process <= 0 || ::waitpid(device.process, nullptr, WNOHANG) != device.process) continue;
    device.process = -1;
    log(LogLevel::warning, "demo device has ended; it may be started again by hand",
        {{"device", device.name}, {"command", device.command()}});
  }
}

void stop_devices(std::vector<DemoDevice>& devices) {
  for (const auto& device : devices)
    if (device.process > 0) ::kill(device.process, SIGTERM);
  for (auto& device : devices) {
    for (int waited_ms = 0; device.process > 0 && waited_ms < 2000; waited_ms += 20) {
      if (::waitpid(device.process, nullptr, WNOHANG) == device.process) device.process = -1;
      if (device.process > 0) ::usleep(20'000);
    }
    if (device.process <= 0) continue;
    ::kill(device.process, SIGKILL);
    ::waitpid(device.process, nullptr, 0);
  }
}

/// Prints the address once all devices answer; says so if they don't.
rr::awaitable<void> announce(Gateway& gateway, std::uint16_t port) {
  asio::steady_timer pause(co_await asio::this_coro::executor);
  const auto is_online = [](const auto& device) { return device->state() == DeviceState::online; };
  const auto& devices = gateway.devices().all();
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!gateway.is_stopping() && !std::all_of(devices.begin(), devices.end(), is_online)) {
    if (std::chrono::steady_clock::now() > give_up) {
      log(LogLevel::warning, "not all demo devices answer; the page shows which");
      break;
    }
    pause.expires_after(std::chrono::milliseconds(50));
    co_await pause.async_wait(asio::as_tuple(asio::use_awaitable));
  }
  if (!gateway.is_stopping()) std::cout << "rrgate demo: http://127.0.0.1:" << port << "/" << std::endl;
}

std::optional<std::uint16_t> parse_port(const std::string& text) {
  const auto address = rr::parse_host_port("localhost:" + text);
  if (!address) return std::nullopt;
  return address->port;
}

Config make_config(const std::vector<DemoDevice>& devices, std::uint16_t port) {
  Config config;
  config.listen.push_back({"127.0.0.1", port});
  for (const auto& device : devices) {
    DeviceConfig each{std::string(device.name), rr::parse_url(device.url()).value()};
    each.mode = device.mode;
    config.devices.push_back(std::move(each));
  }
  config.retry.min = milliseconds(200);
  config.retry.max = milliseconds(2000);
  config.retry.online = milliseconds(3000);
  config.timeouts.drain = milliseconds(500);
  config.log.level = "warning";
  return config;
}

}  // namespace

int run_demo(Arguments arguments) {
  constexpr std::string_view options[] = {"--port"};
  const auto parsed = parse_arguments(arguments, {options});
  if (!parsed.error.empty()) return usage_error("demo", parsed.error);
  if (!parsed.operands.empty()) return usage_error("demo", "unexpected " + rr::quote(parsed.operands.front()));
  auto port = is_port_free(preferred_port) ? preferred_port : std::uint16_t{0};
  if (const auto given = parsed.options.find("--port"); given != parsed.options.end()) {
    const auto number = parse_port(given->second);
    if (!number) return usage_error("demo", "--port " + rr::quote(given->second) + ": expected 0 to 65535");
    port = *number;
  }

  // The robot stops when the client that drives it is gone: it must see each client. Frames are the same for all.
  std::vector<DemoDevice> devices = {{"create", "rrgate-demo-create", "Create"},
                                     {"webcams", "rrgate-demo-webcams", "Webcam", DeviceMode::shared}};
  for (auto& device : devices) {
    device.path = find_program(device.program);
    if (device.path.empty()) {
      std::cerr << "rrgate demo: " << device.program << " not found beside rrgate\n";
      return exit_failed;
    }
  }
  for (auto& device : devices) {
    device.port = find_free_port();
    device.arguments = {"--port", std::to_string(device.port)};
  }
  // The cameras ride on the robot: they follow its pose.
  devices[1].arguments.insert(devices[1].arguments.end(), {"--robot", devices[0].url()});
  for (auto& device : devices) device.process = start_program(device.path, device.arguments);
  for (const auto& device : devices) wait_until_listening(device);

  std::optional<asio::signal_set> deaths;
  std::function<void()> wait_for_death = [&] {
    deaths->async_wait([&](const rr::error_code& error, int) {
      if (error) return;
      note_dead_devices(devices);
      wait_for_death();
    });
  };
  const auto code = run_gateway(make_config(devices, port), [&](auto& io, Gateway& gateway, const auto& addresses) {
    deaths.emplace(io, SIGCHLD);
    gateway.on_stop([&] { deaths->cancel(); });
    wait_for_death();
    asio::co_spawn(io, announce(gateway, addresses.front().port), asio::detached);
  });
  stop_devices(devices);
  return code;
}

}  // namespace rrgate
