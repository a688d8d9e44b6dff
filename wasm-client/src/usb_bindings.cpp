// One USB device for ts/usb/usb_module.ts: who it is, then its streams. All exports of rrgate-usb.wasm.
// Layer: wasm-client/src. One instance of the module holds one claim of one device; its memory goes with the instance.
// Statuses are the numbers of rr::UsbStatus. Slots are told as 1 + slot, 0 for none.
#include <array>
#include <limits>

#include "core/hardware/usb_link.hpp"
#include "core/hardware/usb_probe.hpp"
#include "wasm-client/src/js_writer.hpp"

#define RR_EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace {

using namespace rr;

/// A session holds back by itself what the device takes too slowly: it asks for unsent_bytes().
constexpr UsbLinkOptions link_options{.max_unsent_bytes = std::numeric_limits<std::size_t>::max()};
/// What is received is read at once, so that no stream ever holds up the others.
constexpr TimePoint no_time{};

std::vector<UsbInterface> interfaces;
UsbProbe probe;
UsbPipes pipes;
std::optional<UsbLink> usb;  ///< from the first stream on
/// Bytes on their way in or out of this memory.
Bytes buffer;
/// A control request as it goes over the bus (USB 2.0, section 9.3), the data that the host sends behind it.
std::array<std::uint8_t, 16> setup;
std::optional<UsbWrite> writing;
std::optional<UsbRead> reading;

void* show(const UsbControl& request) {
  setup = {request.request_type, request.request};
  const std::uint16_t numbers[] = {request.value, request.index, request.length};
  std::memcpy(setup.data() + 2, numbers, sizeof(numbers));
  std::copy_n(request.data.begin(), std::min(request.data.size(), setup.size() - 8), setup.begin() + 8);
  return setup.data();
}

JsValue make_event(const UsbEvent& event) {
  static constexpr std::string_view kinds[] = {"opened", "readable", "writable", "closed"};
  JsWriter js;
  js.begin_object();
  js.key("kind").name(kinds[static_cast<std::size_t>(event.kind)]);
  js.key("stream").number(event.stream);
  js.key("reason").text(event.reason.message);
  return js.build();
}

}  // namespace

/// Memory for texts that JavaScript hands over. An instance that has no more ends with a trap.
RR_EXPORT(allocate) void* rr_allocate(std::size_t size) {
  return ::operator new(size);
}
/// Room for `size` bytes, for the next call that takes or gives some.
RR_EXPORT(buffer) std::uint8_t* rr_buffer(std::size_t size) {
  buffer.resize(size);
  return buffer.data();
}

// --- what the browser knows of the device ---

RR_EXPORT(add_interface) void rr_add_interface(std::uint8_t number, std::uint8_t alternate, std::uint8_t class_code) {
  interfaces.push_back({number, alternate, class_code, {}});
}
/// Of the interface that was added last.
RR_EXPORT(add_endpoint) void rr_add_endpoint(std::uint8_t address, bool is_bulk, std::uint16_t max_packet_size) {
  interfaces.back().endpoints.push_back({address, is_bulk, max_packet_size});
}

// --- who it is ---

/// While control requests are to be made: undefined. Then {id, name}, or a sentence that says why it is no node.
RR_EXPORT(node) JsHandle rr_node() {
  const auto& result = probe.result();
  if (!result) return JsHandle::undefined;
  if (!*result) return make_js_text(result->error().message).release();
  const auto found = find_usb_pipes(interfaces, (*result)->function.interface);
  if (!found) return make_js_text(found.error().message).release();
  pipes = *found;
  JsWriter js;
  js.begin_object();
  js.key("id").text(format_node_id((*result)->id, NodeIdFormat::dashes));
  js.key("name").text((*result)->name);
  return js.build().release();
}
RR_EXPORT(interface_number) int rr_interface_number() {
  return (*probe.result())->function.interface;
}
RR_EXPORT(in_address) int rr_in_address() {
  return pipes.in.address;
}
RR_EXPORT(out_address) int rr_out_address() {
  return pipes.out.address;
}

// --- told ---

/// Its data lie in the buffer.
RR_EXPORT(handle_control) void rr_handle_control(UsbStatus status, std::size_t size) {
  const auto data = ByteSpan(buffer).first(size);
  if (!probe.result()) return probe.handle_control(status, data);
  usb->handle_control(status, data);
}
RR_EXPORT(handle_written) void rr_handle_written(std::size_t slot, UsbStatus status, std::size_t size) {
  usb->handle_written(slot - 1, status, size);
}
RR_EXPORT(handle_read) void rr_handle_read(std::size_t slot, UsbStatus status, std::size_t size) {
  usb->handle_read(slot - 1, status, size, no_time);
}

// --- asked ---

/// Of a device whose node() is known.
RR_EXPORT(open_stream) UsbStreamKey rr_open_stream() {
  if (!usb) usb.emplace(pipes, (*probe.result())->function.interface, link_options);
  return usb->open_stream();
}
/// What lies in the buffer.
RR_EXPORT(write) std::size_t rr_write(UsbStreamKey stream) {
  return usb->write(stream, buffer);
}
/// Into the buffer.
RR_EXPORT(read) std::size_t rr_read(UsbStreamKey stream) {
  return usb->read(stream, buffer);
}
RR_EXPORT(close_stream) void rr_close_stream(UsbStreamKey stream) {
  usb->close_stream(stream);
}
RR_EXPORT(close) void rr_close(JsHandle reason) {
  if (usb) usb->close(make_error(ErrorCode::connection_error, JsValue(reason).text().value_or("")));
}

// --- answers ---

/// Where the next control request lies; nullptr for none.
RR_EXPORT(poll_control) void* rr_poll_control() {
  if (const auto* request = probe.poll_control()) return show(*request);
  const auto request = usb ? usb->poll_control() : std::nullopt;
  return request ? show(*request) : nullptr;
}
RR_EXPORT(poll_write) std::size_t rr_poll_write() {
  writing = usb->poll_write();
  return writing ? writing->slot + 1 : 0;
}
RR_EXPORT(write_address) const std::uint8_t* rr_write_address() {
  return writing->bytes.data();
}
RR_EXPORT(write_size) std::size_t rr_write_size() {
  return writing->bytes.size();
}
RR_EXPORT(poll_read) std::size_t rr_poll_read() {
  reading = usb->poll_read();
  return reading ? reading->slot + 1 : 0;
}
RR_EXPORT(read_address) const std::uint8_t* rr_read_address() {
  return reading->into.data();
}
RR_EXPORT(read_size) std::size_t rr_read_size() {
  return reading->into.size();
}
RR_EXPORT(poll_event) JsHandle rr_poll_event() {
  const auto event = usb->poll_event();
  return event ? make_event(*event).release() : JsHandle::undefined;
}

// --- looked at ---

RR_EXPORT(has_link) bool rr_has_link() {
  return usb.has_value();
}
RR_EXPORT(is_ending) bool rr_is_ending() {
  return usb && usb->state() >= UsbLinkState::closing;
}
RR_EXPORT(is_closed) bool rr_is_closed() {
  return usb && usb->state() == UsbLinkState::closed;
}
RR_EXPORT(is_sent) bool rr_is_sent(UsbStreamKey stream) {
  return usb->is_sent(stream);
}
RR_EXPORT(unsent_bytes) std::size_t rr_unsent_bytes(UsbStreamKey stream) {
  return usb->unsent_bytes(stream);
}
RR_EXPORT(unread_bytes) std::size_t rr_unread_bytes(UsbStreamKey stream) {
  return usb->unread_bytes(stream);
}
