#include "wasm-client/src/wasm_session.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/session/service_path.hpp"
#include "wasm-client/src/object_info.hpp"
#include "wasm-client/src/session_options.hpp"
#include "wasm-client/src/value_from_js.hpp"
#include "wasm-client/src/value_to_js.hpp"

namespace rr {

namespace {

Now make_now(double steady, double utc) {
  const auto since_start = std::chrono::duration<double, std::milli>(steady);
  Now now;
  now.steady = TimePoint(std::chrono::duration_cast<TimePoint::duration>(since_start));
  const double seconds = std::floor(utc / 1000);
  now.utc.seconds = static_cast<std::int64_t>(seconds);
  now.utc.nanoseconds = static_cast<std::int32_t>((utc - seconds * 1000) * 1e6);
  return now;
}

std::string text_of(const val& js) {
  return JsValue(js).text().value_or(std::string());
}

val make_event(std::string_view kind) {
  const val event = make_js_object();
  set_js_field(event, "kind", make_js_text(kind));
  return event;
}

val make_member_event(std::string_view kind, std::string_view path, std::string_view member) {
  const val event = make_event(kind);
  set_js_field(event, "path", make_js_text(path));
  set_js_field(event, "member", make_js_text(member));
  return event;
}

bool is_varvalue(const TypeDefinition& type) {
  return type.type == DataType::varvalue_t;
}

}  // namespace

WasmSession::WasmSession(val options, double steady, double utc) : now_(make_now(steady, utc)) {
  auto read = read_session_options(JsValue(std::move(options)));
  if (read.has_value())
    session_.emplace(std::move(*read), now_);
  else
    failure_ = read.error();
}

void WasmSession::set_now(double steady, double utc) {
  now_ = make_now(steady, utc);
}

// --- told ---

std::uintptr_t WasmSession::receive_buffer(std::size_t size) {
  if (received_.size() < size) received_.resize(size);
  return reinterpret_cast<std::uintptr_t>(received_.data());
}

void WasmSession::handle_bytes(std::size_t size) {
  if (session_ && size <= received_.size()) session_->handle_bytes({received_.data(), size}, now_);
}

void WasmSession::handle_transmitted(std::size_t size) {
  if (session_) session_->handle_transmitted(size, now_);
}

void WasmSession::handle_timeout() {
  if (session_) session_->handle_timeout(now_);
}

void WasmSession::handle_closed(val reason) {
  if (session_) session_->handle_closed(make_error(ErrorCode::connection_error, text_of(reason)), now_);
}

// --- asked ---

void WasmSession::set_request_timeout(double milliseconds) {
  constexpr double a_month = 31.0 * 24 * 3600 * 1000;
  if (session_ && milliseconds > 0)
    session_->set_request_timeout(
        std::chrono::milliseconds(static_cast<std::int64_t>(std::min(milliseconds, a_month))));
}

RequestId WasmSession::get_property(val path, val member) {
  if (!session_) return refuse({}, {});
  const auto object = text_of(path);
  const auto name = text_of(member);
  return remember(session_->get_property(object, name, now_), object, name);
}

RequestId WasmSession::set_property(val path, val member, val value) {
  const auto object = text_of(path);
  const auto name = text_of(member);
  const auto* definition = find_member(object, name);
  if (!definition) return refuse(object, name);
  const auto read = read_value(JsValue(std::move(value)), definition->type, name);
  return read ? session_->set_property(object, name, *read, now_) : 0;
}

RequestId WasmSession::call_function(val path, val member, val arguments) {
  const auto object = text_of(path);
  const auto name = text_of(member);
  const auto* definition = find_member(object, name);
  if (!definition) return refuse(object, name);
  const JsValue given(std::move(arguments));
  std::vector<Value> values;
  values.reserve(definition->parameters.size());
  for (std::size_t i = 0; i < definition->parameters.size(); ++i) {
    const auto& parameter = definition->parameters[i];
    auto value = read_value(given.at(i).value_or(JsValue::undefined()), parameter.type, parameter.name);
    if (!value) return 0;
    values.push_back(std::move(*value));
  }
  return remember(session_->call_function(object, name, values, now_), object, name);
}

RequestId WasmSession::find_object(val path) {
  return session_ ? session_->find_object(text_of(path), now_) : refuse({}, {});
}

RequestId WasmSession::connect_wire(val path, val member) {
  return session_ ? session_->connect_wire(text_of(path), text_of(member), now_) : refuse({}, {});
}

RequestId WasmSession::disconnect_wire(val path, val member) {
  return session_ ? session_->disconnect_wire(text_of(path), text_of(member), now_) : refuse({}, {});
}

RequestId WasmSession::peek_in_value(val path, val member) {
  if (!session_) return refuse({}, {});
  const auto object = text_of(path);
  const auto name = text_of(member);
  return remember(session_->peek_in_value(object, name, now_), object, name);
}

RequestId WasmSession::peek_out_value(val path, val member) {
  if (!session_) return refuse({}, {});
  const auto object = text_of(path);
  const auto name = text_of(member);
  return remember(session_->peek_out_value(object, name, now_), object, name);
}

RequestId WasmSession::poke_out_value(val path, val member, val value) {
  const auto object = text_of(path);
  const auto name = text_of(member);
  const auto* definition = find_member(object, name);
  if (!definition) return refuse(object, name);
  const auto read = read_value(JsValue(std::move(value)), definition->type, name);
  return read ? session_->poke_out_value(object, name, *read, now_) : 0;
}

bool WasmSession::send_wire(val path, val member, val value) {
  const auto object = text_of(path);
  const auto name = text_of(member);
  const auto* definition = find_member(object, name);
  if (!definition) return refuse(object, name) != 0;
  const auto read = read_value(JsValue(std::move(value)), definition->type, name);
  if (!read) return false;
  const auto sent = session_->send_wire(object, name, *read, now_);
  if (sent.has_error()) error_ = sent.error();
  return sent.has_value();
}

void WasmSession::cancel(RequestId id) {
  varvalue_replies_.erase(id);
  if (session_) session_->cancel(id);
}

void WasmSession::disconnect() {
  if (session_) session_->disconnect(now_);
}

// --- answers ---

val WasmSession::poll_transmit(std::size_t limit) {
  const auto slices = session_ ? session_->poll_transmit() : std::span<const ByteSpan>{};
  if (slices.empty()) return val::undefined();
  return make_js_view(slices.front().first(std::min(limit, slices.front().size())));
}

bool WasmSession::wants_close() const {
  return !session_ || session_->wants_close();
}

double WasmSession::poll_timeout() const {
  const auto at = session_ ? session_->poll_timeout() : TimePoint::max();
  if (at == TimePoint::max()) return std::numeric_limits<double>::infinity();
  return std::chrono::duration<double, std::milli>(at.time_since_epoch()).count();
}

val WasmSession::poll_event() {
  if (failure_) {
    const val event = make_event("closed");
    set_js_field(event, "error", to_js(*failure_, TypeRegistry()));
    failure_.reset();
    return event;
  }
  if (!session_) return val::undefined();
  const auto event = session_->poll_event();
  return event ? event_to_js(*event) : val::undefined();
}

val WasmSession::event_to_js(const ClientEvent& event) {
  const auto& types = session_->types();
  if (const auto* connected = std::get_if<Connected>(&event)) {
    const val js = make_event("connected");
    set_js_field(js, "type", make_js_text(connected->object_type));
    return js;
  }
  if (const auto* completed = std::get_if<Completed>(&event)) {
    const bool brings_type = varvalue_replies_.erase(completed->id) > 0;
    const bool is_ok = completed->result.has_value();
    const val js = make_event(is_ok ? "completed" : "failed");
    set_js_field(js, "id", make_js_number(completed->id));
    if (is_ok)
      set_js_field(js, "value", to_js(*completed->result, types, brings_type));
    else
      set_js_field(js, "error", to_js(completed->result.error(), types));
    return js;
  }
  if (const auto* received = std::get_if<EventReceived>(&event)) {
    const val js = make_member_event("event", received->path, received->member);
    const auto* member = find_member(received->path, received->member);
    const val arguments = make_js_array();
    for (std::size_t i = 0; i < received->arguments.size(); ++i) {
      const bool brings_type = member && i < member->parameters.size() && is_varvalue(member->parameters[i].type);
      push_js(arguments, to_js(received->arguments[i], types, brings_type));
    }
    set_js_field(js, "arguments", arguments);
    return js;
  }
  if (const auto* received = std::get_if<WireValueReceived>(&event)) {
    const val js = make_member_event("wire", received->path, received->member);
    const auto* member = find_member(received->path, received->member);
    set_js_field(js, "seconds", make_js_number(static_cast<double>(received->time.seconds)));
    set_js_field(js, "nanoseconds", make_js_number(received->time.nanoseconds));
    set_js_field(js, "value", to_js(received->value, types, member && is_varvalue(member->type)));
    return js;
  }
  if (const auto* closed = std::get_if<WireClosedByService>(&event))
    return make_member_event("wire_closed", closed->path, closed->member);
  if (const auto* released = std::get_if<PathReleased>(&event)) {
    const val js = make_event("path_released");
    set_js_field(js, "path", make_js_text(released->path));
    return js;
  }
  const val js = make_event("closed");
  set_js_field(js, "error", to_js(std::get_if<SessionClosed>(&event)->reason, types));
  return js;
}

val WasmSession::take_error() {
  const auto error = error_.value_or(make_error(ErrorCode::internal_error, "the request failed without a reason"));
  error_.reset();
  return session_ ? to_js(error, session_->types()) : to_js(error, TypeRegistry());
}

// --- looked at ---

std::size_t WasmSession::queued_bytes() const {
  return session_ ? session_->connection().queued_bytes() : 0;
}

val WasmSession::stats() const {
  const auto stats = session_ ? session_->connection().stats() : ConnectionStats{};
  const val js = make_js_object();
  set_js_field(js, "messagesReceived", make_js_number(static_cast<double>(stats.messages_received)));
  set_js_field(js, "messagesSent", make_js_number(static_cast<double>(stats.messages_sent)));
  set_js_field(js, "bytesReceived", make_js_number(static_cast<double>(stats.bytes_received)));
  set_js_field(js, "bytesSent", make_js_number(static_cast<double>(stats.bytes_sent)));
  return js;
}

val WasmSession::peer() const {
  const auto peer = session_ ? session_->connection().peer() : NodeIdentity{};
  const val js = make_js_object();
  set_js_field(js, "id", make_js_text(format_node_id(peer.id, NodeIdFormat::dashes)));
  set_js_field(js, "name", make_js_text(peer.name));
  return js;
}

val WasmSession::attributes() const {
  return session_ ? to_js(Value(session_->attributes()), session_->types(), true) : make_js_map();
}

val WasmSession::definitions() const {
  const val texts = make_js_array();
  if (session_)
    for (const auto& definition : session_->types().definitions()) push_js(texts, make_js_text(definition->text));
  return texts;
}

val WasmSession::members(val path) const {
  const auto* type = session_ ? session_->object_type(text_of(path)) : nullptr;
  return type ? make_js_members(*type) : val::undefined();
}

val WasmSession::child_path(val parent, val member, val index) const {
  const JsValue given(std::move(index));
  if (given.kind() != JsKind::text) return make_js_text(rr::child_path(text_of(parent), text_of(member)));
  return make_js_text(rr::child_path(text_of(parent), text_of(member), text_of(given.handle())));
}

const MemberDefinition* WasmSession::find_member(std::string_view path, std::string_view member) const {
  const auto* type = session_ ? session_->object_type(path) : nullptr;
  return type ? type->find_member(member) : nullptr;
}

std::optional<Value> WasmSession::read_value(const JsValue& js, const TypeDefinition& type, std::string_view name) {
  auto value = from_js(js, type, session_->types(), FieldPath{nullptr, FieldPath::Step::field, 0, name, {}});
  if (value.has_value()) return std::move(*value);
  error_ = value.error();
  return std::nullopt;
}

RequestId WasmSession::refuse(std::string_view path, std::string_view member) {
  error_ = !session_ || session_->state() != ClientState::connected
               ? make_error(ErrorCode::connection_error, "the session is not connected")
               : make_error(ErrorCode::object_not_found,
                            "object " + quoted(path) + " with member " + quoted(member) + " is not known (any more)");
  return 0;
}

RequestId WasmSession::remember(RequestId id, std::string_view path, std::string_view member) {
  if (const auto* definition = find_member(path, member); definition && is_varvalue(definition->type))
    varvalue_replies_.insert(id);
  return id;
}

}  // namespace rr
