// rrgate demo: simulated devices and a gateway to them, on free ports. Layer: server/cli.
#include <fcntl.h>
#include <qrencode.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/support/random.hpp"
#include "server/cli/command.hpp"
#include "server/cli/first_login.hpp"
#include "server/cli/run_gateway.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::uint16_t preferred_port = 8080;
constexpr std::size_t fleet_count = 5'000;
constexpr std::size_t max_fleet_count = 10'000;

struct DemoDevice {
  std::string name;
  std::string_view program;  ///< empty: a further node of the program before; one in Python ends with ".py"
  std::string_view service;
  LeaseConfig leases = {};
  std::vector<CallbackRule> callbacks = {};
  std::string path = {};  ///< of the program, or of its interpreter by its name
  std::uint16_t port = 0;
  std::vector<std::string> arguments = {};
  bool follows_first = false;  ///< is told where the first device is
  bool has_cameras = false;    ///< is told which cameras or pictures to show
  bool is_any_number = false;  ///< there are as many of it as are asked for
  bool has_group = false;      ///< is told by what name the nodes of this demo find one another
  pid_t process = -1;

  std::string url() const { return "rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=" + std::string(service); }
  std::string command() const {
    auto text = path;
    for (const auto& argument : arguments) text += ' ' + argument;
    return text;
  }
};

/// Devices that are shown together.
struct DemoSystem {
  std::string_view name;
  std::string_view summary;
  std::vector<DemoDevice> devices;
};

/// The first is the one that is run where none is named.
std::vector<DemoSystem> list_systems() {
  // Whoever drives it under a lease and goes away leaves a robot that stands.
  using Safe = SafeAction::Kind;
  const LeaseConfig leases{
      true, {{"Create.StartStreaming", LeaseNeed::never}}, {{Safe::call, "Create", "Drive", "[0, 0]"}}, {"*"}};
  const LeaseConfig baxter{true,
                           {},
                           {{Safe::call, "base", "halt", "[]"},
                            {Safe::property, "left_arm", "command_mode", "0"},
                            {Safe::property, "right_arm", "command_mode", "0"},
                            {Safe::call, "left_gripper", "halt", "[]"},
                            {Safe::call, "right_gripper", "halt", "[]"}},
                           {"*"}};
  const DemoDevice create{
      "create", "rrgate-demo-create", "Create", leases, {{"Create.play_callback", CallbackPolicy::first}}};
  const DemoDevice webcams{"webcams", "rrgate-demo-webcams", "Webcam"};
  const auto robot = [&create](const char* name) {
    auto one = create;
    one.name = name;
    return one;
  };
  auto minimal = create;
  minimal.program = "rrgate-demo-create-minimal.py";
  const auto assembly = [](const std::string& name, std::string_view service) {
    DemoDevice part{name, "rrgate-demo-microassembly", service};
    part.arguments = {name};
    part.has_group = true;
    return part;
  };
  DemoDevice sensor{"sensor", "rrgate-demo-fleet", "Sensor"};
  sensor.is_any_number = true;
  auto riding_webcams = webcams, standing_webcams = webcams;
  riding_webcams.follows_first = true;
  standing_webcams.has_cameras = true;
  return {
      {"create", "a mobile robot in a room, and two cameras that ride on it", {create, riding_webcams}},
      {"create-minimal",
       "a mobile robot on a serial line, whose bytes are simulated, with the paper's definition (python3)",
       {minimal}},
      {"robots",
       "six mobile robots, each in a room and on a node of its own",
       {robot("robot-1"), robot("robot-2"), robot("robot-3"), robot("robot-4"), robot("robot-5"), robot("robot-6")}},
      {"fleet", "thousands of sensors, each a node of its own, in one process", {sensor}},
      {"webcams", "the cameras of this machine, or two that stand in a room", {standing_webcams}},
      {"conference-room",
       "lights and colour sensors of a room, and a controller that holds the light at a target",
       {{"controller", "rrgate-demo-conference-room", "Controller"},
        {"lights", "", "Lights"},
        {"sensors-north", "", "Sensors"},
        {"sensors-south", "", "Sensors"}}},
      {"microassembly",
       "six probes under four microscopes, on nodes that find one another",
       {assembly("cell", "Cell"), assembly("stages", "Stages"), assembly("cameras", "Cameras"),
        assembly("illuminators", "Illuminators")}},
      {"baxter",
       "two arms with grippers and cameras on a wheelchair, in Python (robotraconteur-abstract-robot)",
       {{"baxter", "rrgate-demo-baxter.py", "base", baxter}}}};
}

int print_systems(bool is_json) {
  for (const auto& system : list_systems()) {
    if (is_json)
      print_json_line({{"name", system.name}, {"summary", system.summary}});
    else
      std::cout << std::left << std::setw(17) << system.name << system.summary << "\n";
  }
  return exit_ok;
}

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

/// Free at this moment: the device binds it a moment later, and once more whenever it starts again. So it is none of
/// those that the system gives to connections. `wanted`  is taken where it is one of these.
std::uint16_t find_free_port(const std::vector<DemoDevice>& devices, int wanted) {
  constexpr std::uint16_t first = 10'000;
  constexpr std::uint16_t end = 32'768;
  for (;; wanted = static_cast<int>(first + rr::random_u32() % (end - first))) {
    if (wanted < first || wanted >= end) continue;
    const auto port = static_cast<std::uint16_t>(wanted);
    const bool is_taken =
        std::any_of(devices.begin(), devices.end(), [&](const auto& each) { return each.port == port; });
    if (!is_taken && is_port_free(port)) return port;
  }
}

/// Those of a program that has any number of nodes are ranges, "20000-24999": few words, however many there are.
void add_port(DemoDevice& program, int before, std::uint16_t port) {
  auto& arguments = program.arguments;
  if (!program.is_any_number || arguments.empty() || port != before + 1) {
    arguments.insert(arguments.end(), {"--port", std::to_string(port)});
  } else {
    auto& range = arguments.back();
    range = range.substr(0, range.find('-')) + "-" + std::to_string(port);
  }
}

/// Where each device is to listen, and the command lines that say so. Returns the program that is not there, if any.
std::string prepare_programs(std::vector<DemoDevice>& devices) {
  DemoDevice* program = nullptr;
  int before = 0;
  for (auto& device : devices) {
    if (!device.program.empty()) program = &device;
    device.port = find_free_port(devices, program->is_any_number ? before + 1 : 0);
    add_port(*program, before, device.port);
    before = device.port;
    if (program != &device) continue;
    device.path = find_program(device.program);
    if (device.path.empty()) return std::string(device.program);
    if (device.path.ends_with(".py"))
      device.arguments.insert(device.arguments.begin(), std::exchange(device.path, "python3"));
    if (device.has_group)
      device.arguments.insert(device.arguments.end(), {"--group", "microassembly" + std::to_string(::getpid())});
    if (device.follows_first) device.arguments.insert(device.arguments.end(), {"--robot", devices.front().url()});
  }
  return {};
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
  ::execvp(path.c_str(), texts.data());
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
    if (device.process > 0) ::waitid(P_PID, static_cast<id_t>(device.process), &ended, WEXITED | WNOHANG | WNOWAIT);
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

/// A new folder that nobody else reads, in that of temporary files. Errors   io_error: it can't be made there.
rr::Result<std::filesystem::path> make_temporary_folder() {
  const char* const named = std::getenv("TMPDIR");  // NOLINT(concurrency-mt-unsafe): there is one thread
  const std::filesystem::path place(named && *named != '\0' ? named : "/tmp");
  auto name = (place / "rrgate-demo-XXXXXX").string();
  if (!::mkdtemp(name.data()))
    return rr::make_error(rr::ErrorCode::io_error, "no temporary folder can be made in " + place.string() + ": " +
                                                       std::generic_category().message(errno) +
                                                       "; TMPDIR names another place");
  return std::filesystem::path(name);
}

/// Who may come from other machines. Its file goes with this object.
class DemoLogin {
 public:
  DemoLogin() {
    auto folder = make_temporary_folder();
    if (!folder) {
      password_ = folder.error();
      return;
    }
    folder_ = std::move(*folder);
    password_ = write_first_user(users_file(), user);
  }
  DemoLogin(const DemoLogin&) = delete;
  DemoLogin& operator=(const DemoLogin&) = delete;
  ~DemoLogin() {
    std::error_code error;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, error);
  }

  static constexpr const char* user = "demo";
  std::string users_file() const { return folder_ / "users"; }
  const rr::Result<std::string>& password() const { return password_; }

 private:
  std::filesystem::path folder_;
  rr::Result<std::string> password_ = std::string();
};

/// For the camera of a phone: two modules a letter, one above the other, black on white.
void print_qr_code(const std::string& text) {
  const std::unique_ptr<QRcode, decltype(&QRcode_free)> code(QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L),
                                                             &QRcode_free);
  if (!code) return;
  constexpr int margin = 2;
  const auto is_dark = [&](int x, int y) {
    const bool is_inside = x >= 0 && y >= 0 && x < code->width && y < code->width;
    return is_inside && (code->data[y * code->width + x] & 1) != 0;
  };
  for (int y = -margin; y < code->width + margin; y += 2) {
    std::cout << "\x1b[30;107m";
    for (int x = -margin; x < code->width + margin; ++x) {
      constexpr const char* letters[] = {" ", "\u2584", "\u2580", "\u2588"};
      std::cout << letters[(is_dark(x, y) ? 2 : 0) + (is_dark(x, y + 1) ? 1 : 0)];
    }
    std::cout << "\x1b[0m\n";
  }
}

void print_address(std::uint16_t port, const DemoLogin* login, bool is_json) {
  const auto url = [port](const std::string& host) { return "http://" + host + ":" + std::to_string(port) + "/"; };
  if (is_json) {
    nlohmann::ordered_json json{{"url", url("127.0.0.1")}};
    if (login) {
      json["network"] = nlohmann::ordered_json::array();
      for (const auto& address : addresses_of_machine()) json["network"].push_back(url(address));
      json["user"] = DemoLogin::user;
      json["password"] = login->password().value();
    }
    print_json_line(json);
    return;
  }
  if (login) {
    const auto addresses = addresses_of_machine();
    if (!addresses.empty() && ::isatty(STDOUT_FILENO)) print_qr_code(url(addresses.front()));
    for (const auto& address : addresses) std::cout << "rrgate demo: on the network " << url(address) << "\n";
    std::cout << "rrgate demo: user " << DemoLogin::user << ", password " << login->password().value() << "\n";
  }
  std::cout << "rrgate demo: " << url("127.0.0.1") << std::endl;
}

bool has_variable(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): there is one thread
  return value && *value != '\0';
}

/// On a desktop, for somebody at a terminal; nothing otherwise. The browser is nobody's child: it stays when we end.
void open_browser(const std::string& url) {
  if (!::isatty(STDOUT_FILENO) || !(has_variable("DISPLAY") || has_variable("WAYLAND_DISPLAY"))) return;
  const pid_t child = ::fork();
  if (child > 0) ::waitpid(child, nullptr, 0);
  if (child != 0) return;
  if (::fork() != 0) ::_exit(0);
  ::setsid();
  if (const int nowhere = ::open("/dev/null", O_RDWR); nowhere >= 0)
    for (const int each : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, each);
  ::execlp("xdg-open", "xdg-open", url.c_str(), nullptr);
  ::_exit(127);
}

/// Prints the address once all devices answer, and opens it in a browser. Says so if they don't answer.
rr::awaitable<void> announce(Gateway& gateway, std::uint16_t port, const DemoLogin* login, bool is_json,
                             bool opens_browser) {
  asio::steady_timer pause(co_await asio::this_coro::executor);
  const auto is_online = [](const auto& device) { return device->state() == DeviceState::online; };
  const auto& devices = gateway.devices().all();
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!gateway.is_stopping() && !std::all_of(devices.begin(), devices.end(), is_online)) {
    if (std::chrono::steady_clock::now() > give_up) {
      log(LogLevel::warning, "some demo devices do not answer; the page shows which");
      break;
    }
    pause.expires_after(std::chrono::milliseconds(50));
    co_await pause.async_wait(asio::as_tuple(asio::use_awaitable));
  }
  if (gateway.is_stopping()) co_return;
  print_address(port, login, is_json);
  if (opens_browser) open_browser("http://127.0.0.1:" + std::to_string(port) + "/");
}

Config make_config(const std::vector<DemoDevice>& devices, std::uint16_t port, const DemoLogin* login) {
  Config config;
  config.listen.push_back({login ? "0.0.0.0" : "127.0.0.1", port});
  if (login) {
    config.insecure = true;  // no phone would believe a certificate that is made for a demo
    config.access.users_file = login->users_file();
  }
  for (const auto& device : devices) {
    DeviceConfig each{device.name, rr::parse_url(device.url()).value()};
    each.mode = DeviceMode::shared;
    each.leases = device.leases;
    each.callbacks = device.callbacks;
    config.devices.push_back(std::move(each));
  }
  config.retry.min = milliseconds(200);
  config.retry.max = milliseconds(2000);
  config.retry.online = milliseconds(3000);
  config.timeouts.drain = milliseconds(500);
  config.log.level = "warning";
  return config;
}

struct DemoOptions {
  std::string system;
  bool is_list = false;
  std::optional<std::uint16_t> port;
  bool is_lan = false;
  bool is_without_browser = false;
  bool is_json = false;
  std::optional<std::size_t> count;
  std::vector<std::string> cameras;
  std::string pictures;
};

/// Which cameras are shown; none of this machine's to other machines, unless that is asked for. Returns what is wrong.
std::string choose_cameras(const DemoOptions& options, std::vector<DemoDevice>& devices) {
  const bool is_chosen = !options.cameras.empty() || !options.pictures.empty();
  const auto shown = std::find_if(devices.begin(), devices.end(), [](const auto& each) { return each.has_cameras; });
  if (shown == devices.end()) return is_chosen ? "--device and --pictures are options of 'demo webcams'" : "";
  for (const auto& camera : options.cameras) shown->arguments.insert(shown->arguments.end(), {"--device", camera});
  if (!options.pictures.empty()) shown->arguments.insert(shown->arguments.end(), {"--pictures", options.pictures});
  if (!is_chosen && options.is_lan) shown->arguments.insert(shown->arguments.end(), {"--device", "none"});
  return {};
}

/// All devices of a fleet are nodes of one program. Returns what is wrong.
std::string choose_count(const DemoOptions& options, std::vector<DemoDevice>& devices) {
  auto further = devices.front();
  if (!further.is_any_number) return options.count ? "--count is an option of 'demo fleet'" : "";
  const auto name = further.name;
  further.program = {};
  devices.resize(options.count.value_or(fleet_count), further);
  for (std::size_t i = 0; i < devices.size(); ++i) devices[i].name = name + '-' + std::to_string(i + 1);
  return {};
}

int demo(const DemoOptions& options) {
  if (options.is_list) return print_systems(options.is_json);
  const auto port = options.port.value_or(is_port_free(preferred_port) ? preferred_port : 0);
  std::optional<DemoLogin> login;
  if (options.is_lan) login.emplace();
  const auto* const user = login ? &*login : nullptr;
  if (user && !user->password()) return report_failure("demo", user->password().error().message);

  const auto systems = list_systems();
  const auto is_wanted = [&options](const DemoSystem& system) { return system.name == options.system; };
  auto devices = std::find_if(systems.begin(), systems.end(), is_wanted)->devices;
  if (const auto mistake = choose_cameras(options, devices); !mistake.empty()) return usage_error("demo", mistake);
  if (const auto mistake = choose_count(options, devices); !mistake.empty()) return usage_error("demo", mistake);
  if (const auto missing = prepare_programs(devices); !missing.empty())
    return report_failure("demo", missing + " not found beside rrgate");
  for (auto& device : devices)
    if (!device.program.empty()) device.process = start_program(device.path, device.arguments);
  for (const auto& device : devices) wait_until_listening(device);

  std::optional<asio::signal_set> deaths;
  std::function<void()> wait_for_death = [&] {
    deaths->async_wait([&](const rr::error_code& error, int) {
      if (error || !deaths) return;  // a signal that came in the last moment is not cancelled
      note_dead_devices(devices);
      wait_for_death();
    });
  };
  const auto code = run_gateway(make_config(devices, port, user), [&](auto& io, Gateway& gateway,
                                                                      const auto& addresses) {
    deaths.emplace(io, SIGCHLD);
    gateway.on_stop([&] { deaths.reset(); });  // it may not outlive `io`
    wait_for_death();
    const bool opens_browser = !options.is_lan && !options.is_without_browser;
    asio::co_spawn(io, announce(gateway, addresses.front().port, user, options.is_json, opens_browser), asio::detached);
  });
  stop_devices(devices);
  return code;
}

}  // namespace

void add_demo(Commands& commands) {
  const auto [app, options] = commands.add("demo", "Run simulated devices and a gateway to them", demo);
  std::vector<std::string> names;
  for (const auto& system : list_systems()) names.emplace_back(system.name);
  options.system = names.front();
  app.add_option("NAME", options.system, "System to simulate; --list shows all")
      ->check(CLI::IsMember(names))
      ->option_text("[" + names.front() + "]");
  app.add_flag("--list", options.is_list, "List the systems and exit");
  app.add_option("--port", options.port, "Port of the page, 0 for any free one; default: 8080 if it is free")
      ->check(CLI::Range(0, 65535))
      ->option_text("N");
  app.add_flag("--lan", options.is_lan, "Allow other machines, with a password that is printed")
      ->envname("RRGATE_DEMO_LAN");
  app.add_option("--count", options.count, "fleet: how many devices")
      ->check(CLI::Range(std::size_t{1}, max_fleet_count))
      ->option_text("N [" + std::to_string(fleet_count) + "]");
  auto* const cameras =
      app.add_option("--device", options.cameras,
                     "webcams: a camera to show, as /dev/video0; may be repeated. auto: all of this machine, or else "
                     "simulated ones; none: simulated ones; default: auto, with --lan none")
          ->allow_extra_args(false)
          ->option_text("PATH");
  app.add_option("--pictures", options.pictures,
                 "webcams: pictures to show, a folder of .jpg files, or a .jpg or .mjpeg file")
      ->excludes(cameras)
      ->option_text("PATH");
  app.add_flag("--no-browser", options.is_without_browser, "Do not open the page in a browser");
  app.add_flag("--json", options.is_json, "Print the address, or with --list each system, as one line of JSON");
}

}  // namespace rrgate
