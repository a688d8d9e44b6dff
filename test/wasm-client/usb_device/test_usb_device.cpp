// The names under which ../fake_usb.ts finds the simulated device. One instance of the module is one device.
// Bytes go through one buffer, in both directions; a size below 0 is a status: -1 - rr::UsbStatus. A NAK is nak.
#include <memory>

#include "test/core/hardware/simulated_device.hpp"
#include "wasm-client/src/js_access.hpp"

#define RR_EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace {

using namespace rr;

constexpr int nak = -100;

std::unique_ptr<test::SimulatedDevice> device;
Bytes buffer;

int give(const test::UsbReply& reply) {
  if (reply.status != UsbStatus::ok) return -1 - static_cast<int>(reply.status);
  buffer = reply.data;
  return static_cast<int>(buffer.size());
}

int give_streams(const std::vector<std::int32_t>& streams) {
  buffer.resize(streams.size() * sizeof(std::int32_t));
  std::memcpy(buffer.data(), streams.data(), buffer.size());
  return static_cast<int>(buffer.size());
}

}  // namespace

RR_EXPORT(allocate) void* rr_allocate(std::size_t size) {
  return ::operator new(size);
}
RR_EXPORT(buffer) std::uint8_t* rr_buffer(std::size_t size) {
  buffer.resize(size);
  return buffer.data();
}
RR_EXPORT(address) std::uint8_t* rr_address() {
  return buffer.data();
}
RR_EXPORT(start)
void rr_start(JsHandle name, std::uint8_t last_id_byte, std::uint8_t interface, std::uint8_t vendor_code,
              std::uint16_t packet_size, std::size_t max_streams, std::uint8_t class_code) {
  test::SimulatedDeviceOptions options;
  options.name = *JsValue(name).text();
  options.id.bytes.back() = last_id_byte;
  options.interface = interface;
  options.vendor_code = vendor_code;
  options.packet_size = packet_size;
  options.max_streams = max_streams;
  options.class_code = class_code;
  device = std::make_unique<test::SimulatedDevice>(options);
}

// --- the bus ---

RR_EXPORT(configuration) int rr_configuration() {
  return give({UsbStatus::ok, device->configuration_descriptor()});
}
/// The data of an OUT request lie in the buffer.
RR_EXPORT(control)
int rr_control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
               std::uint16_t length) {
  UsbControl control{type, request, value, index, length};
  if (!control.is_in()) control.data = buffer;
  return give(device->control(control));
}
RR_EXPORT(bulk_out) int rr_bulk_out() {
  const auto status = device->bulk_out(buffer);
  if (!status) return nak;
  return *status == UsbStatus::ok ? static_cast<int>(buffer.size()) : -1 - static_cast<int>(*status);
}
RR_EXPORT(bulk_in) int rr_bulk_in() {
  const auto reply = device->bulk_in();
  return reply ? give(*reply) : nak;
}

// --- the application ---

RR_EXPORT(take_opened) int rr_take_opened() {
  return give_streams(device->take_opened());
}
RR_EXPORT(take_closed) int rr_take_closed() {
  return give_streams(device->take_closed());
}
RR_EXPORT(take_input) int rr_take_input(std::int32_t stream) {
  return give({UsbStatus::ok, device->take_input(stream)});
}
RR_EXPORT(send) void rr_send(std::int32_t stream) {
  device->send(stream, buffer);
}
RR_EXPORT(close) void rr_close(std::int32_t stream) {
  device->close(stream);
}
RR_EXPORT(notify) void rr_notify(std::int32_t stream, std::uint16_t code) {
  device->notify(stream, code);
}
RR_EXPORT(stream_count) std::size_t rr_stream_count() {
  return device->stream_count();
}

// --- faults ---

RR_EXPORT(stall_next_in) void rr_stall_next_in() {
  device->stall_next_in();
}
RR_EXPORT(stall_next_out) void rr_stall_next_out() {
  device->stall_next_out();
}
RR_EXPORT(stall_control) void rr_stall_control(std::uint8_t request) {
  device->stall_control(request);
}
RR_EXPORT(unplug) void rr_unplug() {
  device->unplug();
}
/// What lies in the buffer.
RR_EXPORT(send_raw) void rr_send_raw() {
  device->send_raw(buffer);
}
RR_EXPORT(replace_block) void rr_replace_block() {
  device->replace_block(buffer);
}
RR_EXPORT(replace_bos) void rr_replace_bos() {
  device->replace_bos(buffer);
}
RR_EXPORT(replace_string) void rr_replace_string(std::uint8_t index) {
  device->replace_string(index, buffer);
}
RR_EXPORT(answer_connect) void rr_answer_connect() {
  device->answer_connect(buffer);
}
RR_EXPORT(answer_reset) void rr_answer_reset() {
  device->answer_reset(buffer);
}
