#include "wasm-client/src/wasm_session.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "wasm-client/src/js_events.hpp"
#include "wasm-client/src/object_info.hpp"
#include "wasm-client/src/value_from_js.hpp"
#include "wasm-client/src/value_to_js.hpp"

namespace rr {

namespace {

JsValue make_member_event(std::string_view kind, std::string_view path, std::string_view member) {
  const JsValue event = make_js_event(kind);
  set_js_field(event, "path", make_js_text(path));
  set_js_field(event, "member", make_js_text(member));
  return event;
}

/// `event` one of those of pipe endpoints.
template <class Event>
JsValue make_pipe_event(std::string_view kind, const Event& event) {
  const JsValue js = make_member_event(kind, event.path, event.member);
  set_js_field(js, "index", make_js_number(event.index));
  return js;
}

}  // namespace

WasmSession::WasmSession(ClientOptions options, double steady, double utc)
    : now_(make_now(steady, utc)), session_(std::move(options), now_) {}

void WasmSession::set_now(double steady, double utc) {
  now_ = make_now(steady, utc);
}

// --- told ---

std::uint8_t* WasmSession::receive_buffer(std::size_t size) {
  if (received_.size() < size) received_.resize(size);
  return received_.data();
}

void WasmSession::handle_bytes(std::size_t size) {
  if (size <= received_.size()) session_.handle_bytes({received_.data(), size}, now_);
}

void WasmSession::handle_transmitted(std::size_t size) {
  session_.handle_transmitted(size, now_);
}

void WasmSession::handle_timeout() {
  session_.handle_timeout(now_);
}

void WasmSession::handle_closed(const JsValue& reason) {
  session_.handle_closed(make_error(ErrorCode::connection_error, text_of(reason)), now_);
}

// --- asked ---

void WasmSession::set_request_timeout(double milliseconds) {
  if (milliseconds > 0) session_.set_request_timeout(to_milliseconds(milliseconds));
}

RequestId WasmSession::ask(MemberRequest request, const JsValue& path, const JsValue& member) {
  const auto target = find_target(path, member);
  if (!target) return 0;
  return remember((session_.*request)(target->path, target->member, now_), target->definition->type);
}

RequestId WasmSession::ask(ValueRequest request, const JsValue& path, const JsValue& member, const JsValue& value) {
  const auto target = find_target(path, member);
  if (!target) return 0;
  const auto read = read_value(value, target->definition->type, target->member);
  return read ? (session_.*request)(target->path, target->member, *read, now_) : 0;
}

RequestId WasmSession::call_function(const JsValue& path, const JsValue& member, const JsValue& arguments) {
  const auto target = find_target(path, member);
  const auto values = target ? read_arguments(arguments, *target->definition) : std::nullopt;
  if (!values) return 0;
  return remember(session_.call_function(target->path, target->member, *values, now_), target->definition->type);
}

RequestId WasmSession::open_generator(const JsValue& path, const JsValue& member, const JsValue& arguments) {
  const auto target = find_target(path, member);
  const auto values = target ? read_arguments(arguments, *target->definition) : std::nullopt;
  return values ? session_.open_generator(target->path, target->member, *values, now_) : 0;
}

RequestId WasmSession::step_generator(GeneratorStep step, const JsValue& path, const JsValue& member,
                                      std::int32_t index, const JsValue& parameter) {
  const auto target = find_target(path, member);
  if (!target) return 0;
  switch (step) {
    case GeneratorStep::close:
      return session_.close_generator(target->path, target->member, index, now_);
    case GeneratorStep::abort:
      return session_.abort_generator(target->path, target->member, index, now_);
    case GeneratorStep::next:
      break;
  }
  std::optional<Value> value;
  const auto& parameters = target->definition->parameters;
  if (!parameters.empty() && parameters.back().type.container == ContainerKind::generator) {
    value = read_value(parameter, parameters.back().type, parameters.back().name);
    if (!value) return 0;
  }
  return remember(session_.next_generator(target->path, target->member, index, value, now_), target->definition->type);
}

RequestId WasmSession::read_memory(const JsValue& path, const JsValue& member, const JsValue& position,
                                   const JsValue& count) {
  const auto target = find_target(path, member);
  const auto from = target ? read_range(position, "position") : std::nullopt;
  const auto size = from ? read_range(count, "count") : std::nullopt;
  if (!size) return 0;
  return session_.read_memory(target->path, target->member, from->get_if<Array>()->items<std::uint64_t>(),
                              size->get_if<Array>()->items<std::uint64_t>(), now_);
}

RequestId WasmSession::write_memory(const JsValue& path, const JsValue& member, const JsValue& position,
                                    const JsValue& value) {
  const auto target = find_target(path, member);
  const auto from = target ? read_range(position, "position") : std::nullopt;
  const auto read = from ? read_value(value, target->definition->type, target->member) : std::nullopt;
  if (!read) return 0;
  return session_.write_memory(target->path, target->member, from->get_if<Array>()->items<std::uint64_t>(), *read,
                               now_);
}

RequestId WasmSession::find_object(const JsValue& path) {
  return session_.find_object(text_of(path), now_);
}

bool WasmSession::send_wire(const JsValue& path, const JsValue& member, const JsValue& value) {
  const auto target = find_target(path, member);
  if (!target) return false;
  const auto read = read_value(value, target->definition->type, target->member);
  if (!read) return false;
  const auto sent = session_.send_wire(target->path, target->member, *read, now_);
  if (sent.has_error()) error_ = sent.error();
  return sent.has_value();
}

RequestId WasmSession::connect_pipe(const JsValue& path, const JsValue& member, std::int32_t index) {
  const auto target = find_target(path, member);
  return target ? session_.connect_pipe(target->path, target->member, index, now_) : 0;
}

RequestId WasmSession::disconnect_pipe(const JsValue& path, const JsValue& member, std::int32_t index) {
  return session_.disconnect_pipe(text_of(path), text_of(member), index, now_);
}

double WasmSession::send_pipe_packet(const JsValue& path, const JsValue& member, std::int32_t index,
                                     const JsValue& value, bool wants_ack) {
  const auto target = find_target(path, member);
  if (!target) return -1;
  const auto read = read_value(value, target->definition->type, target->member);
  if (!read) return -1;
  const auto sent = session_.send_pipe_packet(target->path, target->member, index, *read, now_, wants_ack);
  if (sent) return *sent;
  error_ = sent.error();
  return -1;
}

RequestId WasmSession::authenticate(const JsValue& username, const JsValue& credentials) {
  TypeDefinition type;
  type.type = DataType::varvalue_t;
  type.container = ContainerKind::map_string;
  const auto read = read_value(credentials, type, "credentials");
  return read ? session_.authenticate(text_of(username), *read, now_) : 0;
}

RequestId WasmSession::logout() {
  return session_.logout(now_);
}

RequestId WasmSession::get_attributes() {
  return session_.get_attributes(now_);
}

RequestId WasmSession::lock(const JsValue& path, LockKind kind) {
  return session_.lock(text_of(path), kind, now_);
}

RequestId WasmSession::unlock(const JsValue& path) {
  return session_.unlock(text_of(path), now_);
}

RequestId WasmSession::enter_monitor(const JsValue& path, double milliseconds) {
  return session_.enter_monitor(text_of(path), to_milliseconds(milliseconds), now_);
}

RequestId WasmSession::lease(const JsValue& path, LeaseCommand command, double deadman) {
  return session_.lease(text_of(path), command, to_milliseconds(deadman), now_);
}

RequestId WasmSession::exit_monitor(const JsValue& path) {
  return session_.exit_monitor(text_of(path), now_);
}

JsValue WasmSession::reply_callback(double id, const JsValue& path, const JsValue& member, const JsValue& value) {
  const auto call = static_cast<CallbackId>(id);
  const auto target = find_target(path, member);
  std::optional<Value> read;
  if (target)
    read = target->definition->type.type == DataType::void_t
               ? Value{}
               : read_value(value, target->definition->type, target->member);
  session_.reply_callback(call, read ? Result<Value>(std::move(*read)) : Result<Value>(*error_), now_);
  return read ? JsValue::undefined() : take_error();
}

void WasmSession::fail_callback(double id, const JsValue& error) {
  session_.reply_callback(static_cast<CallbackId>(id), error_from_js(error), now_);
}

void WasmSession::cancel(RequestId id) {
  varvalue_replies_.erase(id);
  session_.cancel(id);
}

void WasmSession::disconnect() {
  session_.disconnect(now_);
}

// --- answers ---

ByteSpan WasmSession::poll_transmit(std::size_t limit) {
  const auto slices = session_.poll_transmit();
  if (slices.empty()) return {};
  return slices.front().first(std::min(limit, slices.front().size()));
}

bool WasmSession::wants_close() const {
  return session_.wants_close();
}

double WasmSession::poll_timeout() const {
  return to_js_time(session_.poll_timeout());
}

JsValue WasmSession::poll_event() {
  const auto event = session_.poll_event();
  return event ? event_to_js(*event) : JsValue::undefined();
}

JsValue WasmSession::event_to_js(const ClientEvent& event) {
  const auto& types = session_.types();
  if (const auto* connected = std::get_if<Connected>(&event)) {
    const JsValue js = make_js_event("connected");
    set_js_field(js, "type", make_js_text(connected->object_type));
    return js;
  }
  if (const auto* completed = std::get_if<Completed>(&event)) {
    const bool brings_type = varvalue_replies_.erase(completed->id) > 0;
    const bool is_ok = completed->result.has_value();
    const JsValue js = make_js_event(is_ok ? "completed" : "failed");
    set_js_field(js, "id", make_js_number(completed->id));
    if (is_ok)
      set_js_field(js, "value", to_js(*completed->result, types, brings_type));
    else
      set_js_field(js, "error", to_js(completed->result.error(), types));
    return js;
  }
  if (const auto* received = std::get_if<EventReceived>(&event)) {
    const JsValue js = make_member_event("event", received->path, received->member);
    const auto* member = find_member(received->path, received->member);
    set_js_field(js, "arguments", make_js_arguments(received->arguments, member, types));
    return js;
  }
  if (const auto* called = std::get_if<CallbackCalled>(&event)) {
    const JsValue js = make_member_event("callback", called->path, called->member);
    const auto* member = find_member(called->path, called->member);
    set_js_field(js, "id", make_js_number(static_cast<double>(called->id)));
    set_js_field(js, "arguments", make_js_arguments(called->arguments, member, types));
    return js;
  }
  if (const auto* received = std::get_if<WireValueReceived>(&event)) {
    const JsValue js = make_member_event("wire", received->path, received->member);
    const auto* member = find_member(received->path, received->member);
    set_js_field(js, "seconds", make_js_number(static_cast<double>(received->time.seconds)));
    set_js_field(js, "nanoseconds", make_js_number(received->time.nanoseconds));
    set_js_field(js, "value", to_js(received->value, types, member && is_varvalue(member->type)));
    return js;
  }
  if (const auto* closed = std::get_if<WireClosedByService>(&event))
    return make_member_event("wire_closed", closed->path, closed->member);
  if (const auto* received = std::get_if<PipePacketReceived>(&event)) {
    const JsValue js = make_pipe_event("pipe", *received);
    const auto* member = find_member(received->path, received->member);
    set_js_field(js, "value", to_js(received->value, types, member && is_varvalue(member->type)));
    return js;
  }
  if (const auto* acknowledged = std::get_if<PipePacketsAcknowledged>(&event)) {
    const JsValue js = make_pipe_event("pipe_acks", *acknowledged);
    const JsValue numbers = make_js_array();
    for (const auto number : acknowledged->numbers) push_js(numbers, make_js_number(number));
    set_js_field(js, "numbers", numbers);
    return js;
  }
  if (const auto* closed = std::get_if<PipeClosedByService>(&event)) return make_pipe_event("pipe_closed", *closed);
  if (const auto* released = std::get_if<PathReleased>(&event)) {
    const JsValue js = make_js_event("path_released");
    set_js_field(js, "path", make_js_text(released->path));
    return js;
  }
  const JsValue js = make_js_event("closed");
  set_js_field(js, "error", to_js(std::get_if<SessionClosed>(&event)->reason, types));
  return js;
}

JsValue WasmSession::take_error() {
  const auto error = error_.value_or(make_error(ErrorCode::internal_error, "the request failed without a reason"));
  error_.reset();
  return to_js(error, session_.types());
}

// --- looked at ---

std::size_t WasmSession::queued_bytes() const {
  return session_.connection().queued_bytes();
}

JsValue WasmSession::stats() const {
  const auto stats = session_.connection().stats();
  const JsValue js = make_js_object();
  set_js_field(js, "messagesReceived", make_js_number(static_cast<double>(stats.messages_received)));
  set_js_field(js, "messagesSent", make_js_number(static_cast<double>(stats.messages_sent)));
  set_js_field(js, "bytesReceived", make_js_number(static_cast<double>(stats.bytes_received)));
  set_js_field(js, "bytesSent", make_js_number(static_cast<double>(stats.bytes_sent)));
  return js;
}

JsValue WasmSession::peer() const {
  const auto peer = session_.connection().peer();
  const JsValue js = make_js_object();
  set_js_field(js, "id", make_js_text(format_node_id(peer.id, NodeIdFormat::dashes)));
  set_js_field(js, "name", make_js_text(peer.name));
  return js;
}

JsValue WasmSession::attributes() const {
  return to_js(Value(session_.attributes()), session_.types(), true);
}

JsValue WasmSession::definitions() const {
  const JsValue texts = make_js_array();
  for (const auto& definition : session_.types().definitions()) push_js(texts, make_js_text(definition->text));
  return texts;
}

JsValue WasmSession::known_definitions() const {
  const JsValue known = make_js_array();
  if (!session_.known_definitions()) return known;
  for (const auto& each : *session_.known_definitions()) {
    const JsValue item = make_js_array();
    push_js(item, make_js_text(each.name));
    push_js(item, make_js_text(each.tag));
    for (const auto& text : each.texts) push_js(item, make_js_text(text));
    push_js(known, item);
  }
  return known;
}

JsValue WasmSession::definition(const JsValue& name) const {
  const auto* definition = session_.types().find_service(text_of(name));
  return definition ? make_js_definition(*definition) : JsValue::undefined();
}

JsValue WasmSession::members(const JsValue& path) const {
  const auto* type = session_.object_type(text_of(path));
  return type ? make_js_members(*type) : JsValue::undefined();
}

JsValue WasmSession::child_path(const JsValue& parent, const JsValue& member, const JsValue& index) const {
  if (index.kind() != JsKind::text) return make_js_text(rr::child_path(text_of(parent), text_of(member)));
  return make_js_text(rr::child_path(text_of(parent), text_of(member), text_of(index)));
}

std::optional<WasmSession::Target> WasmSession::find_target(const JsValue& path, const JsValue& member) {
  Target target{text_of(path), text_of(member), nullptr};
  target.definition = find_member(target.path, target.member);
  if (target.definition) return target;
  if (session_.state() != ClientState::connected)
    error_ = make_error(ErrorCode::connection_error, "the session is not connected");
  else
    error_ = make_error(ErrorCode::object_not_found, "object " + quote(target.path) + " with member " +
                                                         quote(target.member) + " is not known (any more)");
  return std::nullopt;
}

const MemberDefinition* WasmSession::find_member(std::string_view path, std::string_view member) const {
  const auto* type = session_.object_type(path);
  return type ? type->find_member(member) : nullptr;
}

std::optional<Value> WasmSession::read_value(const JsValue& js, const TypeDefinition& type, std::string_view name) {
  auto value = from_js(js, type, session_.types(), FieldPath{nullptr, FieldPath::Step::field, 0, name, {}});
  if (value.has_value()) return std::move(*value);
  error_ = value.error();
  return std::nullopt;
}

std::optional<Value> WasmSession::read_range(const JsValue& js, std::string_view name) {
  TypeDefinition type;
  type.type = DataType::uint64_t;
  type.array = ArrayKind::variable;
  return read_value(js, type, name);
}

std::optional<std::vector<Value>> WasmSession::read_arguments(const JsValue& arguments,
                                                              const MemberDefinition& function) {
  std::vector<Value> values;
  values.reserve(function.parameters.size());
  for (const auto& parameter : function.parameters) {
    if (parameter.type.container == ContainerKind::generator) break;  // comes with each step
    const auto given = arguments.at(values.size()).value_or(JsValue::undefined());
    auto value = read_value(given, parameter.type, parameter.name);
    if (!value) return std::nullopt;
    values.push_back(std::move(*value));
  }
  return values;
}

RequestId WasmSession::remember(RequestId id, const TypeDefinition& type) {
  if (is_varvalue(type)) varvalue_replies_.insert(id);
  return id;
}

}  // namespace rr
