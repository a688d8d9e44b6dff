// The names under which ts/wasm_module.ts finds the session: those of wasm_session.hpp. Layer: wasm-client/src.
// One instance of the module holds one session; its memory goes with the instance.
#include "wasm-client/src/session_options.hpp"
#include "wasm-client/src/value_to_js.hpp"
#include "wasm-client/src/wasm_session.hpp"

#define RR_EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace {

using rr::ClientSession;
using rr::JsHandle;
using rr::JsValue;
using rr::RequestId;

rr::WasmSession* session = nullptr;
rr::ByteSpan transmitting;

}  // namespace

/// Memory for bytes and texts that JavaScript hands over. An instance that has no more ends with a trap.
RR_EXPORT(allocate) void* rr_allocate(std::size_t size) {
  return ::operator new(size);
}
/// The session, once; or what is wrong with the options.
RR_EXPORT(open) JsHandle rr_open(JsHandle options, double steady, double utc) {
  auto read = rr::read_session_options(JsValue(options));
  if (read.has_error()) return rr::to_js(read.error(), rr::TypeRegistry()).release();
  session = new rr::WasmSession(std::move(*read), steady, utc);
  return JsHandle::undefined;
}
RR_EXPORT(set_now) void rr_set_now(double steady, double utc) {
  session->set_now(steady, utc);
}

// --- told ---

RR_EXPORT(receive_buffer) std::uint8_t* rr_receive_buffer(std::size_t size) {
  return session->receive_buffer(size);
}
RR_EXPORT(handle_bytes) void rr_handle_bytes(std::size_t size) {
  session->handle_bytes(size);
}
RR_EXPORT(handle_transmitted) void rr_handle_transmitted(std::size_t size) {
  session->handle_transmitted(size);
}
RR_EXPORT(handle_timeout) void rr_handle_timeout() {
  session->handle_timeout();
}
RR_EXPORT(handle_closed) void rr_handle_closed(JsHandle reason) {
  session->handle_closed(JsValue(reason));
}

// --- asked ---

RR_EXPORT(set_urgent) void rr_set_urgent(bool is_urgent) {
  session->set_urgent(is_urgent);
}
RR_EXPORT(set_request_timeout) void rr_set_request_timeout(double milliseconds) {
  session->set_request_timeout(milliseconds);
}
RR_EXPORT(get_property) RequestId rr_get_property(JsHandle path, JsHandle member) {
  return session->ask(&ClientSession::get_property, JsValue(path), JsValue(member));
}
RR_EXPORT(set_property) RequestId rr_set_property(JsHandle path, JsHandle member, JsHandle value) {
  return session->ask(&ClientSession::set_property, JsValue(path), JsValue(member), JsValue(value));
}
RR_EXPORT(call_function) RequestId rr_call_function(JsHandle path, JsHandle member, JsHandle arguments) {
  return session->call_function(JsValue(path), JsValue(member), JsValue(arguments));
}
RR_EXPORT(open_generator) RequestId rr_open_generator(JsHandle path, JsHandle member, JsHandle arguments) {
  return session->open_generator(JsValue(path), JsValue(member), JsValue(arguments));
}
/// `step` a rr::GeneratorStep.
RR_EXPORT(step_generator)
RequestId rr_step_generator(int step, JsHandle path, JsHandle member, std::int32_t index, JsHandle parameter) {
  return session->step_generator(static_cast<rr::GeneratorStep>(step), JsValue(path), JsValue(member), index,
                                 JsValue(parameter));
}
RR_EXPORT(get_memory_dimensions) RequestId rr_get_memory_dimensions(JsHandle path, JsHandle member) {
  return session->ask(&ClientSession::get_memory_dimensions, JsValue(path), JsValue(member));
}
RR_EXPORT(read_memory)
RequestId rr_read_memory(JsHandle path, JsHandle member, JsHandle position, JsHandle count) {
  return session->read_memory(JsValue(path), JsValue(member), JsValue(position), JsValue(count));
}
RR_EXPORT(write_memory)
RequestId rr_write_memory(JsHandle path, JsHandle member, JsHandle position, JsHandle value) {
  return session->write_memory(JsValue(path), JsValue(member), JsValue(position), JsValue(value));
}
RR_EXPORT(find_object) RequestId rr_find_object(JsHandle path) {
  return session->find_object(JsValue(path));
}
RR_EXPORT(connect_wire) RequestId rr_connect_wire(JsHandle path, JsHandle member) {
  return session->ask(&ClientSession::connect_wire, JsValue(path), JsValue(member));
}
RR_EXPORT(disconnect_wire) RequestId rr_disconnect_wire(JsHandle path, JsHandle member) {
  return session->ask(&ClientSession::disconnect_wire, JsValue(path), JsValue(member));
}
RR_EXPORT(peek_in_value) RequestId rr_peek_in_value(JsHandle path, JsHandle member) {
  return session->ask(&ClientSession::peek_in_value, JsValue(path), JsValue(member));
}
RR_EXPORT(peek_out_value) RequestId rr_peek_out_value(JsHandle path, JsHandle member) {
  return session->ask(&ClientSession::peek_out_value, JsValue(path), JsValue(member));
}
RR_EXPORT(poke_out_value) RequestId rr_poke_out_value(JsHandle path, JsHandle member, JsHandle value) {
  return session->ask(&ClientSession::poke_out_value, JsValue(path), JsValue(member), JsValue(value));
}
RR_EXPORT(send_wire) bool rr_send_wire(JsHandle path, JsHandle member, JsHandle value) {
  return session->send_wire(JsValue(path), JsValue(member), JsValue(value));
}
RR_EXPORT(connect_pipe) RequestId rr_connect_pipe(JsHandle path, JsHandle member, std::int32_t index) {
  return session->connect_pipe(JsValue(path), JsValue(member), index);
}
RR_EXPORT(disconnect_pipe) RequestId rr_disconnect_pipe(JsHandle path, JsHandle member, std::int32_t index) {
  return session->disconnect_pipe(JsValue(path), JsValue(member), index);
}
RR_EXPORT(send_pipe_packet)
double rr_send_pipe_packet(JsHandle path, JsHandle member, std::int32_t index, JsHandle value, bool wants_ack) {
  return session->send_pipe_packet(JsValue(path), JsValue(member), index, JsValue(value), wants_ack);
}
RR_EXPORT(authenticate) RequestId rr_authenticate(JsHandle username, JsHandle credentials) {
  return session->authenticate(JsValue(username), JsValue(credentials));
}
RR_EXPORT(logout) RequestId rr_logout() {
  return session->logout();
}
RR_EXPORT(get_attributes) RequestId rr_get_attributes() {
  return session->get_attributes();
}
RR_EXPORT(lock) RequestId rr_lock(JsHandle path, bool is_for_client) {
  return session->lock(JsValue(path), is_for_client ? rr::LockKind::client : rr::LockKind::user);
}
RR_EXPORT(unlock) RequestId rr_unlock(JsHandle path) {
  return session->unlock(JsValue(path));
}
RR_EXPORT(enter_monitor) RequestId rr_enter_monitor(JsHandle path, double milliseconds) {
  return session->enter_monitor(JsValue(path), milliseconds);
}
/// `command` a rr::LeaseCommand.
RR_EXPORT(lease) RequestId rr_lease(JsHandle path, int command, double deadman) {
  return session->lease(JsValue(path), static_cast<rr::LeaseCommand>(command), deadman);
}
RR_EXPORT(exit_monitor) RequestId rr_exit_monitor(JsHandle path) {
  return session->exit_monitor(JsValue(path));
}
RR_EXPORT(reply_callback) JsHandle rr_reply_callback(double id, JsHandle path, JsHandle member, JsHandle value) {
  return session->reply_callback(id, JsValue(path), JsValue(member), JsValue(value)).release();
}
RR_EXPORT(fail_callback) void rr_fail_callback(double id, JsHandle error) {
  session->fail_callback(id, JsValue(error));
}
RR_EXPORT(cancel) void rr_cancel(RequestId id) {
  session->cancel(id);
}
RR_EXPORT(disconnect) void rr_disconnect() {
  session->disconnect();
}

// --- answers ---

RR_EXPORT(poll_transmit) std::size_t rr_poll_transmit(std::size_t limit) {
  transmitting = session->poll_transmit(limit);
  return transmitting.size();
}
/// Where those bytes lie.
RR_EXPORT(transmit_address) const std::uint8_t* rr_transmit_address() {
  return transmitting.data();
}
RR_EXPORT(wants_close) bool rr_wants_close() {
  return session->wants_close();
}
RR_EXPORT(poll_timeout) double rr_poll_timeout() {
  return session->poll_timeout();
}
RR_EXPORT(poll_event) JsHandle rr_poll_event() {
  return session->poll_event().release();
}
RR_EXPORT(take_error) JsHandle rr_take_error() {
  return session->take_error().release();
}

// --- looked at ---

RR_EXPORT(queued_bytes) std::size_t rr_queued_bytes() {
  return session->queued_bytes();
}
RR_EXPORT(stats) JsHandle rr_stats() {
  return session->stats().release();
}
RR_EXPORT(peer) JsHandle rr_peer() {
  return session->peer().release();
}
RR_EXPORT(attributes) JsHandle rr_attributes() {
  return session->attributes().release();
}
RR_EXPORT(definitions) JsHandle rr_definitions() {
  return session->definitions().release();
}
RR_EXPORT(known_definitions) JsHandle rr_known_definitions() {
  return session->known_definitions().release();
}
RR_EXPORT(definition) JsHandle rr_definition(JsHandle name) {
  return session->definition(JsValue(name)).release();
}
RR_EXPORT(members) JsHandle rr_members(JsHandle path) {
  return session->members(JsValue(path)).release();
}
