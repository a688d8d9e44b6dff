// How to write a device: a service definition plus handlers. Layer: node (the public C++ service API).
//
//   rr::Node node{"my.robot"};
//   auto create = rr::Service::from_file("robdef/experimental.create.robdef", "Create", "Create");
//   create->function("Drive", [&](std::int16_t velocity, std::int16_t radius) { robot.drive(velocity, radius); });
//   create->property("DistanceTraveled").get([&] { return robot.distance_mm(); });
//   node.add(create);
//   node.listen("rr+tcp://0.0.0.0:52222");
//   node.run();
//
// Handlers take and return C++ numbers, bool, std::string, std::vector of numbers, or rr::Value for anything else
// (Value accepts all of them). They run on the node's thread and may throw rr::ServiceException to send an error to the
// client. Node::add() checks every handler against the definition: a missing member, a wrong parameter type or count is
// a std::invalid_argument that names it, before anything listens.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/hosted_service.hpp"
#include "server/node/handler.hpp"

namespace rr {

class Service;
class Node;

/// Thrown by a handler: the client gets this error.
class ServiceException : public std::runtime_error {
 public:
  explicit ServiceException(std::string message, ErrorCode code = ErrorCode::operation_failed)
      : std::runtime_error(message), error_{code, std::move(message)} {}
  /// A custom exception of a service definition: its qualified name, "com.x.MyException".
  ServiceException(std::string qualified_name, std::string message, std::string sub_name = {}, Value param = {});
  const Error& error() const { return error_; }

 private:
  Error error_;
};

/// One object of a service. The root comes with the service; others are made by Service::make_object and handed out by
/// objref handlers. Keep it alive with the shared_ptr.
class Object : public ServiceObject, public std::enable_shared_from_this<Object> {
 public:
  class Property {
   public:
    template <class F>
    Property& get(F&& handler) {
      object_->set_handler(name_, HandlerSlot::get, make_handler(std::forward<F>(handler)));
      return *this;
    }
    template <class F>
    Property& set(F&& handler) {
      object_->set_handler(name_, HandlerSlot::set, make_handler(std::forward<F>(handler)));
      return *this;
    }

   private:
    friend class Object;
    Property(Object* object, std::string name) : object_(object), name_(std::move(name)) {}
    Object* object_;
    std::string name_;
  };

  /// The function's parameters in definition order; may return a value.
  template <class F>
  void function(std::string_view name, F&& handler) {
    set_handler(name, HandlerSlot::call, make_handler(std::forward<F>(handler)));
  }
  Property property(std::string_view name) { return {this, std::string(name)}; }
  /// Fires an event to every client of the service.
  template <class... Args>
  void fire(std::string_view event, Args&&... arguments) {
    const std::vector<Value> values{to_value(std::forward<Args>(arguments))...};
    fire_values(event, values);
  }
  void fire_values(std::string_view event, std::span<const Value> arguments);
  /// Sets a wire's InValue: sent to every client that has connected it, to later ones when they connect, and to peeks.
  void set_wire(std::string_view wire, Value value);
  /// A client's newest OutValue: handler(Value) or of the wire's C++ type.
  template <class F>
  void on_wire(std::string_view wire, F&& handler) {
    set_handler(wire, HandlerSlot::wire_received, make_handler(std::forward<F>(handler)));
  }
  /// objref without index.
  void objref(std::string_view name, std::shared_ptr<Object> child);
  /// Indexed objref: handler(index text) returns the object, or nullptr where there is none.
  void objref(std::string_view name, std::function<std::shared_ptr<Object>(std::string_view index)> find);

  const std::string& type_name() const override { return type_name_; }
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition& objref,
                                                    const std::optional<std::string>& index) override;
  Object(Service* service, std::string type_name) : service_(service), type_name_(std::move(type_name)) {}

 private:
  friend class Service;
  friend class Node;
  using Key = std::pair<std::string, HandlerSlot>;

  void set_handler(std::string_view name, HandlerSlot slot, Handler handler);
  const Handler* find_handler(std::string_view name, HandlerSlot slot) const;

  Service* service_;
  std::string type_name_;
  std::map<Key, Handler> handlers_;
  std::map<std::string, std::function<std::shared_ptr<Object>(std::string_view)>, std::less<>> children_;
  std::map<std::string, Value, std::less<>> wire_in_values_;
  std::map<std::string, Value, std::less<>> wire_out_values_;
};

/// A service: definition, name, root object.
class Service : public std::enable_shared_from_this<Service> {
 public:
  /// `root_type` is the object's name in the definition, or its qualified name.
  /// Throws   std::invalid_argument with the first finding where the definition is not valid.
  static std::shared_ptr<Service> from_text(const std::vector<std::string>& definitions, std::string name,
                                            std::string root_type);
  /// As from_text; the files may import one another. The last file holds the root type.
  static std::shared_ptr<Service> from_files(const std::vector<std::string>& paths, std::string name,
                                             std::string root_type);
  static std::shared_ptr<Service> from_file(const std::string& path, std::string name, std::string root_type) {
    return from_files({path}, std::move(name), std::move(root_type));
  }

  Object& root() { return *root_; }
  /// Another object of this service, for an objref handler. `type` as root_type.
  std::shared_ptr<Object> make_object(const std::string& type);
  const std::string& name() const { return name_; }
  const TypeRegistry& types() const { return *types_; }
  void set_attribute(std::string key, Value value);

  // The root's members, for short.
  template <class F>
  void function(std::string_view member, F&& handler) {
    root_->function(member, std::forward<F>(handler));
  }
  Object::Property property(std::string_view member) { return root_->property(member); }
  template <class... Args>
  void fire(std::string_view event, Args&&... arguments) {
    root_->fire(event, std::forward<Args>(arguments)...);
  }
  void set_wire(std::string_view wire, Value value) { root_->set_wire(wire, std::move(value)); }

 private:
  friend class Node;
  friend class Object;
  Service() = default;

  std::string name_;
  std::shared_ptr<TypeRegistry> types_;
  std::shared_ptr<Object> root_;
  std::vector<std::weak_ptr<Object>> objects_;
  MapString attributes_;
  std::shared_ptr<HostedService> hosted_;
  Node* node_ = nullptr;  ///< once added
};

}  // namespace rr
