#include "wasm-client/src/wasm_session.hpp"

#include <algorithm>

#include "wasm-client/src/js_events.hpp"
#include "wasm-client/src/object_info.hpp"
#include "wasm-client/src/value_from_js.hpp"
#include "wasm-client/src/value_to_js.hpp"

namespace rr {

namespace {

/// `event` one that comes from a member.
template <class Event>
void begin_member_event(JsWriter& js, std::string_view kind, const Event& event) {
  begin_event(js, kind);
  js.key("path").name(event.path);
  js.key("member").name(event.member);
}

/// `event` one of those of pipe endpoints.
template <class Event>
void begin_pipe_event(JsWriter& js, std::string_view kind, const Event& event) {
  begin_member_event(js, kind, event);
  js.key("index").number(event.index);
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
  if (const auto* step_parameter = target->definition->step_parameter()) {
    value = read_value(parameter, step_parameter->type, step_parameter->name);
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
  JsWriter js;
  std::visit([&](const auto& each) { write_event(js, each); }, event);
  return js.build();
}

void WasmSession::write_event(JsWriter& js, const Connected& connected) {
  begin_event(js, "connected");
  js.key("type").text(connected.object_type);
}

void WasmSession::write_event(JsWriter& js, const Completed& completed) {
  const bool brings_type = varvalue_replies_.erase(completed.id) > 0;
  const bool is_ok = completed.result.has_value();
  begin_event(js, is_ok ? "completed" : "failed");
  js.key("id").number(completed.id);
  js.key(is_ok ? "value" : "error");
  if (is_ok)
    write_js(js, *completed.result, session_.types(), brings_type);
  else
    write_js(js, completed.result.error(), session_.types());
}

void WasmSession::write_event(JsWriter& js, const EventReceived& received) {
  begin_member_event(js, "event", received);
  js.key("arguments");
  write_arguments(js, received.arguments, find_member(received.path, received.member), session_.types());
}

void WasmSession::write_event(JsWriter& js, const CallbackCalled& called) {
  begin_member_event(js, "callback", called);
  js.key("id").number(static_cast<double>(called.id));
  js.key("arguments");
  write_arguments(js, called.arguments, find_member(called.path, called.member), session_.types());
}

void WasmSession::write_event(JsWriter& js, const WireValueReceived& received) {
  begin_member_event(js, "wire", received);
  js.key("seconds").number(static_cast<double>(received.time.seconds));
  js.key("nanoseconds").number(received.time.nanoseconds);
  write_member_value(js, received);
}

void WasmSession::write_event(JsWriter& js, const WireClosedByService& closed) {
  begin_member_event(js, "wire_closed", closed);
}

void WasmSession::write_event(JsWriter& js, const PipePacketReceived& received) {
  begin_pipe_event(js, "pipe", received);
  write_member_value(js, received);
}

void WasmSession::write_event(JsWriter& js, const PipePacketsAcknowledged& acknowledged) {
  begin_pipe_event(js, "pipe_acks", acknowledged);
  js.key("numbers").begin_array();
  for (const auto number : acknowledged.numbers) js.number(number);
}

void WasmSession::write_event(JsWriter& js, const PipeClosedByService& closed) {
  begin_pipe_event(js, "pipe_closed", closed);
}

void WasmSession::write_event(JsWriter& js, const PathReleased& released) {
  begin_event(js, "path_released");
  js.key("path").text(released.path);
}

void WasmSession::write_event(JsWriter& js, const SessionClosed& closed) {
  begin_event(js, "closed");
  js.key("error");
  write_js(js, closed.reason, session_.types());
}

template <class Event>
void WasmSession::write_member_value(JsWriter& js, const Event& event) const {
  const auto* member = find_member(event.path, event.member);
  js.key("value");
  write_js(js, event.value, session_.types(), member && is_varvalue(member->type));
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
  JsWriter js;
  js.begin_object();
  js.key("messagesReceived").number(static_cast<double>(stats.messages_received));
  js.key("messagesSent").number(static_cast<double>(stats.messages_sent));
  js.key("bytesReceived").number(static_cast<double>(stats.bytes_received));
  js.key("bytesSent").number(static_cast<double>(stats.bytes_sent));
  return js.build();
}

JsValue WasmSession::peer() const {
  const auto peer = session_.connection().peer();
  JsWriter js;
  js.begin_object();
  js.key("id").text(format_node_id(peer.id, NodeIdFormat::dashes));
  js.key("name").text(peer.name);
  return js.build();
}

JsValue WasmSession::attributes() const {
  const Value attributes(session_.attributes());
  JsWriter js;
  write_js(js, attributes, session_.types(), true);
  return js.build();
}

JsValue WasmSession::definitions() const {
  JsWriter js;
  js.begin_array();
  for (const auto& definition : session_.types().definitions()) js.text(definition->text);
  return js.build();
}

JsValue WasmSession::known_definitions() const {
  JsWriter js;
  js.begin_array();
  if (!session_.known_definitions()) return js.build();
  for (const auto& each : *session_.known_definitions()) {
    js.begin_array();
    js.text(each.name);
    js.text(each.tag);
    for (const auto& text : each.texts) js.text(text);
    js.end();
  }
  return js.build();
}

JsValue WasmSession::definition(const JsValue& name) const {
  const auto* definition = session_.types().find_service(text_of(name));
  return definition ? make_js_definition(*definition) : JsValue::undefined();
}

JsValue WasmSession::members(const JsValue& path) const {
  const auto* type = session_.object_type(text_of(path));
  return type ? make_js_members(*type) : JsValue::undefined();
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
