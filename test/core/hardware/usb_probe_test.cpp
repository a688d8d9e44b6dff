#include "core/hardware/usb_probe.hpp"

#include <catch2/catch.hpp>

#include "core/support/hex.hpp"
#include "test/core/hardware/simulated_device.hpp"
#include "test/support/golden.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

Result<UsbNodeInfo> probe(SimulatedDevice& device, std::optional<UsbFunction> function = {}) {
  UsbProbe probe(function);
  for (int requests = 0; requests < 20; ++requests) {
    const auto* request = probe.poll_control();
    if (!request) return *probe.result();
    const auto reply = device.control(*request);
    probe.handle_control(reply.status, reply.data);
  }
  return protocol_error("no end of requests");
}

std::string refusal(const Result<UsbNodeInfo>& result) {
  return result ? "accepted" : result.error().message;
}

/// As in the trace of the spec: bmRequestType bRequest wValue wIndex wLength.
std::string transcript(const SimulatedDevice& device) {
  std::string out;
  for (const auto& request : device.control_log())
    out += hex_text(request.request_type, 2) + " " + hex_text(request.request, 2) + " " + hex_text(request.value, 4) +
           " " + hex_text(request.index, 4) + " " + std::to_string(request.length) + "\n";
  return out;
}

}  // namespace

TEST_CASE("a probe asks for BOS, block and strings, and finds the node") {
  SimulatedDevice device;
  const auto found = probe(device);
  REQUIRE(found);
  CHECK(found->id == SimulatedDeviceOptions().id);
  CHECK(found->name == "simulated.device");
  CHECK(found->function == UsbFunction{});
  CHECK(transcript(device) ==
        "80 06 0f00 0000 5\n"
        "80 06 0f00 0000 36\n"
        "c1 ba 0000 0500 8\n"
        "c1 ba 0000 0500 22\n"
        "80 06 0300 0409 255\n"
        "80 06 0304 0409 255\n"
        "80 06 0305 0409 255\n");
}

TEST_CASE("a BOS that is known already is not asked for") {
  SimulatedDevice device;
  REQUIRE(probe(device, UsbFunction{}));
  CHECK(device.control_log().front().request == 0xBA);
}

TEST_CASE("interface number and vendor code are the device's own") {
  SimulatedDevice device({.interface = 2, .vendor_code = 0xB7});
  const auto found = probe(device);
  REQUIRE(found);
  CHECK(found->function == UsbFunction{2, 0xB7});
  CHECK(device.control_log()[2].request == 0xB7);
  CHECK(device.control_log()[2].index == 0x0502);
}

TEST_CASE("strings are asked for in the device's first language; the name may be empty") {
  SimulatedDevice device;
  device.replace_string(0, from_hex("0603 0704 0904"));
  device.replace_string(5, from_hex("0203"));
  const auto found = probe(device);
  REQUIRE(found);
  CHECK(found->name.empty());
  CHECK(device.control_log().back().index == 0x0407);
}

TEST_CASE("a device that is not ours or breaks a rule is refused, with the reason") {
  SimulatedDevice device;
  SECTION("no BOS at all") {
    device.replace_bos({});
    CHECK(refusal(probe(device)) == "USB BOS descriptor: refused by the device (stall)");
  }
  SECTION("a BOS without our capability") {
    device.replace_bos(from_hex("05 0f 0c00 01  07 10 02 00000000"));
    CHECK(refusal(probe(device)) == "USB BOS descriptor: no Robot Raconteur capability");
    CHECK(probe(device).error().code == ErrorCode::node_not_found);
  }
  SECTION("the second answer is shorter than the block") {
    device.replace_block(from_hex("0800 0000 0001 1700 0e00 0100 0000 0001 04 05 0100 0101"));
    CHECK(refusal(probe(device)) == "USB descriptor block length: found 22, expected 23");
  }
  SECTION("a block longer than 8192 bytes is not asked for") {
    device.replace_block(from_hex("0800 0000 0001 ffff"));
    CHECK(refusal(probe(device)) == "USB descriptor block wTotalLength: found 65535, expected 8 to 8192");
    CHECK(device.control_log().back().length == 8);
  }
  SECTION("a NodeID that is none") {
    device.replace_string(4, usb_string("twelve"));
    CHECK(refusal(probe(device)).rfind("USB NodeID string: ", 0) == 0);
  }
  SECTION("a NodeName that is none") {
    device.replace_string(5, usb_string("a name"));
    CHECK(refusal(probe(device)) == "USB NodeName string: 'a name' is not a node name");
  }
  SECTION("a string is missing") {
    device.replace_block(from_hex("0800 0000 0001 1600 0e00 0100 0000 0001 04 09 0100 0101"));
    CHECK(refusal(probe(device)) == "USB NodeName string: refused by the device (stall)");
    CHECK(probe(device).error().code == ErrorCode::connection_error);
  }
  SECTION("the device vanishes") {
    device.unplug();
    CHECK(refusal(probe(device)) == "USB BOS descriptor: the device is gone");
  }
}

TEST_CASE("a probe ends at whichever request fails") {
  for (std::size_t step = 0; step < 7; ++step) {
    SimulatedDevice device;
    UsbProbe probe;
    for (std::size_t at = 0; at < step; ++at) {
      const auto reply = device.control(*probe.poll_control());
      probe.handle_control(reply.status, reply.data);
    }
    REQUIRE(probe.poll_control());
    probe.handle_control(UsbStatus::timed_out, {});
    CHECK_FALSE(probe.poll_control());
    CHECK(probe.has_function() == (step >= 2));
    REQUIRE(probe.result());
    CHECK(probe.result()->error().code == ErrorCode::connection_error);
    CHECK(probe.result()->error().message.find("no answer in time") != std::string::npos);
  }
}
