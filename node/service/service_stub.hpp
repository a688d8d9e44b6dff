// Objects of a service as generated classes implement them. Layer: node/service.
//
//   class Robot : public experimental::create2::CreateService {
//     void Drive(std::int16_t velocity, std::int16_t radius) override { ... Bump(); ... }
//     std::int32_t get_DistanceTraveled() override { return distance_mm_; }
//   };
//   node.add(rr::make_service("Create", std::make_shared<Robot>()));
//
// Virtual functions answer clients: functions by their name, properties by get_NAME() and set_NAME(value), objrefs by
// get_NAME() or get_NAME(index), values that clients send on a wire by set_NAME(value), packets by
// set_NAME(endpoint, packet). The functions that are not virtual tell clients something: events, wires and pipes by
// their name.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "node/service/memory_buffer.hpp"
#include "node/service/service.hpp"
#include "node/values/typed_value.hpp"

namespace rr {

/// Base of generated services, one instance an object; held by shared_ptr. The node's handlers keep it alive while
/// clients may use it. Members of the definition never begin with rr.
class ServiceStub : public std::enable_shared_from_this<ServiceStub> {
 public:
  virtual ~ServiceStub() = default;
  ServiceStub(const ServiceStub&) = delete;
  ServiceStub& operator=(const ServiceStub&) = delete;

  /// Qualified.
  virtual std::string_view rr_object_type() const = 0;
  /// The texts of the type's definition and of all that it imports, imports first.
  virtual std::vector<std::string> rr_object_definitions() const = 0;
  /// How to read them.
  virtual RobdefMode rr_definition_mode() const { return RobdefMode::strict; }

  /// The service that this object was handed out by. Throws std::logic_error before that.
  Service& rr_service() const;

 protected:
  ServiceStub() = default;

  /// Sets the handlers of all members by the functions below.
  virtual void rr_bind(Object& object) = 0;

  template <class Stub, class R, class... Args>
  void rr_function(Object& object, const char* name, R (Stub::*function)(Args...)) {
    object.function(name, rr_handler(function));
  }
  template <class Stub, class T>
  void rr_getter(Object& object, const char* name, T (Stub::*get)()) {
    object.property(name).get(rr_handler(get));
  }
  template <class Stub, class T>
  void rr_setter(Object& object, const char* name, void (Stub::*set)(T)) {
    object.property(name).set(rr_handler(set));
  }
  template <class Stub, class T>
  void rr_wire_setter(Object& object, const char* name, void (Stub::*set)(T)) {
    object.on_wire(name, rr_handler(set));
  }
  template <class Stub, class Child>
  void rr_objref(Object& object, const char* name, std::shared_ptr<Child> (Stub::*get)()) {
    object.objref(name, [this, self = shared_from_this(), get] { return rr_child((rr_cast<Stub>().*get)()); });
  }
  template <class Stub, class Child, class Index>
  void rr_objref(Object& object, const char* name, std::shared_ptr<Child> (Stub::*get)(Index)) {
    object.objref(name, [this, self = shared_from_this(), get](std::string_view index) {
      return rr_child((rr_cast<Stub>().*get)(rr_index<Index>(index)));
    });
  }

  /// `open`  makes the function that is asked for each value: std::function<std::optional<T>(Parameter)>, or
  /// std::function<bool(Parameter)> where there are no values.
  template <class Stub, class Step, class... Args>
  void rr_generator(Object& object, const char* name, Step (Stub::*open)(Args...)) {
    GeneratorHandler handler;
    handler.parameters.assign(sizeof...(Args), HandlerType{DataType::varvalue_t, false});
    handler.checks_itself = true;
    handler.open = [stub = &rr_cast<Stub>(), self = shared_from_this(), open](std::span<const Value> values) {
      return rr_open<Stub>(*stub, open, values, std::index_sequence_for<Args...>{});
    };
    object.generator(name, std::move(handler));
  }
  template <class Stub, class T>
  void rr_pipe_setter(Object& object, const char* name, void (Stub::*set)(const PipeEndpoint&, T)) {
    object.pipe(name).on_packet(
        [stub = &rr_cast<Stub>(), self = shared_from_this(), set](const PipeEndpoint& from, const Value& packet) {
          (stub->*set)(from, unpack_value<T>(packet));
        });
  }

  template <class Stub, class T>
  void rr_memory(Object& object, const char* name, std::shared_ptr<MemoryBuffer<T>> (Stub::*get)()) {
    object.memory(name, detail::make_buffer_handlers((rr_cast<Stub>().*get)(), detail::ArrayForm::array));
  }
  template <class Stub, class T>
  void rr_multidim_memory(Object& object, const char* name, std::shared_ptr<MemoryBuffer<T>> (Stub::*get)()) {
    object.memory(name, detail::make_buffer_handlers((rr_cast<Stub>().*get)(), detail::ArrayForm::multidim));
  }

  template <class R, class... Args>
  void rr_ask(ClientId client, const char* callback, std::function<void(Result<R>)> done, Args... arguments) {
    const auto object = object_.lock();
    if (!object) throw std::logic_error(std::string(rr_object_type()) + " has no clients: none has asked for it");
    object->call_callback(client, callback, {pack_value(std::move(arguments))...},
                          [done = std::move(done)](Result<Value> answer) {
                            if (done) done(answer ? try_unpack_value<R>(*answer) : Result<R>(answer.error()));
                          });
  }
  template <class... Args>
  void rr_fire(std::string_view event, Args... arguments) {
    const std::array<Value, sizeof...(Args)> values{pack_value(std::move(arguments))...};
    if (const auto object = object_.lock()) object->fire_values(event, values);
  }
  /// Kept for the time when a client looks the object up.
  void rr_set_wire(const char* wire, Value value);
  std::size_t rr_broadcast(std::string_view pipe, const Value& packet);
  /// The object without types: null while no client uses it.
  std::shared_ptr<Object> rr_object() const { return object_.lock(); }

 private:
  template <class Stub>
  Stub& rr_cast() {
    return dynamic_cast<Stub&>(*this);  // its base is virtual
  }
  template <class Index>
  static auto rr_index(std::string_view text) {
    if constexpr (std::is_same_v<std::remove_cvref_t<Index>, std::string>)
      return std::string(text);
    else
      return rr_number(text);
  }
  static std::int32_t rr_number(std::string_view text);
  /// The object of a stub, made where it has none (any more).
  std::shared_ptr<Object> rr_child(const std::shared_ptr<ServiceStub>& child) const;
  void rr_attach(Service& service, const std::shared_ptr<Object>& object);

  template <class Stub, class R, class... Args>
  Handler rr_handler(R (Stub::*function)(Args...)) {
    constexpr HandlerType any{DataType::varvalue_t, false};
    Handler handler{std::vector<HandlerType>(sizeof...(Args), any), std::is_void_v<R> ? HandlerType{} : any, {}};
    handler.call = [stub = &rr_cast<Stub>(), self = shared_from_this(), function](std::span<const Value> values) {
      return rr_answer<Stub, R, Args...>(*stub, function, values, std::index_sequence_for<Args...>{});
    };
    return handler;
  }
  template <class Stub, class R, class... Args, std::size_t... index>
  static Result<Value> rr_answer(Stub& stub, R (Stub::*function)(Args...), std::span<const Value> values,
                                 std::index_sequence<index...>) {
    if (values.size() != sizeof...(Args)) return make_error(ErrorCode::invalid_argument, "wrong number of arguments");
    if constexpr (std::is_void_v<R>) {
      (stub.*function)(unpack_value<std::remove_cvref_t<Args>>(values[index])...);
      return Value{};
    } else {
      return pack_value((stub.*function)(unpack_value<std::remove_cvref_t<Args>>(values[index])...));
    }
  }

  template <class Stub, class Step, class... Args, std::size_t... index>
  static Result<Generator> rr_open(Stub& stub, Step (Stub::*open)(Args...), std::span<const Value> values,
                                   std::index_sequence<index...>) {
    if (values.size() != sizeof...(Args)) return make_error(ErrorCode::invalid_argument, "wrong number of arguments");
    return rr_steps((stub.*open)(unpack_value<std::remove_cvref_t<Args>>(values[index])...));
  }
  template <class R, class... Parameter>
  static Generator rr_steps(std::function<R(Parameter...)> step) {
    return {[step = std::move(step)](const Value& given) -> Result<std::optional<Value>> {
      auto value = step(unpack_value<Parameter>(given)...);
      if (!value) return std::optional<Value>();
      if constexpr (std::is_same_v<R, bool>)
        return std::optional<Value>(Value{});
      else
        return std::optional<Value>(pack_value(std::move(*value)));
    }};
  }

  friend std::shared_ptr<Service> make_service(std::string name, const std::shared_ptr<ServiceStub>& root);

  Service* service_ = nullptr;
  std::weak_ptr<Object> object_ = {};
  std::map<std::string, Value, std::less<>> in_values_ = {};
};

/// A service whose root object is `root`. Its events and wires may be used from then on, those of other objects at any
/// time; the service must outlive them all.
/// Throws   std::invalid_argument: not a service name.
std::shared_ptr<Service> make_service(std::string name, const std::shared_ptr<ServiceStub>& root);

}  // namespace rr
