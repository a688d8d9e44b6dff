// The names under which ts/serve/service_module.ts finds the service: those of wasm_service.hpp. All exports of
// rrgate-serve.wasm. Layer: wasm-client/src. One instance of the module holds one service.
#include "wasm-client/src/value_to_js.hpp"
#include "wasm-client/src/wasm_service.hpp"

#define RR_EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace {

using rr::JsHandle;
using rr::JsValue;

rr::WasmService* service = nullptr;
rr::ByteSpan transmitting;

}  // namespace

/// Memory for bytes and texts that JavaScript hands over. An instance that has no more ends with a trap.
RR_EXPORT(allocate) void* rr_allocate(std::size_t size) {
  return ::operator new(size);
}
/// The service, once; or what is wrong with it.
RR_EXPORT(begin) JsHandle rr_begin(JsHandle options, JsHandle root) {
  auto made = rr::WasmService::make(JsValue(options), JsValue(root));
  if (!made) return rr::to_js(made.error(), rr::TypeRegistry()).release();
  service = made->release();
  return JsHandle::undefined;
}
RR_EXPORT(set_now) void rr_set_now(double steady, double utc) {
  service->set_now(steady, utc);
}
RR_EXPORT(open) std::uint32_t rr_open(JsHandle url) {
  return service->open(JsValue(url));
}
RR_EXPORT(forget) void rr_forget(std::uint32_t client) {
  service->forget(client);
}

// --- told ---

RR_EXPORT(receive_buffer) std::uint8_t* rr_receive_buffer(std::size_t size) {
  return service->receive_buffer(size);
}
RR_EXPORT(handle_bytes) void rr_handle_bytes(std::uint32_t client, std::size_t size) {
  service->handle_bytes(client, size);
}
RR_EXPORT(handle_transmitted) void rr_handle_transmitted(std::uint32_t client, std::size_t size) {
  service->handle_transmitted(client, size);
}
RR_EXPORT(handle_timeout) void rr_handle_timeout(std::uint32_t client) {
  service->handle_timeout(client);
}
RR_EXPORT(handle_closed) void rr_handle_closed(std::uint32_t client, JsHandle reason) {
  service->handle_closed(client, JsValue(reason));
}

// --- asked ---

RR_EXPORT(reply) JsHandle rr_reply(std::uint32_t client, double call, JsHandle value) {
  return service->reply(client, call, JsValue(value)).release();
}
RR_EXPORT(fail) void rr_fail(std::uint32_t client, double call, JsHandle error) {
  service->fail(client, call, JsValue(error));
}
RR_EXPORT(send_event) JsHandle rr_send_event(JsHandle path, JsHandle type, JsHandle member, JsHandle arguments) {
  return service->send_event(JsValue(path), JsValue(type), JsValue(member), JsValue(arguments)).release();
}
RR_EXPORT(send_wire)
JsHandle rr_send_wire(std::uint32_t client, JsHandle path, JsHandle type, JsHandle member, JsHandle value) {
  return service->send_wire(client, JsValue(path), JsValue(type), JsValue(member), JsValue(value)).release();
}
RR_EXPORT(accept_pipe) void rr_accept_pipe(std::uint32_t client, double pipe) {
  service->accept_pipe(client, pipe);
}
RR_EXPORT(refuse_pipe) void rr_refuse_pipe(std::uint32_t client, double pipe, JsHandle error) {
  service->refuse_pipe(client, pipe, JsValue(error));
}
RR_EXPORT(send_pipe) JsHandle rr_send_pipe(std::uint32_t client, double pipe, JsHandle value) {
  return service->send_pipe(client, pipe, JsValue(value)).release();
}
RR_EXPORT(close_pipe) void rr_close_pipe(std::uint32_t client, double pipe) {
  service->close_pipe(client, pipe);
}
RR_EXPORT(call_callback)
JsHandle rr_call_callback(std::uint32_t client, JsHandle path, JsHandle type, JsHandle member, JsHandle arguments) {
  return service->call_callback(client, JsValue(path), JsValue(type), JsValue(member), JsValue(arguments)).release();
}
RR_EXPORT(release) void rr_release(JsHandle path) {
  service->release(JsValue(path));
}
RR_EXPORT(close_service) void rr_close_service() {
  service->close_service();
}

// --- answers ---

RR_EXPORT(poll_transmit) std::size_t rr_poll_transmit(std::uint32_t client, std::size_t limit) {
  transmitting = service->poll_transmit(client, limit);
  return transmitting.size();
}
/// Where those bytes lie.
RR_EXPORT(transmit_address) const std::uint8_t* rr_transmit_address() {
  return transmitting.data();
}
RR_EXPORT(wants_close) bool rr_wants_close(std::uint32_t client) {
  return service->wants_close(client);
}
RR_EXPORT(poll_timeout) double rr_poll_timeout(std::uint32_t client) {
  return service->poll_timeout(client);
}
RR_EXPORT(poll_event) JsHandle rr_poll_event(std::uint32_t client) {
  return service->poll_event(client).release();
}

// --- looked at ---

RR_EXPORT(queued_bytes) std::size_t rr_queued_bytes(std::uint32_t client) {
  return service->queued_bytes(client);
}
RR_EXPORT(members) JsHandle rr_members(JsHandle type) {
  return service->members(JsValue(type)).release();
}
