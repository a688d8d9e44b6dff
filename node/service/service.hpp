// How to write a device: a service definition plus handlers. Layer: node/service (the public C++ service API).
//
//   rr::Node node{"my.robot"};
//   auto create = rr::Service::from_file("robdef/modern/experimental.create2.robdef", "Create", "Create");
//   create->function("Drive", [&](std::int16_t velocity, std::int16_t radius) { robot.drive(velocity, radius); });
//   create->property("DistanceTraveled").get([&] { return robot.distance_mm(); });
//   node.add(create);
//   node.listen("rr+tcp://0.0.0.0:52222");
//   node.run();
//
// Handlers take and return C++ numbers, bool, enums, std::string, std::vector of numbers, or rr::Value for anything
// else (Value accepts all of them). They run on the node's thread, which serves all clients: one that takes its time is
// a coroutine, marked rr::blocking, or answers later (late_handler.hpp). A handler may throw rr::ServiceException to
// send an error to the client; exceptions that are no rr::Exception reach it as code 100, "rrgate.UnhandledException",
// with their text, and are reported (NodeOptions::report).
//
// Handlers are checked against the definition before anything listens: one that does not fit (no such member, wrong
// kind, wrong parameter type or count) is a std::invalid_argument where it is set, one that is missing where the
// service is added to the node. Each names the member.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/session/service/hosted_service.hpp"
#include "core/session/service/service_session.hpp"
#include "node/service/caller.hpp"
#include "node/service/generator.hpp"
#include "node/service/late_handler.hpp"
#include "node/service/memory.hpp"
#include "node/service/pipe_endpoint.hpp"
#include "node/values/exception.hpp"
#include "node/values/handler.hpp"
#include "node/values/shared_function.hpp"

namespace rr {

class Service;

using CallbackDone = std::function<void(Result<Value> answer)>;

/// Thrown by a handler: the client gets this error.
class ServiceException : public Exception {
 public:
  explicit ServiceException(std::string message, ErrorCode code = ErrorCode::operation_failed)
      : Exception({code, std::move(message)}) {}
  /// A custom exception of a service definition: its qualified name, "com.x.MyException".
  ServiceException(const std::string& qualified_name, std::string message, std::string sub_name = {}, Value param = {})
      : Exception(declared_error(qualified_name, std::move(message), std::move(sub_name), std::move(param))) {}
};

/// One object of a service. The root comes with the service; others are made by Service::make_object and handed out by
/// objrefs. The service must outlive it.
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

  /// What the service does with the endpoints that clients open on a pipe. Without handlers clients are let in, and
  /// their packets dropped.
  class Pipe {
   public:
    /// handler(PipeEndpoint); may send. What it throws refuses the client.
    Pipe& on_connect(std::function<void(PipeEndpoint)> handler) {
      object_->set_pipe_handler(name_, &Member::pipe_connected, std::move(handler));
      return *this;
    }
    /// handler(PipeEndpoint, Value), or the pipe's C++ type as second parameter.
    template <class F>
    Pipe& on_packet(F&& handler) {
      using Packet = detail::PacketOf<std::remove_cvref_t<F>>;
      object_->set_packet_handler(name_, detail::handler_type<Packet>(),
                                  detail::make_packet_handler<Packet>(std::forward<F>(handler)));
      return *this;
    }
    /// handler(PipeEndpoint): the client closed it, or is gone. Not for endpoints that the service closed.
    Pipe& on_close(std::function<void(PipeEndpoint)> handler) {
      object_->set_pipe_handler(name_, &Member::pipe_closed, std::move(handler));
      return *this;
    }
    /// Sends to every endpoint of the pipe. An endpoint misses the packet where more than `max_backlog` packets of
    /// earlier broadcasts with a backlog are not acknowledged yet (no_backlog_limit: acknowledgements are not asked
    /// for), or its stream is full. PipeEndpoint::missed() counts.
    /// Returns  how many endpoints it was sent to. Throws std::invalid_argument: no such pipe, one that is writeonly, a
    ///          value that does not fit its type.
    std::size_t broadcast(const Value& value, std::int32_t max_backlog = no_backlog_limit) {
      return object_->broadcast(name_, value, max_backlog);
    }
    /// Those that are open now.
    std::vector<PipeEndpoint> endpoints() const { return object_->endpoints(name_); }

   private:
    friend class Object;
    Pipe(Object* object, std::string name) : object_(object), name_(std::move(name)) {}
    Object* object_;
    std::string name_;
  };

  /// The function's parameters in definition order; may return a value.
  template <class F>
  void function(std::string_view name, F&& handler) {
    set_handler(name, HandlerSlot::call, make_handler(std::forward<F>(handler)));
  }
  /// A generator function: generator.hpp says what the handler is.
  template <class F>
  void generator(std::string_view name, F&& handler) {
    set_generator(name, make_generator_handler(std::forward<F>(handler)));
  }
  /// memory.hpp says what handlers and containers do.
  void memory(std::string_view name, MemoryHandlers handlers);
  template <Number T>
  void memory(std::string_view name, std::shared_ptr<NumberMemory<T>> memory) {
    this->memory(name, detail::make_memory_handlers(std::move(memory), memory_form(name, data_type_of<T>())));
  }
  void memory(std::string_view name, std::shared_ptr<PodMemory> memory);
  Property property(std::string_view name) { return {this, std::string(name)}; }
  Pipe pipe(std::string_view name) { return {this, std::string(name)}; }

  /// Fires an event to every client of the service.
  /// Throws   std::invalid_argument: no such event, wrong number of arguments or types, too large for a message.
  template <class... Args>
  void fire(std::string_view event, Args&&... arguments) {
    const std::array<Value, sizeof...(Args)> values{to_value(std::forward<Args>(arguments))...};
    fire_values(event, values);
  }
  void fire_values(std::string_view event, std::span<const Value> arguments);

  /// Calls a callback of one client. `done` is called once, on the node's thread and not before this returns: with the
  /// client's answer (null for void callbacks) or error, or when it took too long or the client is gone; not any more
  /// when the node is destroyed. What it throws is reported (NodeOptions::report); it may be null. An object that is
  /// known by several paths is called by one that the client uses.
  /// Throws   std::invalid_argument: no such callback, wrong number of arguments or types.
  void call_callback(ClientId client, std::string_view callback, const std::vector<Value>& arguments,
                     CallbackDone done);

  /// Sets a wire's InValue: sent to every client that has connected it, to later ones when they connect, and to peeks.
  /// Throws   std::invalid_argument: no such wire, one that is writeonly, a value that does not fit its type or is too
  ///          large for a message (NodeOptions::max_message_size). What is so large but for its names, or was set
  ///          before Node::add() or a client has found the object, is reported where it can't be sent, unless it has
  ///          to wait for the stream there.
  void set_wire(std::string_view wire, Value value);
  /// The same, with the time that clients get with it, peeks as well: of what is played back or passed on. A client
  /// that has had a later one gets a time just above that.
  void set_wire(std::string_view wire, Value value, TimeSpec time);
  /// The wire has no InValue again, as before the first set_wire(): for peeks, and for clients that connect it from now
  /// on. Those that have connected it keep what they received: nothing in the protocol takes it back. Throws
  /// std::invalid_argument: no such wire.
  void reset_wire(std::string_view wire);
  /// Sets the InValue of one client alone, in place of the one that all have: for its peeks and for when it connects
  /// the wire later, too. Until set_wire() sets that of all again. Nothing happens where the client is gone. Throws as
  /// set_wire().
  void set_wire_for(ClientId client, std::string_view wire, Value value);
  /// A client's newest OutValue: handler(Value) or of the wire's C++ type.
  template <class F>
  void on_wire(std::string_view wire, F&& handler) {
    set_handler(wire, HandlerSlot::wire_received, make_handler(std::forward<F>(handler)));
  }

  /// objref without index. Set again, clients are told to look it up anew.
  void objref(std::string_view name, std::shared_ptr<Object> child);
  /// objref without index: find() is asked when a client looks it up first; nullptr where there is no object. Set
  /// again, clients are told to look it up anew.
  void objref(std::string_view name, std::function<std::shared_ptr<Object>()> find);
  /// Indexed objref: find(index text) returns the object, or nullptr where there is none.
  void objref(std::string_view name, std::function<std::shared_ptr<Object>(std::string_view index)> find);
  /// Clients may take turns at this object by its monitor lock: while one is in, requests of the others fail.
  void allow_monitor() { has_monitor_ = true; }
  bool is_monitor_lockable() const override { return has_monitor_; }

  /// The object behind an objref that a function finds was replaced: clients are told to look it up anew.
  void release(std::string_view objref);
  /// The same of an indexed objref.
  void release(std::string_view objref, std::string_view index);

  const std::string& type_name() const override { return type_->qualified_name; }
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition& objref,
                                                    const std::optional<std::string>& index) override;

 private:
  friend class Service;
  friend class ServiceClient;

  using OnEndpoint = std::function<void(PipeEndpoint)>;
  /// What the service has for one member. Handlers are shared with the call that runs them: they may set others in
  /// their own place.
  struct Member {
    std::shared_ptr<const Handler> call = {};                ///< functions
    std::shared_ptr<const GeneratorHandler> generator = {};  ///< generator functions
    std::shared_ptr<const MemoryHandlers> memory = {};
    std::shared_ptr<const Handler> get = {};
    std::shared_ptr<const Handler> set = {};
    std::shared_ptr<const Handler> wire_received = {};
    std::shared_ptr<const Value> in_value = {};                           ///< wires: what clients receive
    std::optional<TimeSpec> in_time = {};                                 ///< wires: what set_wire() was given
    std::map<ClientId, Value> own_in_values = {};                         ///< wires: what single clients do instead
    std::optional<Value> out_value = {};                                  ///< wires: the newest that a client sent
    SharedFunction<std::shared_ptr<Object>(std::string_view)> find = {};  ///< objrefs
    std::shared_ptr<const OnEndpoint> pipe_connected = {};
    std::shared_ptr<const PacketHandler> pipe_received = {};
    std::shared_ptr<const OnEndpoint> pipe_closed = {};
    std::vector<PipeEndpoint> endpoints = {};  ///< pipes: open ones
  };

  Object(Service& service, const EntityDefinition& type) : service_(service), type_(&type) {}
  const MemberDefinition& require_member(std::string_view name, MemberKind kind) const;
  void set_handler(std::string_view name, HandlerSlot slot, Handler handler);
  void set_pipe_handler(std::string_view name, std::shared_ptr<const OnEndpoint> Member::*slot, OnEndpoint handler);
  void set_packet_handler(std::string_view name, HandlerType packet, PacketHandler handler);
  std::size_t broadcast(std::string_view pipe, const Value& value, std::int32_t max_backlog);
  std::vector<PipeEndpoint> endpoints(std::string_view pipe);
  void set_generator(std::string_view name, GeneratorHandler handler);
  void check_arguments(const MemberDefinition& member, const char* verb, std::span<const Value> arguments) const;
  /// Throws std::invalid_argument where no message of the node's can be as large as that.
  void check_size(const MemberDefinition& member, const Message& packed) const;
  detail::MemoryForm memory_form(std::string_view name, DataType items) const;
  std::vector<std::string> paths() const;
  void release(const MemberDefinition& objref, std::optional<std::string_view> index);
  void release_path(const std::string& path);
  /// Texts like "function Drive", for functions, property accessors and objrefs without handler.
  std::vector<std::string> missing_handlers() const;

  /// Makes what a handler that answers later is handed.
  using BeginLate = std::function<std::shared_ptr<LateCall>()>;

  // Requests of clients; handlers run in here and may throw. No answer: it comes later.
  std::optional<Result<Value>> answer(Called& called, const BeginLate& begin_late);
  Result<Generator> open_generator(const Called& called);
  std::optional<Result<Value>> answer_memory(Called& called, const BeginLate& begin_late);
  void receive_wire(const WireReceived& received);
  void connect_pipe(const MemberDefinition& pipe, const PipeEndpoint& endpoint);
  Result<> receive_packet(const MemberDefinition& pipe, const PipeEndpoint& endpoint, const Value& packet);
  void close_pipe(const MemberDefinition& pipe, const PipeEndpoint& endpoint, bool tells_handler);
  /// `paths`  of this object. Throws as set_wire().
  WirePacket pack_in_value(std::string_view wire, const Value& value, const std::vector<std::string>& paths,
                           std::optional<TimeSpec> time = {}) const;
  void set_in_value(std::string_view wire, Value value, std::optional<TimeSpec> time);
  const Value* in_value(const MemberDefinition& wire, ClientId client) const;
  /// Of in_value(), where it is known.
  std::optional<TimeSpec> in_time(const MemberDefinition& wire, ClientId client) const;
  Error no_handler(std::string_view what, const MemberDefinition& member) const;
  void forget_client(ClientId client);

  Service& service_;
  const EntityDefinition* type_;
  bool has_monitor_ = false;
  std::unordered_map<const MemberDefinition*, Member> members_;
};

/// What a node does for the services that were added to it.
class ServiceHost {
 public:
  virtual void send_event(const Service& service, EventPacket& packet) = 0;
  /// To those who have connected the wire. `newest`  where its value is: another one there is sent by a call of its
  /// own.
  virtual void send_wire(WirePacket& packet, const std::shared_ptr<const Value>& newest) = 0;
  virtual void send_wire_to(ClientId client, WirePacket& packet) = 0;
  virtual void release_path(const Service& service, const std::string& path) = 0;
  /// `paths`  of the object: the client is called by one that it uses.
  virtual void call_callback(const Service& service, ClientId client, const std::vector<std::string>& paths,
                             const MemberDefinition& callback, std::span<const Value> arguments, CallbackDone done) = 0;
  virtual std::size_t max_message_size() const = 0;
  virtual ClientId current_client() const = 0;
  virtual Caller find_client(ClientId id) const = 0;
  /// A handler failed by mistake.
  virtual void report(const std::string& problem) = 0;

 protected:
  ~ServiceHost() = default;
};

/// A service: definition, name, root object.
class Service {
 public:
  /// `root_type` is the object's name in the last definition, or its qualified name. Clients get all definitions, also
  /// those that it does not import: for what a varvalue or an objref varobject holds. In compat mode the definitions
  /// may be such as clients of other makes refuse. Throws   std::invalid_argument with the first finding where a
  /// definition is not valid, an import is missing, or
  ///          there is no such object.
  static std::shared_ptr<Service> from_text(const std::vector<std::string>& definitions, std::string name,
                                            const std::string& root_type, RobdefMode mode = RobdefMode::strict);
  /// As from_text; the files may import one another. The last file holds the root type.
  /// Throws   std::invalid_argument: also for a file that cannot be read.
  static std::shared_ptr<Service> from_files(const std::vector<std::string>& paths, std::string name,
                                             const std::string& root_type);
  static std::shared_ptr<Service> from_file(const std::string& path, std::string name, const std::string& root_type) {
    return from_files({path}, std::move(name), root_type);
  }

  Object& root() { return *root_; }
  /// Another object of this service, for an objref. `type` as root_type.
  std::shared_ptr<Object> make_object(std::string_view type);
  const std::string& name() const { return name_; }
  const TypeRegistry& types() const { return *types_; }
  /// A number, text or array that clients find with the service. Before Node::add().
  void set_attribute(std::string key, Value value);

  /// Who may use the service, and how users log in. Before Node::add().
  void set_security(SecurityPolicy policy);

  /// Members may stay without handler: clients get NotImplementedError with this reason. Before Node::add().
  void serve_partly(std::string why) { why_partly_ = std::move(why); }

  /// Which client's request is being handled; 0 outside of handlers, and in functions that find objects: what they find
  /// is the same for all clients.
  ClientId current_client() const { return host_ ? host_->current_client() : 0; }
  /// The same with user and endpoint.
  Caller current_caller() const { return find_client(current_client()); }
  /// Any client that is connected now; its id is 0 where it is not.
  Caller find_client(ClientId id) const { return host_ ? host_->find_client(id) : Caller{}; }
  void on_client_connected(std::function<void(ClientId)> handler) { on_connected_ = std::move(handler); }
  /// Also when the connection broke. Not called any more when the node stops.
  void on_client_gone(std::function<void(ClientId)> handler) { on_gone_ = std::move(handler); }

  // The root's members, for short.
  template <class F>
  void function(std::string_view member, F&& handler) {
    root_->function(member, std::forward<F>(handler));
  }
  template <class F>
  void generator(std::string_view member, F&& handler) {
    root_->generator(member, std::forward<F>(handler));
  }
  template <class Memory>
  void memory(std::string_view member, Memory&& memory) {
    root_->memory(member, std::forward<Memory>(memory));
  }
  Object::Property property(std::string_view member) { return root_->property(member); }
  Object::Pipe pipe(std::string_view member) { return root_->pipe(member); }
  template <class... Args>
  void fire(std::string_view event, Args&&... arguments) {
    root_->fire(event, std::forward<Args>(arguments)...);
  }
  void call_callback(ClientId client, std::string_view callback, const std::vector<Value>& arguments,
                     CallbackDone done) {
    root_->call_callback(client, callback, arguments, std::move(done));
  }
  void set_wire(std::string_view wire, Value value) { root_->set_wire(wire, std::move(value)); }
  void set_wire_for(ClientId client, std::string_view wire, Value value) {
    root_->set_wire_for(client, wire, std::move(value));
  }
  template <class F>
  void on_wire(std::string_view wire, F&& handler) {
    root_->on_wire(wire, std::forward<F>(handler));
  }
  template <class Child>
  void objref(std::string_view member, Child&& child) {
    root_->objref(member, std::forward<Child>(child));
  }

  /// For the node: makes the service ready to be served.
  /// Throws   std::invalid_argument that lists the missing handlers, or that it was added before.
  std::shared_ptr<HostedService> attach(ServiceHost& host);
  /// For the node: from now on nothing reaches clients.
  void detach() { host_ = nullptr; }

 private:
  friend class Object;
  friend class ServiceClient;
  Service() = default;
  void forget_client(ClientId client);

  std::string name_;
  std::shared_ptr<TypeRegistry> types_;
  std::string definition_;  ///< name of the one that unqualified object types are of
  std::shared_ptr<Object> root_;
  std::vector<std::weak_ptr<Object>> unattached_;  ///< made before attach(), which checks their handlers
  /// Those with wires that have a value for one client alone.
  std::map<ClientId, std::set<std::weak_ptr<Object>, std::owner_less<>>> objects_of_clients_;
  MapString attributes_;
  SecurityPolicy security_;
  std::string why_partly_;  ///< empty: each member needs its handler
  std::shared_ptr<HostedService> hosted_;
  ServiceHost* host_ = nullptr;
  SharedFunction<void(ClientId)> on_connected_;
  SharedFunction<void(ClientId)> on_gone_;
};

}  // namespace rr
