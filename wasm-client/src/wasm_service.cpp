#include "wasm-client/src/wasm_service.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "wasm-client/src/js_events.hpp"
#include "wasm-client/src/object_info.hpp"
#include "wasm-client/src/value_from_js.hpp"
#include "wasm-client/src/value_to_js.hpp"

/// {type, object} or {error} of what stands behind an objref; takes all handles over.
extern "C" __attribute__((import_module("js"), import_name("find_child"))) rr::JsHandle rr_js_find_child(
    rr::JsHandle object, rr::JsHandle member, rr::JsHandle index, rr::JsHandle path, rr::JsHandle type);

namespace rr {

namespace {

/// In the order of CallKind.
constexpr std::string_view call_names[] = {"property_get",    "property_set",    "function",          "peek_in",
                                           "peek_out",        "poke_out",        "generator_open",    "generator_next",
                                           "generator_close", "generator_abort", "memory_dimensions", "memory_read",
                                           "memory_write"};

class JsObject final : public ServiceObject {
 public:
  JsObject(std::string path, std::string type, JsValue js)
      : path_(std::move(path)), type_(std::move(type)), js_(std::move(js)) {}

  const JsValue& js() const { return js_; }
  const std::string& type_name() const override { return type_; }
  bool is_monitor_lockable() const override { return true; }

  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition& objref,
                                                    const std::optional<std::string>& index) override {
    auto path = index ? child_path(path_, objref.name, *index) : child_path(path_, objref.name);
    const JsValue found(rr_js_find_child(JsValue(js_).release(), make_js_text(objref.name).release(),
                                         index ? make_js_text(*index).release() : JsHandle::undefined,
                                         make_js_text(path).release(),
                                         make_js_text(objref.type.qualified_name).release()));
    const auto field = [&](std::string_view name) { return found.field(name).value_or(JsValue::undefined()); };
    if (const auto error = field("error"); !error.is_nullish()) return error_from_js(error);
    return std::shared_ptr<ServiceObject>(
        std::make_shared<JsObject>(std::move(path), text_of(field("type")), field("object")));
  }

 private:
  std::string path_;
  std::string type_;
  JsValue js_;
};

const JsValue& js_of(const std::shared_ptr<ServiceObject>& object) {
  return static_cast<const JsObject&>(*object).js();
}

void begin_member_event(JsWriter& js, std::string_view kind, const std::shared_ptr<ServiceObject>& object,
                        const MemberDefinition& member) {
  begin_event(js, kind);
  js.key("object").value(js_of(object));
  js.key("member").name(member.name);
}

void begin_id_event(JsWriter& js, std::string_view kind, std::uint64_t id) {
  begin_event(js, kind);
  js.key("id").number(static_cast<double>(id));
}

void write_time(JsWriter& js, TimeSpec time) {
  js.key("seconds").number(static_cast<double>(time.seconds));
  js.key("nanoseconds").number(time.nanoseconds);
}

void write_numbers(JsWriter& js, const MemoryShape& shape) {
  js.begin_array();
  for (const auto number : shape) js.number(static_cast<double>(number));
  js.end();
}

/// What answers a call; void: anything does.
TypeDefinition answer_type(CallKind kind, const MemberDefinition& member) {
  TypeDefinition type = member.type;
  switch (kind) {
    case CallKind::property_get:
    case CallKind::function:
    case CallKind::peek_in:
    case CallKind::peek_out:
    case CallKind::memory_read:
      return type;
    case CallKind::generator_next:
      type.container = ContainerKind::none;
      return type;
    case CallKind::memory_dimensions:
      type = {};
      type.type = DataType::uint64_t;
      type.array = ArrayKind::variable;
      return type;
    default:
      type = {};
      type.type = DataType::void_t;
      return type;
  }
}

}  // namespace

WasmService::WasmService(NodeIdentity node, std::size_t max_message_size)
    : directory_(std::move(node)), max_message_size_(max_message_size) {}

Result<std::unique_ptr<WasmService>> WasmService::make(const JsValue& options, const JsValue& root) {
  const auto field = [&](std::string_view name) { return options.field(name).value_or(JsValue::undefined()); };
  const auto id = parse_node_id(text_of(field("nodeId")));
  if (!id) return id.error();
  const auto name = text_of(field("nodeName"));
  const auto limit = static_cast<std::size_t>(field("maxMessageSize").number());
  std::unique_ptr<WasmService> out(new WasmService({*id, name}, limit));
  std::vector<std::string> texts;
  const auto definitions = field("definitions");
  for (std::size_t i = 0; i < definitions.length().value_or(0); ++i)
    texts.push_back(text_of(definitions.at(i).value_or(JsValue::undefined())));
  if (auto added = out->types_->add(texts, RobdefMode::strict); !added) return added.error();
  const auto service = text_of(field("service"));
  auto object = std::make_shared<JsObject>(service, text_of(field("type")), root);
  auto hosted = HostedService::make(service, std::move(object), out->types_);
  if (!hosted) return hosted.error();
  out->service_ = std::move(*hosted);
  if (auto added = out->directory_.add(out->service_); !added) return added.error();
  return out;
}

void WasmService::set_now(double steady, double utc) {
  now_ = make_now(steady, utc);
}

std::uint32_t WasmService::open(const JsValue& url) {
  ServiceSessionOptions options;
  options.base_url = text_of(url);
  options.connection.self = directory_.identity();
  options.connection.max_message_size = max_message_size_;
  Client client;
  client.session = std::make_unique<ServiceSession>(directory_, std::move(options), now_);
  clients_.emplace(++last_client_, std::move(client));
  return last_client_;
}

WasmService::Client* WasmService::find(std::uint32_t client) {
  const auto found = clients_.find(client);
  return found == clients_.end() ? nullptr : &found->second;
}

const WasmService::Client* WasmService::find(std::uint32_t client) const {
  const auto found = clients_.find(client);
  return found == clients_.end() ? nullptr : &found->second;
}

// --- told ---

std::uint8_t* WasmService::receive_buffer(std::size_t size) {
  if (received_.size() < size) received_.resize(size);
  return received_.data();
}

void WasmService::handle_bytes(std::uint32_t number, std::size_t size) {
  auto* client = find(number);
  if (client && size <= received_.size()) feed(*client, {received_.data(), size});
}

/// A WebSocket of a page can't be held back, so what the session does not take is kept, up to a bound.
void WasmService::feed(Client& client, ByteSpan bytes) {
  if (!client.waiting.empty()) {
    client.waiting.insert(client.waiting.end(), bytes.begin(), bytes.end());
    const auto taken = client.session->handle_bytes(client.waiting, now_);
    client.waiting.erase(client.waiting.begin(), client.waiting.begin() + static_cast<std::ptrdiff_t>(taken));
  } else {
    const auto taken = client.session->handle_bytes(bytes, now_);
    client.waiting.assign(bytes.begin() + static_cast<std::ptrdiff_t>(taken), bytes.end());
  }
  if (client.waiting.size() <= 2 * max_message_size_) return;
  client.waiting = Bytes();
  client.is_ended = true;
  client.session->handle_closed(
      make_error(ErrorCode::out_of_system_resource, "the client sends more than the page answers"), now_);
}

void WasmService::handle_transmitted(std::uint32_t client, std::size_t size) {
  if (auto* found = find(client)) found->session->handle_transmitted(size, now_);
}

void WasmService::handle_timeout(std::uint32_t client) {
  if (auto* found = find(client)) found->session->handle_timeout(now_);
}

void WasmService::handle_closed(std::uint32_t client, const JsValue& reason) {
  if (auto* found = find(client))
    found->session->handle_closed(make_error(ErrorCode::connection_error, text_of(reason)), now_);
}

// --- asked ---

JsValue WasmService::reply(std::uint32_t number, double id, const JsValue& value) {
  auto* client = find(number);
  if (!client) return JsValue::undefined();
  const auto call = client->calls.extract(static_cast<CallId>(id));
  if (!call) return JsValue::undefined();  // the client has gone
  const auto [kind, member] = call.mapped();
  const auto type = answer_type(kind, *member);
  const auto read = type.type == DataType::void_t ? Result<Value>(Value{}) : read_value(value, type, member->name);
  // Getters of the value may have run: the client may be gone.
  if (auto* still_there = find(number)) still_there->session->reply(static_cast<CallId>(id), read, now_);
  return read ? JsValue::undefined() : to_js(read.error(), *types_);
}

void WasmService::fail(std::uint32_t number, double id, const JsValue& error) {
  auto* client = find(number);
  if (!client || client->calls.erase(static_cast<CallId>(id)) == 0) return;
  client->session->reply(static_cast<CallId>(id), error_from_js(error), now_);
}

JsValue WasmService::send_event(const JsValue& path, const JsValue& type, const JsValue& name,
                                const JsValue& arguments) {
  const auto member = find_member(type, name);
  if (!member) return to_js(member.error(), *types_);
  const auto values = read_arguments(arguments, **member);
  if (!values) return to_js(values.error(), *types_);
  const auto at = text_of(path);
  EventPacket packet(at, **member, *values);
  Result<> fits;
  for (const auto& [number, client] : clients_)
    if (client.session->service() == service_.get())
      if (auto sent = client.session->send_event(packet, now_); !sent && !client.session->wants_close()) fits = sent;
  return error_or_nothing(fits);
}

JsValue WasmService::send_wire(std::uint32_t number, const JsValue& path, const JsValue& type, const JsValue& name,
                               const JsValue& js) {
  const auto member = find_member(type, name);
  if (!member) return to_js(member.error(), *types_);
  const auto value = read_value(js, (*member)->type, (*member)->name);
  if (!value) return to_js(value.error(), *types_);
  const auto at = text_of(path);
  WirePacket packet(at, **member, *value, now_.utc, now_.steady);
  Result<> fits;
  for (const auto& [each, client] : clients_)
    if (number == 0 || number == each)
      if (auto sent = client.session->send_wire(packet, now_); !sent && !client.session->wants_close()) fits = sent;
  return error_or_nothing(fits);
}

void WasmService::accept_pipe(std::uint32_t client, double pipe) {
  if (auto* found = find(client)) found->session->accept_pipe(static_cast<PipeId>(pipe), now_);
}

void WasmService::refuse_pipe(std::uint32_t client, double pipe, const JsValue& error) {
  if (auto* found = find(client)) found->session->refuse_pipe(static_cast<PipeId>(pipe), error_from_js(error), now_);
}

JsValue WasmService::send_pipe(std::uint32_t number, double pipe, const JsValue& js) {
  auto* client = find(number);
  const auto id = static_cast<PipeId>(pipe);
  const auto known = client ? client->pipes.find(id) : decltype(client->pipes.find(id)){};
  if (!client || known == client->pipes.end())
    return to_js(make_error(ErrorCode::invalid_operation, "the pipe endpoint is closed"), *types_);
  const auto value = read_value(js, known->second->type, known->second->name);
  if (!value) return to_js(value.error(), *types_);
  client = find(number);  // getters of the value may have run: the client may be gone
  if (!client) return JsValue::undefined();
  const auto sent = client->session->send_pipe_packet(id, *value, now_);
  return sent ? JsValue::undefined() : to_js(sent.error(), *types_);
}

void WasmService::close_pipe(std::uint32_t number, double pipe) {
  auto* client = find(number);
  if (!client || client->pipes.erase(static_cast<PipeId>(pipe)) == 0) return;
  client->session->close_pipe(static_cast<PipeId>(pipe), now_);
}

JsValue WasmService::call_callback(std::uint32_t number, const JsValue& path, const JsValue& type, const JsValue& name,
                                   const JsValue& arguments) {
  const auto member = find_member(type, name);
  if (!member) return to_js(member.error(), *types_);
  const auto values = read_arguments(arguments, **member);
  if (!values) return to_js(values.error(), *types_);
  auto* client = find(number);
  if (!client) return to_js(make_error(ErrorCode::connection_error, "the client is gone"), *types_);
  const auto called = client->session->call_callback(text_of(path), **member, *values, now_);
  if (!called) return to_js(called.error(), *types_);
  client->callbacks.emplace(*called, *member);
  JsWriter js;
  js.number(static_cast<double>(*called));
  return js.build();
}

void WasmService::release(const JsValue& path) {
  for (const auto& spelling : service_->forget_path(text_of(path)))
    for (const auto& [number, client] : clients_)
      if (client.session->service() == service_.get()) client.session->release_path(spelling, now_);
}

void WasmService::close_service() {
  for (const auto& [number, client] : clients_) client.session->close_service(now_);
}

// --- answers ---

ByteSpan WasmService::poll_transmit(std::uint32_t client, std::size_t limit) {
  auto* found = find(client);
  const auto slices = found ? found->session->poll_transmit() : std::span<const ByteSpan>();
  return slices.empty() ? ByteSpan() : slices.front().first(std::min(limit, slices.front().size()));
}

bool WasmService::wants_close(std::uint32_t client) const {
  const auto* found = find(client);
  return !found || found->is_ended || found->session->wants_close();
}

double WasmService::poll_timeout(std::uint32_t client) const {
  const auto* found = find(client);
  return to_js_time(found ? found->session->poll_timeout() : TimePoint::max());
}

JsValue WasmService::poll_event(std::uint32_t number) {
  auto* client = find(number);
  if (!client) return JsValue::undefined();
  for (;;) {
    while (auto event = client->session->poll_event()) {
      auto js = event_to_js(*client, *event);
      if (!js.is_nullish()) return js;
    }
    if (client->waiting.empty() || client->is_ended) return JsValue::undefined();
    const auto before = client->waiting.size();
    feed(*client, {});
    if (client->waiting.size() == before) return JsValue::undefined();
  }
}

JsValue WasmService::to_js_call(Client& client, const Called& called) const {
  const auto& member = *called.member;
  client.calls[called.id] = {called.kind, &member};
  JsWriter js;
  begin_member_event(js, "call", called.object, member);
  js.key("call").name(call_names[static_cast<std::size_t>(called.kind)]);
  js.key("id").number(static_cast<double>(called.id));
  if (called.kind == CallKind::function || called.kind == CallKind::generator_open) {
    js.key("arguments");
    write_arguments(js, called.arguments, &member, *types_);
  } else if (called.arguments.size() == 1) {
    // One value: of the member's own type, or what a step of a generator takes.
    const auto& type = called.kind == CallKind::generator_next && !member.parameters.empty()
                           ? member.parameters.back().type
                           : member.type;
    js.key("value");
    write_js(js, called.arguments.front(), *types_, is_varvalue(type));
  }
  write_time(js, called.time);
  js.key("generator").number(static_cast<double>(called.generator));
  js.key("position");
  write_numbers(js, called.range.position);
  js.key("count");
  write_numbers(js, called.range.count);
  return js.build();
}

JsValue WasmService::event_to_js(Client& client, ServiceEvent& event) {
  if (const auto* called = std::get_if<Called>(&event)) return to_js_call(client, *called);
  if (const auto* login = std::get_if<LoginRequested>(&event)) {
    client.session->answer_login(login->id, make_error(ErrorCode::authentication_error, "nobody can log in here"),
                                 now_);
    return JsValue::undefined();
  }
  JsWriter js;
  if (std::holds_alternative<LocksChanged>(event)) {
    for (const auto& [number, each] : clients_) each.session->handle_locks_changed(now_);
    begin_event(js, "locks_changed");
  } else if (const auto* wire = std::get_if<WireConnected>(&event)) {
    begin_member_event(js, "wire_connected", wire->object, *wire->member);
  } else if (const auto* received = std::get_if<WireReceived>(&event)) {
    begin_member_event(js, "wire", received->object, *received->member);
    js.key("value");
    write_js(js, received->value, *types_, is_varvalue(received->member->type));
    write_time(js, received->time);
  } else if (const auto* pipe = std::get_if<PipeConnected>(&event)) {
    client.pipes[pipe->id] = pipe->member;
    begin_member_event(js, "pipe_connected", pipe->object, *pipe->member);
    js.key("id").number(static_cast<double>(pipe->id));
    js.key("index").number(pipe->index);
  } else if (const auto* packet = std::get_if<PipeReceived>(&event)) {
    const auto known = client.pipes.find(packet->id);
    const bool brings_type = known != client.pipes.end() && is_varvalue(known->second->type);
    begin_id_event(js, "pipe", packet->id);
    js.key("value");
    write_js(js, packet->value, *types_, brings_type);
  } else if (const auto* closed = std::get_if<PipeClosed>(&event)) {
    client.pipes.erase(closed->id);
    begin_id_event(js, "pipe_closed", closed->id);
  } else if (const auto* ended = std::get_if<GeneratorEnded>(&event)) {
    begin_id_event(js, "generator_ended", ended->id);
  } else if (const auto* completed = std::get_if<CallbackCompleted>(&event)) {
    const auto known = client.callbacks.extract(completed->id);
    const bool brings_type = known && is_varvalue(known.mapped()->type);
    begin_id_event(js, "callback", completed->id);
    js.key(completed->result ? "value" : "error");
    if (completed->result)
      write_js(js, *completed->result, *types_, brings_type);
    else
      write_js(js, completed->result.error(), *types_);
  } else if (std::holds_alternative<ClientGone>(event)) {
    begin_event(js, "gone");
  } else {
    return JsValue::undefined();
  }
  return js.build();
}

// --- looked at ---

std::size_t WasmService::queued_bytes(std::uint32_t client) const {
  const auto* found = find(client);
  return found ? found->session->queued_bytes() : 0;
}

JsValue WasmService::members(const JsValue& type) const {
  const auto* entity = types_->find_entity(text_of(type));
  return entity ? make_js_members(*entity) : JsValue::undefined();
}

Result<const MemberDefinition*> WasmService::find_member(const JsValue& type, const JsValue& name) const {
  const auto* entity = types_->find_entity(text_of(type));
  const auto* member = entity ? entity->find_member(text_of(name)) : nullptr;
  if (member) return member;
  return make_error(ErrorCode::member_not_found, quote(text_of(type)) + " has no member " + quote(text_of(name)));
}

Result<Value> WasmService::read_value(const JsValue& js, const TypeDefinition& type, std::string_view name) const {
  return from_js(js, type, *types_, FieldPath{nullptr, FieldPath::Step::field, 0, name, {}});
}

Result<std::vector<Value>> WasmService::read_arguments(const JsValue& js, const MemberDefinition& member) const {
  std::vector<Value> values;
  for (const auto& parameter : member.parameters) {
    auto value = read_value(js.at(values.size()).value_or(JsValue::undefined()), parameter.type, parameter.name);
    if (!value) return value.error();
    values.push_back(std::move(*value));
  }
  return values;
}

JsValue WasmService::error_or_nothing(const Result<>& result) const {
  return result ? JsValue::undefined() : to_js(result.error(), *types_);
}

}  // namespace rr
