// A service that gives back what it is given, for any definition; ../service.ts says what each member does.
#include <cmath>
#include <deque>
#include <map>
#include <optional>

#include "core/session/service/service_session.hpp"
#include "core/support/random.hpp"
#include "core/types/multidim.hpp"
#include "wasm-client/src/js_writer.hpp"

namespace {

using namespace rr;

class TestObject : public ServiceObject {
 public:
  explicit TestObject(std::string type) : type_(std::move(type)) {}
  const std::string& type_name() const override { return type_; }
  bool is_monitor_lockable() const override { return true; }

  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition& objref,
                                                    const std::optional<std::string>& index) override {
    if (index == "missing" || index == "99") return make_error(ErrorCode::object_not_found, "no " + *index);
    const auto type = objref.type.qualified_name.empty() ? type_ : objref.type.qualified_name;
    auto child = std::make_shared<TestObject>(type);
    child->values["name"] = index ? objref.name + " " + *index : objref.name;
    return std::shared_ptr<ServiceObject>(std::move(child));
  }

  std::map<std::string, Value, std::less<>> values;

 private:
  std::string type_;
};

/// Knows alice and bob, whose password is "secret".
class TestAuthenticator : public Authenticator {
  Result<AuthenticatedUser> authenticate(const LoginAttempt& attempt) const override {
    for (const auto& [key, value] : attempt.credentials.items)
      if (key == "password" && value == Value("secret") && (attempt.username == "alice" || attempt.username == "bob"))
        return AuthenticatedUser{.name = attempt.username, .privileges = {"objectlock"}};
    return make_error(ErrorCode::authentication_error, "Invalid username or password");
  }
};

class TestService {
 public:
  /// `options`: {definitions: [text], root: qualified type, version, stringTable}
  TestService(const JsValue& options, double steady) : directory_(NodeIdentity{random_node_id(), "test.service"}) {
    set_now(steady);
    if (const auto started = start(options); started.has_error())
      error_ = started.error().qualified_name() + ": " + started.error().message;
  }

  const std::string& error() const { return error_; }

  void set_now(double steady) {
    now_.steady =
        TimePoint(std::chrono::duration_cast<TimePoint::duration>(std::chrono::duration<double, std::milli>(steady)));
    now_.utc.seconds = static_cast<std::int64_t>(steady / 1000);
    now_.utc.nanoseconds = static_cast<std::int32_t>(std::fmod(steady, 1000) * 1e6);
  }

  std::uint8_t* receive_buffer(std::size_t size) {
    received_.resize(size);
    return received_.data();
  }
  void handle_bytes() {
    session_->handle_bytes(received_, now_);
    carry_out();
  }
  void release(const JsValue& path) { session_->release_path(path.text().value(), now_); }
  /// One more client. Returns its number; what follows concerns it, until another is selected.
  std::size_t join() {
    session_ = &sessions_.emplace_back(directory_, session_options_, now_);
    return sessions_.size() - 1;
  }
  void select(std::size_t number) { session_ = &sessions_[number]; }
  void stop() { session_->close_service(now_); }
  bool wants_close() const { return session_->wants_close(); }

  ByteSpan poll_transmit() {
    const auto slices = session_->poll_transmit();
    return slices.empty() ? ByteSpan{} : slices.front();
  }
  void handle_transmitted(std::size_t size) {
    session_->handle_transmitted(size, now_);
    carry_out();
  }
  double poll_timeout() const {
    return std::chrono::duration<double, std::milli>(session_->poll_timeout().time_since_epoch()).count();
  }
  void handle_timeout() {
    session_->handle_timeout(now_);
    carry_out();
  }

 private:
  Result<> start(const JsValue& options) {
    std::vector<std::string> texts;
    const auto list = options.field("definitions");
    for (std::size_t i = 0; i < list->length().value_or(0); ++i) texts.push_back(*list->at(i)->text());
    auto types = std::make_shared<TypeRegistry>();
    if (auto added = types->add(texts, RobdefMode::compat); added.has_error()) return added;
    root_ = std::make_shared<TestObject>(*options.field("root")->text());
    MapString attributes;
    attributes.items.emplace_back("site", Value("dock"));
    auto service = HostedService::make("test", root_, types, std::move(attributes));
    if (service.has_error()) return service.error();
    const bool requires_user = options.field("requireUser")->is_true();
    (*service)->set_policy({std::make_shared<TestAuthenticator>(), requires_user, true});
    if (auto added = directory_.add(*service); added.has_error()) return added;
    types_ = std::move(types);
    auto& features = session_options_.connection.features;
    if (options.field("version")->number() == 2) features.v4 = false;
    if (!options.field("stringTable")->is_true()) features.string_table = {.local = false, .standard = false};
    join();
    return {};
  }

  void carry_out() {
    while (auto event = session_->poll_event()) {
      if (const auto* called = std::get_if<Called>(&*event)) answer(*called);
      if (auto* completed = std::get_if<CallbackCompleted>(&*event))
        if (auto asked = asks_.extract(completed->id)) session_->reply(asked.mapped(), completed->result, now_);
      if (const auto* login = std::get_if<LoginRequested>(&*event))
        session_->answer_login(login->id, login->authenticator->authenticate(login->attempt), now_);
      if (const auto* wire = std::get_if<WireConnected>(&*event)) {
        auto& values = static_cast<TestObject&>(*wire->object).values;
        if (const auto found = values.find(wire->member->name); found != values.end())
          (void)session_->send_wire(wire->path, *wire->member, found->second, now_);
      }
      if (std::holds_alternative<LocksChanged>(*event))
        for (auto& session : sessions_) session.handle_locks_changed(now_);
      if (const auto* pipe = std::get_if<PipeConnected>(&*event)) connect_pipe(*pipe);
      if (const auto* packet = std::get_if<PipeReceived>(&*event))
        (void)session_->send_pipe_packet(packet->id, packet->value, now_);
      if (const auto* closed = std::get_if<PipeClosed>(&*event))
        for (auto& [name, ids] : pipes_) std::erase(ids, closed->id);
      if (const auto* wire = std::get_if<WireReceived>(&*event))
        static_cast<TestObject&>(*wire->object).values[wire->member->name] = wire->value;
    }
  }

  void connect_pipe(const PipeConnected& pipe) {
    const auto& name = pipe.member->name;
    if (name == "refused") return session_->refuse_pipe(pipe.id, make_error(ErrorCode::operation_failed, "no"), now_);
    if (name == "mute") return;
    if (name == "greeting")
      for (const auto* word : {"hello", "world"}) (void)session_->send_pipe_packet(pipe.id, Value(word), now_);
    session_->accept_pipe(pipe.id, now_);
    pipes_[name].push_back(pipe.id);
  }

  void answer(const Called& called) {
    const auto result = result_of(called);
    if (result) session_->reply(called.id, *result, now_);
  }

  std::optional<Result<Value>> result_of(const Called& called) {
    auto& values = static_cast<TestObject&>(*called.object).values;
    const auto& name = called.member->name;
    switch (called.kind) {
      case CallKind::property_set:
      case CallKind::poke_out:
        values[name] = called.arguments.front();
        return Value{};
      case CallKind::property_get:
      case CallKind::peek_in:
      case CallKind::peek_out: {
        const auto found = values.find(name);
        return found != values.end() ? found->second : default_value(called.member->type, *types_);
      }
      case CallKind::function:
        if (name.starts_with("ask_")) return ask(called);
        return call(name, called.arguments, called.member->type);
      case CallKind::memory_dimensions:
        return Value(memory(called).dims);
      case CallKind::memory_read:
      case CallKind::memory_write:
        return access_memory(called);
      case CallKind::generator_open:
        if (name == "refuse") return make_error(ErrorCode::operation_failed, "no");
        runs_[called.generator] = {called.arguments, 0};
        return Value{};
      case CallKind::generator_next:
        return step(called);
      case CallKind::generator_close:
      case CallKind::generator_abort:
        values["generator_end"] = Value(called.kind == CallKind::generator_close ? "closed" : "aborted");
        runs_.erase(called.generator);
        return Value{};
    }
    return Value{};
  }

  struct Memory {
    std::vector<std::uint64_t> dims;
    std::vector<double> items;  ///< column-major
  };

  /// 4 * 3 numbers where the memory has dimensions, else 10; at first 0, 1, 2 ...
  Memory& memory(const Called& called) {
    auto& memory = memories_[called.member->name];
    if (!memory.items.empty()) return memory;
    if (is_multidim(called.member->type))
      memory.dims = {4, 3};
    else
      memory.dims = {10};
    const auto size = *product_of(std::span<const std::uint64_t>(memory.dims));
    for (std::uint64_t i = 0; i < size; ++i) memory.items.push_back(static_cast<double>(i));
    return memory;
  }

  Result<Value> access_memory(const Called& called) {
    auto& [dims, items] = memory(called);
    if (auto within = check_memory_range(called.range, dims, *called.member); !within) return within.error();
    const std::vector<std::size_t> position(called.range.position.begin(), called.range.position.end());
    const std::vector<std::size_t> count(called.range.count.begin(), called.range.count.end());
    const bool is_write = called.kind == CallKind::memory_write;
    std::vector<double> part(static_cast<std::size_t>(*product_of(std::span<const std::uint64_t>(called.range.count))));
    if (is_write) {
      const auto& given = called.arguments.front();
      const auto* grid = given.get_if<MultiDimArray>();
      const auto numbers = (grid ? grid->array : *given.get_if<Array>()).items<double>();
      part.assign(numbers.begin(), numbers.end());
    }
    for (std::size_t i = 0; i < part.size(); ++i) {
      const std::size_t row = i % count[0] + position[0];
      const std::size_t column = count.size() > 1 ? i / count[0] + position[1] : 0;
      auto& item = items[row + column * static_cast<std::size_t>(dims[0])];
      is_write ? item = part[i] : part[i] = item;
    }
    if (is_write) return Value{};
    if (count.size() == 1) return Value(std::move(part));
    MultiDimArray grid;
    grid.dims.assign(count.begin(), count.end());
    grid.array = Array::take(std::move(part));
    return Value(std::move(grid));
  }

  /// The answer of the client's callback is the function's own.
  std::optional<Result<Value>> ask(const Called& called) {
    const auto* callback = types_->find_entity(called.object->type_name())->find_member(called.member->name.substr(4));
    const auto asked = session_->call_callback("test", *callback, called.arguments, now_);
    if (!asked) return asked.error();
    asks_[*asked] = called.id;
    return std::nullopt;
  }

  /// The next value of a generator: what it is given, else 0, 1 ... as often as its first argument says.
  std::optional<Result<Value>> step(const Called& called) {
    if (called.member->name == "hang_on") return std::nullopt;
    if (!called.arguments.empty()) {
      static_cast<TestObject&>(*called.object).values["generator_value"] = called.arguments.front();
      return called.arguments.front();
    }
    auto& run = runs_[called.generator];
    const double count = run.arguments.empty() ? 0 : run.arguments.front().to<double>().value();
    if (run.step < std::abs(count)) return Value(static_cast<double>(run.step++));
    if (count < 0) return make_error(ErrorCode::out_of_range, "no more");
    return make_error(ErrorCode::stop_iteration, "");
  }

  std::optional<Result<Value>> call(std::string_view name, const std::vector<Value>& arguments,
                                    const TypeDefinition& type) {
    if (name == "hang") return std::nullopt;
    if (name == "who") return Value(session_->user() ? session_->user()->name : "nobody");
    if (name == "stop") return session_->close_service(now_), std::nullopt;
    if (name == "fail") {
      Error error{ErrorCode::remote_error, std::string(*arguments[1].to_text()), std::string(*arguments[0].to_text())};
      error.sub_name = "detail";
      error.param = std::make_shared<const Value>(std::vector<std::int32_t>{1, 2});
      return error;
    }
    const auto* root = types_->find_entity(root_->type_name());
    if (name.starts_with("fire_"))
      if (const auto* event = root->find_member(name.substr(5)))
        (void)session_->send_event("test", *event, arguments, now_);
    if (name.starts_with("publish_"))
      if (const auto* wire = root->find_member(name.substr(8)))
        (void)session_->send_wire("test", *wire, arguments.front(), now_);
    if (name.starts_with("stream_")) {
      const auto count = arguments[1].to<std::int32_t>();
      for (const auto id : pipes_[std::string(name.substr(7))])
        for (std::int32_t i = 0; i < *count; ++i) (void)session_->send_pipe_packet(id, arguments[0], now_);
    }
    if (name.starts_with("close_"))
      for (const auto id : std::exchange(pipes_[std::string(name.substr(6))], {})) session_->close_pipe(id, now_);
    if (name == "release") session_->release_path(*arguments.front().to_text(), now_);
    if (type.type == DataType::void_t || arguments.empty()) return Value{};
    return arguments.front();
  }

  ServiceDirectory directory_;
  std::shared_ptr<TestObject> root_;
  std::shared_ptr<const TypeRegistry> types_;
  ServiceSessionOptions session_options_;
  std::deque<ServiceSession> sessions_;
  ServiceSession* session_ = nullptr;  ///< the one selected
  std::map<std::string, Memory, std::less<>> memories_;
  std::map<CallbackId, CallId> asks_;
  struct Run {
    std::vector<Value> arguments;
    int step = 0;
  };
  std::map<GeneratorId, Run> runs_;
  std::map<std::string, std::vector<PipeId>, std::less<>> pipes_;  ///< open ones, by name
  std::string error_;
  Now now_;
  Bytes received_;
};

TestService* service = nullptr;
ByteSpan transmitting;

}  // namespace

#define RR_EXPORT(name) extern "C" __attribute__((export_name(#name)))

RR_EXPORT(allocate) void* rr_allocate(std::size_t size) {
  return ::operator new(size);
}
/// "" or what is wrong with the options.
RR_EXPORT(open) JsHandle rr_open(JsHandle options, double steady) {
  service = new TestService(JsValue(options), steady);
  return make_js_text(service->error()).release();
}
RR_EXPORT(set_now) void rr_set_now(double steady) {
  service->set_now(steady);
}
RR_EXPORT(join) std::size_t rr_join() {
  return service->join();
}
RR_EXPORT(select) void rr_select(std::size_t number) {
  service->select(number);
}
RR_EXPORT(poll_timeout) double rr_poll_timeout() {
  return service->poll_timeout();
}
RR_EXPORT(handle_timeout) void rr_handle_timeout() {
  service->handle_timeout();
}
RR_EXPORT(receive_buffer) std::uint8_t* rr_receive_buffer(std::size_t size) {
  return service->receive_buffer(size);
}
RR_EXPORT(handle_bytes) void rr_handle_bytes() {
  service->handle_bytes();
}
RR_EXPORT(release) void rr_release(JsHandle path) {
  service->release(JsValue(path));
}
RR_EXPORT(stop) void rr_stop() {
  service->stop();
}
RR_EXPORT(wants_close) bool rr_wants_close() {
  return service->wants_close();
}
RR_EXPORT(poll_transmit) std::size_t rr_poll_transmit() {
  transmitting = service->poll_transmit();
  return transmitting.size();
}
RR_EXPORT(transmit_address) const std::uint8_t* rr_transmit_address() {
  return transmitting.data();
}
RR_EXPORT(handle_transmitted) void rr_handle_transmitted(std::size_t size) {
  service->handle_transmitted(size);
}
