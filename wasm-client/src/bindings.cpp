// The names under which JavaScript finds the session: those of wasm_session.hpp. Layer: wasm-client/src.
#include <emscripten/bind.h>

#include <cstdlib>

#include "wasm-client/src/wasm_session.hpp"

#ifdef BOOST_NO_EXCEPTIONS
/// Boost reports what cannot happen (a Result read without looking) by throwing; without exceptions the module ends.
namespace boost {
BOOST_NORETURN void throw_exception(const std::exception&) {
  std::abort();
}
BOOST_NORETURN void throw_exception(const std::exception&, const boost::source_location&) {
  std::abort();
}
}  // namespace boost
#endif

EMSCRIPTEN_BINDINGS(rrgate) {
  using emscripten::val;
  using rr::WasmSession;
  emscripten::class_<WasmSession>("Session")
      .constructor<val, double, double>()
      .function("set_now", &WasmSession::set_now)
      .function("receive_buffer", &WasmSession::receive_buffer)
      .function("handle_bytes", &WasmSession::handle_bytes)
      .function("handle_transmitted", &WasmSession::handle_transmitted)
      .function("handle_timeout", &WasmSession::handle_timeout)
      .function("handle_closed", &WasmSession::handle_closed)
      .function("set_request_timeout", &WasmSession::set_request_timeout)
      .function("get_property", &WasmSession::get_property)
      .function("set_property", &WasmSession::set_property)
      .function("call_function", &WasmSession::call_function)
      .function("find_object", &WasmSession::find_object)
      .function("connect_wire", &WasmSession::connect_wire)
      .function("disconnect_wire", &WasmSession::disconnect_wire)
      .function("peek_in_value", &WasmSession::peek_in_value)
      .function("peek_out_value", &WasmSession::peek_out_value)
      .function("poke_out_value", &WasmSession::poke_out_value)
      .function("send_wire", &WasmSession::send_wire)
      .function("cancel", &WasmSession::cancel)
      .function("disconnect", &WasmSession::disconnect)
      .function("poll_transmit", &WasmSession::poll_transmit)
      .function("wants_close", &WasmSession::wants_close)
      .function("poll_timeout", &WasmSession::poll_timeout)
      .function("poll_event", &WasmSession::poll_event)
      .function("take_error", &WasmSession::take_error)
      .function("queued_bytes", &WasmSession::queued_bytes)
      .function("stats", &WasmSession::stats)
      .function("peer", &WasmSession::peer)
      .function("attributes", &WasmSession::attributes)
      .function("definitions", &WasmSession::definitions)
      .function("members", &WasmSession::members)
      .function("child_path", &WasmSession::child_path);
}
