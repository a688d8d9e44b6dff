// What the host sees of USB before any transfer, with the real libusb and udev library on a simulated /sys and /dev
// (umockdev-wrapper): enumeration, what is worth asking, hot-plug.
#include <dlfcn.h>
#include <libusb-1.0/libusb.h>
#include <umockdev.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <catch2/catch.hpp>
#include <memory>

#include "node/discovery/machine_nodes.hpp"
#include "node/transport/hardware.hpp"
#include "node/transport/usb_host.hpp"
#include "test/core/hardware/simulated_device.hpp"
#include "test/support/golden.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;
namespace asio = boost::asio;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
using Catch::Matchers::StartsWith;

namespace {

/// A computer with nothing plugged in.
class Machine {
 public:
  Machine() : testbed_(umockdev_testbed_new(), g_object_unref) {}

  /// `bos`  what the kernel shows of it; empty: the kernel does not show it.
  std::string plug_in(int address, const SimulatedDevice& device, const Bytes& bos) {
    auto descriptors = device.device_descriptor();
    const auto configuration = device.configuration_descriptor();
    descriptors.insert(descriptors.end(), configuration.begin(), configuration.end());
    const auto number = std::to_string(address);
    auto text = "P: /devices/pci0000:00/usb1/1-" + number + "\nN: bus/usb/001/00" + number +
                "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: MAJOR=189\nE: MINOR=" + number +
                "\nE: DEVNAME=/dev/bus/usb/001/00" + number + "\nE: BUSNUM=001\nE: DEVNUM=00" + number +
                "\nA: busnum=1\\n\nA: devnum=" + number + "\\n\nA: bConfigurationValue=1\\n\nA: speed=480\\n\n" +
                "H: descriptors=" + to_hex(descriptors) + "\n";
    if (!bos.empty()) text += "H: bos_descriptors=" + to_hex(bos) + "\n";
    GError* error = nullptr;
    if (!umockdev_testbed_add_from_string(testbed_.get(), text.c_str(), &error)) FAIL(error->message);
    return "/sys/devices/pci0000:00/usb1/1-" + number;
  }

  void tell(const std::string& path, const char* action) {
    umockdev_testbed_uevent(testbed_.get(), path.c_str(), action);
  }
  void remove(const std::string& path) { umockdev_testbed_remove_device(testbed_.get(), path.c_str()); }

 private:
  std::unique_ptr<UMockdevTestbed, void (*)(void*)> testbed_;
};

UsbHost::Found scan(asio::io_context& io) {
  UsbHost::Found found;
  bool is_done = false;
  asio::co_spawn(
      io, [&]() -> awaitable<void> { found = co_await UsbHost::of(io.get_executor()).scan(); },
      [&](std::exception_ptr) {
        is_done = true;
        io.stop();
      });
  io.restart();
  io.run_for(5s);
  REQUIRE(is_done);
  return found;
}

/// Devices take requests and never answer, until one of them is cancelled.
class Silence {
 public:
  explicit Silence(asio::io_context& io) : io_(io) { current = this; }
  ~Silence() { current = nullptr; }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

  int take(libusb_transfer* transfer) {
    pending_ = transfer;
    return 0;
  }
  int cancel() {
    current = nullptr;
    asio::post(io_, [this] {
      auto* cancelled = std::exchange(pending_, nullptr);
      cancelled->status = LIBUSB_TRANSFER_CANCELLED;
      cancelled->callback(cancelled);
    });
    return 0;
  }
  bool has_pending() const { return pending_ != nullptr; }

  static Silence* current;

 private:
  asio::io_context& io_;
  libusb_transfer* pending_ = nullptr;
};
Silence* Silence::current = nullptr;

using OnTransfer = int (*)(libusb_transfer*);
OnTransfer next_of(const char* name) {
  return reinterpret_cast<OnTransfer>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// Instead of those of libusb, which they call.

int LIBUSB_CALL libusb_submit_transfer(libusb_transfer* transfer) {
  return Silence::current ? Silence::current->take(transfer) : next_of(__func__)(transfer);
}

int LIBUSB_CALL libusb_cancel_transfer(libusb_transfer* transfer) {
  return Silence::current ? Silence::current->cancel() : next_of(__func__)(transfer);
}

TEST_CASE("devices are enumerated with their interfaces, endpoints and places") {
  Machine machine;
  machine.plug_in(4, SimulatedDevice({.interface = 2, .packet_size = 512}), {});
  asio::io_context io{1};
  const auto context = UsbContext::make(io.get_executor());
  REQUIRE(context);
  const auto devices = (*context)->devices();
  REQUIRE(devices.size() == 1);
  const auto& device = devices[0];
  CHECK(device.key == "1,4");
  CHECK(device.node == "/dev/bus/usb/001/004");
  CHECK(device.usb_version == 0x0201);
  CHECK(device.configuration == 1);
  CHECK(device.description() == "USB device " + device.path + " (1209:5252)");
  REQUIRE(device.interfaces.size() == 3);
  const auto pipes = find_usb_pipes(device.interfaces, 2);
  REQUIRE(pipes);
  CHECK(pipes->in.address == 0x81);
  CHECK(pipes->out.address == 0x02);
  CHECK(pipes->in.max_packet_size == 512);
}

TEST_CASE("only what may be a node is opened; what then fails is said") {
  Machine machine;
  asio::io_context io{1};
  CHECK(scan(io).problems.empty());
  // Not vendor specific, and ours by class but not by its BOS.
  machine.plug_in(4, SimulatedDevice({.class_code = 0x08}), {});
  machine.plug_in(5, SimulatedDevice(), from_hex("05 0f 0c00 01  07 10 02 00000000"));
  auto found = scan(io);
  CHECK(found.nodes.empty());
  CHECK(found.problems.empty());
  // This one would be, but the simulated node takes no requests.
  machine.plug_in(6, SimulatedDevice(), usb_bos(0, 0xBA));
  found = scan(io);
  CHECK(found.nodes.empty());
  REQUIRE(found.problems.size() == 1);
  CHECK(found.problems[0].find("(1209:5252): ") != std::string::npos);
  // And this one says by its BOS, which is asked for once, that it is ours, but breaks a rule.
  auto longer = usb_bos(0, 0xBA);
  longer[2] = 37;
  longer[12] = 25;
  longer.push_back(0);
  machine.plug_in(7, SimulatedDevice(), longer);
  for (int times = 0; times < 2; ++times) {
    const auto problems = scan(io).problems;
    REQUIRE(problems.size() == 2);
    CHECK_THAT(problems[1], EndsWith("(1209:5252): USB Robot Raconteur capability bLength: found 25, expected 24"));
  }
}

TEST_CASE("a watch looks again soon after the system tells of a device, and only of those that matter") {
  Machine machine;
  asio::io_context io{1};
  int looks = 0;
  const HardwareWatch watch(
      io.get_executor(), [&](const auto&) { ++looks; }, [](const std::string& problem) { FAIL_CHECK(problem); }, 60s);
  io.run_for(200ms);
  REQUIRE(looks == 1);
  const auto path = machine.plug_in(4, SimulatedDevice({.class_code = 0x08}), {});
  for (int times = 0; times < 5; ++times) machine.tell(path, "change");
  io.run_for(1s);
  CHECK(looks == 2);  // several news, one look
  machine.tell(path, "remove");
  io.run_for(1s);
  CHECK(looks == 3);  // not only the first time
}

TEST_CASE("a watch tells once why a device can't be used, and again when it is plugged in anew") {
  Machine machine;
  asio::io_context io{1};
  int looks = 0;
  std::vector<std::string> problems;
  const HardwareWatch watch(
      io.get_executor(), [&](const auto&) { ++looks; }, [&](const auto& problem) { problems.push_back(problem); }, 1ms);
  const auto look_again = [&] {
    const auto enough = looks + 3;
    for (int handlers = 0; looks < enough && handlers < 1000; ++handlers) io.run_one_for(5s);
    REQUIRE(looks >= enough);
  };
  auto path = machine.plug_in(6, SimulatedDevice(), usb_bos(0, 0xBA));
  look_again();
  REQUIRE(problems.size() == 1);
  CHECK_THAT(problems[0], Contains("(1209:5252): "));
  machine.remove(path);
  look_again();
  path = machine.plug_in(6, SimulatedDevice(), usb_bos(0, 0xBA));
  look_again();
  CHECK(problems.size() == 2);
}

TEST_CASE("a watch that ends waits for no device that does not answer, and who waits for its look looks again") {
  Machine machine;
  machine.plug_in(6, SimulatedDevice(), usb_bos(0, 0xBA));
  asio::io_context io{1};
  const Silence silence(io);
  std::optional<HardwareWatch> watch;
  watch.emplace(
      io.get_executor(), [](const auto&) {}, [](const std::string& problem) { FAIL_CHECK(problem); }, 60s);
  for (int handlers = 0; !silence.has_pending() && handlers < 1000; ++handlers) io.run_one_for(5s);
  REQUIRE(silence.has_pending());
  std::optional<UsbHost::Found> found;
  asio::co_spawn(
      io, [&]() -> awaitable<void> { found = co_await UsbHost::of(io.get_executor()).scan(); },
      [](std::exception_ptr) {});
  asio::post(io, [&] { watch.reset(); });
  io.run_for(5s);
  CHECK(io.stopped());  // nothing is left to do
  CHECK_FALSE(silence.has_pending());
  REQUIRE(found);
  CHECK(found->problems.size() == 1);  // as this one was asked and has answered
}

TEST_CASE("discovery reports a device that can't be used") {
  Machine machine;
  machine.plug_in(6, SimulatedDevice(), usb_bos(0, 0xBA));
  asio::io_context io{1};
  std::string reported;
  MachineNodes::Callbacks callbacks;
  callbacks.is_own = [](const NodeId&) { return false; };
  callbacks.report = [&](const std::string& problem) {
    reported = problem;
    io.stop();
  };
  const MachineNodes nodes(io.get_executor(), {.intra = false, .local = false}, std::move(callbacks));
  io.run_for(5s);
  CHECK_THAT(reported, StartsWith("plugged-in nodes: USB device ") && Contains("(1209:5252): "));
}
