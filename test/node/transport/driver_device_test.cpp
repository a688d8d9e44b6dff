// A device with a kernel driver, as the host sees it: a class folder and a character device. The class folder is a
// scratch one, and a pseudo-terminal in raw mode is the character device.
#include "node/transport/driver_device.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "node/transport/hardware.hpp"
#include "test/support/print.hpp"

using namespace rr;
namespace asio = boost::asio;
namespace fs = std::filesystem;
using namespace std::chrono_literals;

namespace {

constexpr const char* id_text = "10203040-5060-7080-90a0-b0c0d0e0f001";

void ignore_problem(const std::string&) {}  // this computer's USB may have some

/// /sys/class/robotraconteur and /dev, in a scratch folder.
class Machine {
 public:
  Machine() {
    char name[] = "/tmp/rr-driver-XXXXXX";
    root_ = ::mkdtemp(name);
    fs::create_directories(root_ / "class");
    fs::create_directories(root_ / "dev");
  }
  ~Machine() {
    for (const int number : terminals_)
      if (number >= 0) ::close(number);
    fs::remove_all(root_);
  }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  DriverRoots roots() const { return {root_ / "class", root_ / "dev"}; }

  void add(const std::string& name, const std::string& transport, const std::string& id, const std::string& node_name) {
    fs::create_directories(root_ / "class" / name);
    const auto put = [&](const char* attribute, const std::string& text) {
      if (!text.empty()) std::ofstream(root_ / "class" / name / attribute) << text;
    };
    put("transport", transport);
    put("nodeid", id);
    put("nodename", node_name);
  }

  /// Returns the driver's end of the character device.
  int add_device(const std::string& name) {
    const int driver = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    REQUIRE(driver >= 0);
    REQUIRE(::grantpt(driver) == 0);
    REQUIRE(::unlockpt(driver) == 0);
    const char* path = ::ptsname(driver);
    // Raw mode lasts as long as somebody has the terminal open.
    const int host = ::open(path, O_RDWR | O_NOCTTY);
    termios settings{};
    ::tcgetattr(host, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(host, TCSANOW, &settings);
    fs::create_symlink(path, root_ / "dev" / name);
    terminals_.push_back(host);
    terminals_.push_back(driver);
    return driver;
  }

  void unplug(int driver) {
    for (int& number : terminals_)
      if (number == driver) {
        ::close(number);
        number = -1;
      }
  }

  const fs::path& root() const { return root_; }

 private:
  fs::path root_;
  std::vector<int> terminals_;
};

/// Runs one coroutine to its end.
void run(std::function<awaitable<void>()> body) {
  asio::io_context io{1};
  bool is_done = false;
  asio::co_spawn(
      io, [&]() -> awaitable<void> { co_await body(); },
      [&](std::exception_ptr failure) {
        is_done = true;
        io.stop();
        if (failure) std::rethrow_exception(failure);
      });
  io.run_for(10s);
  REQUIRE(is_done);
}

DialOptions quick() {
  DialOptions options;
  options.send_stall = 200ms;
  return options;
}

Result<std::unique_ptr<ByteStream>> dialed(const Machine& machine, const std::string& url,
                                           std::function<awaitable<void>(ByteStream&)> body = {}) {
  Result<std::unique_ptr<ByteStream>> result = make_error(ErrorCode::none, "");
  run([&]() -> awaitable<void> {
    auto stream = co_await dial_hardware(parse_url(url).value(), quick(), machine.roots());
    if (stream && body) co_await body(**stream);
    // A stream does not outlive its loop.
    if (stream)
      (*stream)->close();
    else
      result = stream.error();
  });
  return result;
}

std::string refusal(const Machine& machine, const std::string& url) {
  const auto result = dialed(machine, url);
  return result ? "connected" : result.error().message;
}

Bytes read_driver(int driver, std::size_t size) {
  Bytes out(size);
  std::size_t have = 0;
  for (int tries = 0; have < size && tries < 100; ++tries) {
    const auto got = ::read(driver, out.data() + have, size - have);
    if (got > 0) have += static_cast<std::size_t>(got);
  }
  out.resize(have);
  return out;
}

}  // namespace

TEST_CASE("drivers are found by their attributes, with and without white space around them") {
  Machine machine;
  machine.add("rr0", "pci", id_text, "arm.one");
  machine.add("rr1", "usb\n", "{" + std::string(id_text) + "}\n", " arm.two \n");
  machine.add("rr2", "bluetooth", "", "arm.three");
  machine.add("rr3", "pci", "nonsense", "arm.four");
  machine.add("unnamed", "pci", "nonsense", "not a name");
  machine.add("no-transport", "", id_text, "arm.five");
  machine.add("other", "serial", id_text, "arm.six");
  machine.add("long", "pci", "", std::string(100'000, 'x'));
  const auto found = find_driver_devices(machine.roots());
  REQUIRE(found.size() == 5);
  CHECK(found[0].name == "long");
  CHECK(found[0].node_name == std::string(256, 'x'));  // attributes have no more
  CHECK(found[1].name == "rr0");
  CHECK(found[1].transport == "pci");
  CHECK(found[1].id == parse_node_id(id_text).value());
  CHECK(found[1].node_name == "arm.one");
  CHECK(found[2].transport == "usb");
  CHECK(found[2].id == parse_node_id(id_text).value());
  CHECK(found[2].node_name == "arm.two");
  CHECK(found[3].transport == "bluetooth");
  CHECK(found[3].id.is_any());
  CHECK(found[4].id.is_any());
  CHECK(found[4].node_name == "arm.four");

  CHECK(find_driver_devices({"/no/such/folder", "/dev"}).empty());
}

TEST_CASE("drivers are listed under their own scheme only") {
  Machine machine;
  machine.add("rr0", "pci", id_text, "arm.one");
  machine.add("rr1", "usb", "", "arm.two");
  machine.add("rr2", "bluetooth", "", "arm.three");
  std::vector<HardwareNode> nodes;
  run([&]() -> awaitable<void> {
    auto found = co_await list_hardware_nodes(machine.roots());
    nodes = std::move(found.nodes);
  });
  REQUIRE(nodes.size() >= 2);  // this computer's USB may have more
  CHECK(nodes[0].url == "rr+pci:///?nodeid=10203040-5060-7080-90a0-b0c0d0e0f001&service=RobotRaconteurServiceIndex");
  CHECK(nodes[1].url == "rr+usb:///?nodename=arm.two&service=RobotRaconteurServiceIndex");
}

TEST_CASE("an open device carries bytes both ways; each stream opens it anew") {
  Machine machine;
  machine.add("rr0", "pci", id_text, "arm.one");
  const int driver = machine.add_device("rr0");
  for (const std::string who : {"nodename=arm.one", "nodeid=10203040-5060-7080-90a0-b0c0d0e0f001",
                                "nodeid=10203040-5060-7080-90a0-b0c0d0e0f001&nodename=arm.one"}) {
    const auto result = dialed(machine, "rr+pci:///?" + who + "&service=x", [&](ByteStream& stream) -> awaitable<void> {
      CHECK(stream.peer() == machine.roots().devices + "/rr0");
      const ByteSpan slices[] = {as_bytes("RR"), {}, as_bytes("AC")};
      const auto error = co_await stream.write(slices);
      CHECK_FALSE(error);
      CHECK(as_text(read_driver(driver, 4)) == "RRAC");
      CHECK(::write(driver, "\0\r\n\x04\xff", 5) == 5);
      Bytes into(100);
      std::size_t count = 0;
      while (count < 5) {
        const auto read = co_await stream.read_some(std::span(into).subspan(count));
        if (read.error || read.is_end()) break;
        count += read.bytes;
      }
      CHECK(std::string(as_text(ByteSpan(into).first(count))) == std::string("\0\r\n\x04\xff", 5));
    });
    CHECK(result.error().code == ErrorCode::none);
  }
}

TEST_CASE("a driver that goes away ends the stream") {
  Machine machine;
  machine.add("rr0", "pci", "", "arm.one");
  const int driver = machine.add_device("rr0");
  dialed(machine, "rr+pci:///?nodename=arm.one&service=x", [&](ByteStream& stream) -> awaitable<void> {
    machine.unplug(driver);
    Bytes into(1);
    const auto read = co_await stream.read_some(into);
    CHECK((read.error || read.is_end()));
    const ByteSpan slices[] = {as_bytes("late")};
    const auto error = co_await stream.write(slices);
    CHECK(error);
  });
}

TEST_CASE("a device that takes nothing stalls the write, which ends in time") {
  Machine machine;
  machine.add("rr0", "pci", "", "arm.one");
  machine.add_device("rr0");
  dialed(machine, "rr+pci:///?nodename=arm.one&service=x", [&](ByteStream& stream) -> awaitable<void> {
    const Bytes much(1'000'000, 'x');
    const ByteSpan slices[] = {much};
    const auto error = co_await stream.write(slices);
    CHECK(error == asio::error::timed_out);
  });
}

TEST_CASE("cancel() ends a read and leaves the device open") {
  Machine machine;
  machine.add("rr0", "pci", "", "arm.one");
  const int driver = machine.add_device("rr0");
  dialed(machine, "rr+pci:///?nodename=arm.one&service=x", [&](ByteStream& stream) -> awaitable<void> {
    asio::steady_timer soon(stream.executor(), 20ms);
    soon.async_wait([&](const error_code&) { stream.cancel(); });
    Bytes into(10);
    const auto cancelled = co_await stream.read_some(into);
    CHECK(cancelled.error == asio::error::operation_aborted);
    CHECK(::write(driver, "x", 1) == 1);
    const auto read = co_await stream.read_some(into);
    CHECK(read.bytes == 1);
  });
}

TEST_CASE("what cannot be reached is said with its reason") {
  Machine machine;
  machine.add("rr0", "pci", id_text, "arm.one");
  machine.add("rr1", "usb", "", "arm.two");
  machine.add("rr2", "pci", "", "arm.three");
  std::ofstream(machine.root() / "dev" / "rr2") << "a file";
  const auto classes = machine.roots().classes;
  CHECK(refusal(machine, "rr+pci:///?nodename=other&service=x") ==
        "rr+pci:///?nodename=other&service=x: no driver in " + classes + " has such a node");
  // Both have to match.
  CHECK(
      refusal(machine, "rr+pci:///?nodename=arm.two&nodeid=" + std::string(id_text) + "&service=x").find("no driver") !=
      std::string::npos);
  // Another transport's device.
  CHECK(refusal(machine, "rr+pci:///?nodename=arm.two&service=x").find("no driver") != std::string::npos);
  CHECK(refusal(machine, "rr+pci:///?nodename=arm.one&service=x") ==
        machine.roots().devices + "/rr0: open: No such file or directory");
  CHECK(refusal(machine, "rr+pci:///?nodename=arm.three&service=x") ==
        machine.roots().devices + "/rr2: not a character device: No such device");
}

TEST_CASE("without permission the message says what to do") {
  Machine machine;
  machine.add("rr0", "pci", "", "arm.one");
  machine.add_device("rr0");
  fs::permissions(machine.root() / "dev", fs::perms::none);
  const bool was_root = ::geteuid() == 0;
  fs::permissions(machine.root(), fs::perms::all);
  fs::permissions(machine.root() / "class", fs::perms::all);
  if (was_root) REQUIRE(::seteuid(65534) == 0);
  const auto message = refusal(machine, "rr+pci:///?nodename=arm.one&service=x");
  if (was_root) REQUIRE(::seteuid(0) == 0);
  fs::permissions(machine.root() / "dev", fs::perms::owner_all);
  CHECK(message.find("permission denied; this user needs to read and write it: see 60-robotraconteur-usb.rules, and "
                     "/etc/apparmor.d/local/rrgate where AppArmor confines the service") != std::string::npos);
}

TEST_CASE("a watch hands out the list at once and again") {
  Machine machine;
  machine.add("rr0", "pci", "", "arm.one");
  asio::io_context io{1};
  std::vector<std::vector<std::string>> seen;
  auto watch = std::make_unique<HardwareWatch>(
      io.get_executor(),
      [&](const std::vector<HardwareNode>& nodes) {
        seen.emplace_back();
        for (const auto& node : nodes)
          if (node.scheme == "rr+pci") seen.back().push_back(node.name);
        if (seen.size() == 1) machine.add("rr1", "pci", "", "arm.two");
        if (seen.size() == 2) io.stop();
      },
      ignore_problem, 20ms, machine.roots());
  io.run_for(5s);
  REQUIRE(seen.size() == 2);
  CHECK(seen[0] == std::vector<std::string>{"arm.one"});
  CHECK(seen[1] == std::vector<std::string>{"arm.one", "arm.two"});
  watch.reset();
  io.restart();
  io.run_for(100ms);
  CHECK(seen.size() == 2);  // no call any more
}

TEST_CASE("a watch that is ended by what it calls leaves nothing to wait for") {
  const Machine machine;
  asio::io_context io{1};
  std::unique_ptr<HardwareWatch> watch;
  watch = std::make_unique<HardwareWatch>(
      io.get_executor(), [&](const std::vector<HardwareNode>&) { watch.reset(); }, ignore_problem, 30s,
      machine.roots());
  io.run_for(10s);
  CHECK_FALSE(watch);
  CHECK(io.stopped());
}
