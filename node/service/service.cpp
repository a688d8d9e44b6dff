#include "node/service/service.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "core/session/service_path.hpp"
#include "node/driver/clocks.hpp"
#include "node/service/refusal.hpp"

namespace rr {

namespace {

/// Kinds whose members need no handler yet: calls of them are answered with NotImplementedError.
bool may_be_absent(const MemberDefinition& member) {
  return member.kind != MemberKind::function && member.kind != MemberKind::property &&
         member.kind != MemberKind::objref;
}

/// What one step of a generator carries; void for any other type.
TypeDefinition step_type(TypeDefinition type) {
  if (type.container != ContainerKind::generator) return {};
  type.container = ContainerKind::none;
  return type;
}

bool is_kind_of(const TypeRegistry& types, const std::string& type, const std::string& wanted) {
  if (type == wanted) return true;
  const EntityDefinition* entity = types.find_entity(type);
  return entity && std::any_of(entity->implements.begin(), entity->implements.end(),
                               [&](const ImplementsDefinition& base) { return base.qualified_name == wanted; });
}

bool may_stand_behind(const TypeRegistry& types, const std::string& type, const MemberDefinition& objref) {
  return objref.type.type == DataType::varobject_t || is_kind_of(types, type, objref.type.qualified_name);
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) refuse("service definition " + rr::quote(path, 200) + " cannot be read");
  return text.str();
}

void check_parameters(const std::string& where, const std::vector<HandlerType>& taken,
                      const std::vector<ParameterDefinition>& parameters) {
  if (taken.size() != parameters.size())
    refuse(where + ": the handler takes " + std::to_string(taken.size()) + " parameters, the definition has " +
           std::to_string(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (!accepts(taken[i], parameters[i].type))
      refuse(where + ": parameter '" + parameters[i].name + "' is " + format_type(parameters[i].type) +
             ", the handler takes " + handler_type_text(taken[i]));
}

/// Of numbers and texts alone: the message is larger, by how much depends on its version and receiver.
std::size_t payload_bytes(const Message& message) {
  std::size_t bytes = 0;
  for (const auto& element : message.elements) bytes += element.data.size();
  return bytes;
}

void check_result(const std::string& where, const HandlerType& result, const TypeDefinition& type) {
  if (!returns(result, type))
    refuse(where + ": is " + format_type(type) + ", the handler returns " + handler_type_text(result));
}

}  // namespace

// --- Object: what the device says ---

const MemberDefinition& Object::require_member(std::string_view name, MemberKind kind) const {
  const MemberDefinition* member = type_->find_member(name);
  if (!member) refuse(type_name() + " has no member " + rr::quote(name));
  if (member->kind != kind)
    refuse(type_name() + "." + member->name + " is a " + std::string(member_kind_name(member->kind)) + ", not a " +
           std::string(member_kind_name(kind)));
  return *member;
}

void Object::set_handler(std::string_view name, HandlerSlot slot, Handler handler) {
  const auto kind = slot == HandlerSlot::call            ? MemberKind::function
                    : slot == HandlerSlot::wire_received ? MemberKind::wire
                                                         : MemberKind::property;
  const MemberDefinition& member = require_member(name, kind);
  const std::string where = type_name() + "." + member.name;
  const MemberDirection direction = member.direction();
  Member& mine = members_[&member];
  const auto keep = [&] { return std::make_shared<const Handler>(std::move(handler)); };
  switch (slot) {
    case HandlerSlot::call:
      if (member.is_generator()) refuse(where + " is a generator function: it takes a handler of generator()");
      check_parameters(where, handler.parameters, member.parameters);
      check_result(where, handler.result, member.type);
      mine.call = keep();
      break;
    case HandlerSlot::get:
      if (direction == MemberDirection::writeonly) refuse(where + " is writeonly: it takes no get handler");
      check_parameters(where + " (get)", handler.parameters, {});
      check_result(where, handler.result, member.type);
      mine.get = keep();
      break;
    case HandlerSlot::set:
      if (direction == MemberDirection::readonly) refuse(where + " is readonly: it takes no set handler");
      check_parameters(where + " (set)", handler.parameters, {{"value", member.type}});
      mine.set = keep();
      break;
    case HandlerSlot::wire_received:
      if (direction == MemberDirection::readonly) refuse(where + " is readonly: clients send nothing on it");
      if (handler.start) refuse(where + ": newer values do not wait for a handler, so it can't wait either");
      check_parameters(where, handler.parameters, {{"value", member.type}});
      mine.wire_received = keep();
      break;
  }
}

void Object::set_generator(std::string_view name, GeneratorHandler handler) {
  const MemberDefinition& member = require_member(name, MemberKind::function);
  const std::string where = type_name() + "." + member.name;
  if (!member.is_generator()) refuse(where + " is no generator function: it takes a handler of function()");
  auto parameters = member.parameters;
  std::vector<ParameterDefinition> step_parameters;
  if (const auto* step = member.step_parameter()) {
    step_parameters = {{step->name, step_type(step->type)}};
    parameters.pop_back();
  }
  check_parameters(where, handler.parameters, parameters);
  if (!handler.checks_itself) {
    check_parameters(where + ", each step", handler.step_parameters, step_parameters);
    check_result(where + ", each step", handler.value, step_type(member.type));
  }
  members_[&member].generator = std::make_shared<const GeneratorHandler>(std::move(handler));
}

void Object::check_arguments(const MemberDefinition& member, const char* verb, std::span<const Value> arguments) const {
  if (arguments.size() != member.parameters.size())
    refuse(type_name() + "." + member.name + ": " + verb + " with " + std::to_string(arguments.size()) +
           " arguments, the definition has " + std::to_string(member.parameters.size()));
  for (std::size_t i = 0; i < arguments.size(); ++i)
    check_value(type_name() + "." + member.name + ", argument '" + member.parameters[i].name + "'", arguments[i],
                member.parameters[i].type, *service_.types_);
}

void Object::check_size(const MemberDefinition& member, const Message& packed) const {
  if (!service_.host_) return;
  const auto bytes = payload_bytes(packed);
  if (const auto limit = service_.host_->max_message_size(); bytes >= limit)
    refuse(type_name() + "." + member.name + ": " + std::to_string(bytes) +
           " bytes are too large for a message, limit " + std::to_string(limit));
}

void Object::fire_values(std::string_view event, std::span<const Value> arguments) {
  const MemberDefinition& member = require_member(event, MemberKind::event);
  check_arguments(member, "fired", arguments);
  for (const std::string& path : paths()) {
    if (!service_.host_) return;  // nor after a handler has ended the node
    EventPacket packet(path, member, arguments);
    if (const auto packed = packet.message(*service_.types_)) check_size(member, (*packed)->message);
    service_.host_->send_event(service_, packet);
  }
}

void Object::call_callback(ClientId client, std::string_view callback, const std::vector<Value>& arguments,
                           CallbackDone done) {
  const MemberDefinition& member = require_member(callback, MemberKind::callback);
  check_arguments(member, "called", arguments);
  if (!service_.host_) refuse(type_name() + "." + member.name + ": the service is in no node");
  service_.host_->call_callback(service_, client, paths(), member, arguments, std::move(done));
}

WirePacket Object::pack_in_value(std::string_view wire, const Value& value, const std::vector<std::string>& paths,
                                 std::optional<TimeSpec> time) const {
  const MemberDefinition& member = require_member(wire, MemberKind::wire);
  if (member.direction() == MemberDirection::writeonly)
    refuse(type_name() + "." + member.name + " is writeonly: the service sends nothing on it");
  const Now now = read_clocks();
  WirePacket packet({}, member, value, time.value_or(now.utc), now.steady);
  const auto packed = packet.message(*service_.types_);
  if (!packed) refuse(type_name() + "." + member.name + ": " + packed.error().message);
  if (!paths.empty()) check_size(member, (*packed)->message);  // else nobody has it
  return packet;
}

void Object::set_wire(std::string_view wire, Value value) {
  set_in_value(wire, std::move(value), std::nullopt);
}

void Object::set_wire(std::string_view wire, Value value, TimeSpec time) {
  set_in_value(wire, std::move(value), time);
}

void Object::set_in_value(std::string_view wire, Value value, std::optional<TimeSpec> time) {
  auto newest = std::make_shared<const Value>(std::move(value));
  const auto paths = this->paths();
  WirePacket packet = pack_in_value(wire, *newest, paths, time);
  Member& mine = members_[&packet.member()];
  mine.own_in_values.clear();
  mine.in_time = time;
  mine.in_value = newest;
  if (!service_.host_) return;
  for (const std::string& path : paths) {
    // Meanwhile a handler may have set another, or ended the node.
    if (mine.in_value != newest || !service_.host_) return;
    packet.set_path(path);
    service_.host_->send_wire(packet, mine.in_value);
  }
}

void Object::reset_wire(std::string_view wire) {
  Member& mine = members_[&require_member(wire, MemberKind::wire)];
  mine.own_in_values.clear();
  mine.in_time.reset();
  mine.in_value.reset();
}

void Object::set_wire_for(ClientId client, std::string_view wire, Value value) {
  const auto paths = this->paths();
  WirePacket packet = pack_in_value(wire, value, paths);
  if (service_.find_client(client).id == 0) return;
  members_[&packet.member()].own_in_values.insert_or_assign(client, value);
  service_.objects_of_clients_[client].insert(weak_from_this());
  for (const std::string& path : paths) {
    if (!service_.host_) return;
    packet.set_path(path);
    service_.host_->send_wire_to(client, packet);
  }
}

void Object::forget_client(ClientId client) {
  for (auto& [member, mine] : members_) mine.own_in_values.erase(client);
}

void Object::objref(std::string_view name, std::shared_ptr<Object> child) {
  const MemberDefinition& member = require_member(name, MemberKind::objref);
  const std::string where = type_name() + "." + member.name;
  if (member.is_indexed()) refuse(where + " is indexed: it takes a function that finds the object");
  if (child && !may_stand_behind(*service_.types_, child->type_name(), member))
    refuse(where + ": is " + format_type(member.type) + ", the object is " + child->type_name());
  members_[&member].find = [child = std::move(child)](std::string_view) { return child; };
  release(member, std::nullopt);
}

void Object::objref(std::string_view name, std::function<std::shared_ptr<Object>()> find) {
  const MemberDefinition& member = require_member(name, MemberKind::objref);
  if (member.is_indexed()) refuse(type_name() + "." + member.name + " is indexed: it takes a function of the index");
  members_[&member].find = [find = std::move(find)](std::string_view) { return find(); };
  release(member, std::nullopt);
}

void Object::objref(std::string_view name, std::function<std::shared_ptr<Object>(std::string_view index)> find) {
  const MemberDefinition& member = require_member(name, MemberKind::objref);
  if (!member.is_indexed()) refuse(type_name() + "." + member.name + " has no index: it takes an object");
  members_[&member].find = std::move(find);
}

void Object::release(std::string_view name) {
  const MemberDefinition& member = require_member(name, MemberKind::objref);
  if (member.is_indexed()) refuse(type_name() + "." + member.name + " is indexed: release() takes an index");
  release(member, std::nullopt);
}

void Object::release(std::string_view name, std::string_view index) {
  const MemberDefinition& member = require_member(name, MemberKind::objref);
  if (!member.is_indexed()) refuse(type_name() + "." + member.name + " has no index");
  release(member, index);
}

void Object::release(const MemberDefinition& objref, std::optional<std::string_view> index) {
  for (const std::string& path : paths()) release_path(child_path(path, objref.name, index));
}

std::vector<std::string> Object::paths() const {
  if (!service_.hosted_) return {};
  return service_.hosted_->paths_of(*this);
}

void Object::release_path(const std::string& path) {
  for (const auto& spelling : service_.hosted_->forget_path(path))
    if (service_.host_) service_.host_->release_path(service_, spelling);
}

std::vector<std::string> Object::missing_handlers() const {
  std::vector<std::string> missing;
  for (const MemberDefinition& member : type_->members) {
    if (may_be_absent(member)) continue;
    const auto found = members_.find(&member);
    const Member* mine = found == members_.end() ? nullptr : &found->second;
    const auto report = [&](bool is_there, std::string_view what) {
      if (!is_there) missing.push_back(std::string(what) + " " + type_->name + "." + member.name);
    };
    const MemberDirection direction = member.direction();
    if (member.kind == MemberKind::function)
      report(mine && (member.is_generator() ? mine->generator != nullptr : mine->call != nullptr), "function");
    if (member.kind == MemberKind::objref) report(mine && mine->find, "objref");
    if (member.kind != MemberKind::property) continue;
    if (direction != MemberDirection::writeonly) report(mine && mine->get, "get of property");
    if (direction != MemberDirection::readonly) report(mine && mine->set, "set of property");
  }
  return missing;
}

// --- Object: what clients ask ---

Result<std::shared_ptr<ServiceObject>> Object::find_child(const MemberDefinition& objref,
                                                          const std::optional<std::string>& index) {
  const auto found = members_.find(&objref);
  if (found == members_.end() || !found->second.find) return no_handler("objref", objref);
  const auto find = found->second.find;  // it may give the objref another one
  std::shared_ptr<Object> child;
  try {
    child = find(index ? std::string_view(*index) : std::string_view{});
  } catch (...) {
    auto error = handler_error(std::current_exception());
    if (!is_unhandled(error)) return error;
    if (service_.host_) service_.host_->report(describe_failure("objref", objref.name, error));
    return make_error(ErrorCode::object_not_found, std::move(error.message));
  }
  if (child && &child->service_ != &service_)
    return make_error(ErrorCode::internal_error, "objref '" + objref.name + "': the object is of another service, '" +
                                                     child->service_.name_ + "'");
  if (child && !may_stand_behind(*service_.types_, child->type_name(), objref))
    return make_error(ErrorCode::internal_error, "objref '" + objref.name + "' is " + format_type(objref.type) +
                                                     ", the service gave a " + child->type_name());
  return std::shared_ptr<ServiceObject>(std::move(child));
}

std::optional<Result<Value>> Object::answer(Called& called, const BeginLate& begin_late) {
  const auto ask = [&](std::shared_ptr<const Handler> handler) -> std::optional<Result<Value>> {
    if (handler->call) return handler->call(called.arguments);
    handler->start(std::move(called.arguments), begin_late());
    return std::nullopt;
  };
  const auto missing = [&](std::string_view what) { return no_handler(what, *called.member); };
  const auto found = members_.find(called.member);
  Member* mine = found == members_.end() ? nullptr : &found->second;
  switch (called.kind) {
    case CallKind::function:
      return mine && mine->call ? ask(mine->call) : missing("function");
    case CallKind::property_get:
      return mine && mine->get ? ask(mine->get) : missing("get of property");
    case CallKind::property_set:
      return mine && mine->set ? ask(mine->set) : missing("set of property");
    case CallKind::peek_in:
    case CallKind::peek_out: {
      if (called.kind == CallKind::peek_in)
        if (const Value* value = in_value(*called.member, service_.current_client())) return *value;
      if (mine && called.kind == CallKind::peek_out && mine->out_value) return *mine->out_value;
      return make_error(ErrorCode::value_not_set, "wire '" + called.member->name + "' has no value yet");
    }
    case CallKind::poke_out: {
      Member& wire = mine ? *mine : members_[called.member];
      wire.out_value = called.arguments.front();
      const auto received = wire.wire_received;
      return received ? received->call(called.arguments) : Value{};
    }
    case CallKind::memory_dimensions:
    case CallKind::memory_read:
    case CallKind::memory_write:
      return answer_memory(called, begin_late);
    case CallKind::generator_open:
    case CallKind::generator_next:
    case CallKind::generator_close:
    case CallKind::generator_abort:
      break;  // ServiceClient keeps generators and answers for them
  }
  return missing("member");
}

Result<Generator> Object::open_generator(const Called& called) {
  const auto found = members_.find(called.member);
  const auto generator = found != members_.end() ? found->second.generator : nullptr;
  return generator ? generator->open(called.arguments) : no_handler("generator", *called.member);
}

void Object::receive_wire(const WireReceived& received) {
  Member& wire = members_[received.member];
  wire.out_value = received.value;
  if (const auto handler = wire.wire_received) (void)handler->call({&received.value, 1});
}

const Value* Object::in_value(const MemberDefinition& wire, ClientId client) const {
  const auto found = members_.find(&wire);
  if (found == members_.end()) return nullptr;
  const auto own = found->second.own_in_values.find(client);
  return own != found->second.own_in_values.end() ? &own->second : found->second.in_value.get();
}

std::optional<TimeSpec> Object::in_time(const MemberDefinition& wire, ClientId client) const {
  const auto found = members_.find(&wire);
  if (found == members_.end() || found->second.own_in_values.contains(client)) return std::nullopt;
  return found->second.in_time;
}

Error Object::no_handler(std::string_view what, const MemberDefinition& member) const {
  const auto& why = service_.why_partly_;
  return make_error(ErrorCode::not_implemented_error,
                    std::string(what) + " '" + member.name + "'" + (why.empty() ? " has no handler" : ": " + why));
}

// --- Service ---

std::shared_ptr<Service> Service::from_text(const std::vector<std::string>& definitions, std::string name,
                                            const std::string& root_type, RobdefMode mode) {
  std::shared_ptr<Service> service(new Service);
  service->name_ = std::move(name);
  service->types_ = std::make_shared<TypeRegistry>();
  if (auto added = service->types_->add(definitions, mode); !added)
    refuse("service " + rr::quote(service->name_) + ": " + added.error().message);
  if (definitions.empty()) refuse("service " + rr::quote(service->name_) + " has no definition");
  service->definition_ = parse_service_definition(definitions.back(), mode).definition.name;
  service->root_ = service->make_object(root_type);
  return service;
}

std::shared_ptr<Service> Service::from_files(const std::vector<std::string>& paths, std::string name,
                                             const std::string& root_type) {
  std::vector<std::string> texts;
  texts.reserve(paths.size());
  for (const std::string& path : paths) texts.push_back(read_file(path));
  return from_text(texts, std::move(name), root_type);
}

std::shared_ptr<Object> Service::make_object(std::string_view type) {
  std::string qualified(type);
  if (qualified.find('.') == std::string::npos) qualified = definition_ + "." + qualified;
  const EntityDefinition* entity = types_->find_entity(qualified);
  if (!entity || entity->kind != EntityKind::object)
    refuse("service " + rr::quote(name_) + ": there is no object type " + rr::quote(qualified));
  std::shared_ptr<Object> object(new Object(*this, *entity));
  if (!hosted_) unattached_.push_back(object);
  return object;
}

void Service::forget_client(ClientId client) {
  const auto objects = objects_of_clients_.extract(client);
  if (!objects) return;
  for (const auto& weak : objects.mapped())
    if (const auto object = weak.lock()) object->forget_client(client);
}

void Service::set_attribute(std::string key, Value value) {
  if (host_) refuse("service " + rr::quote(name_) + ": attributes are set before the service is added to a node");
  std::erase_if(attributes_.items, [&](const auto& item) { return item.first == key; });
  attributes_.items.emplace_back(std::move(key), std::move(value));
}

void Service::set_security(SecurityPolicy policy) {
  if (host_) refuse("service " + rr::quote(name_) + ": security is set before the service is added to a node");
  if (policy.require_valid_user && !policy.authenticator)
    refuse("service " + rr::quote(name_) + " requires a user, but has no authenticator: nobody could log in");
  security_ = std::move(policy);
}

std::shared_ptr<HostedService> Service::attach(ServiceHost& host) {
  if (hosted_) refuse("service " + rr::quote(name_) + " was added to a node before");
  std::string missing;
  for (const std::weak_ptr<Object>& weak : unattached_)
    if (const auto object = weak.lock(); object && why_partly_.empty())
      for (const std::string& handler : object->missing_handlers()) missing += (missing.empty() ? "" : ", ") + handler;
  if (!missing.empty()) refuse("service " + rr::quote(name_) + ": no handler for " + missing);
  auto hosted =
      HostedService::make(name_, root_, types_, attributes_, unimported_definitions(*types_, root_->type_name()));
  if (!hosted) refuse("service " + rr::quote(name_) + ": " + hosted.error().message);
  hosted_ = std::move(*hosted);
  unattached_.clear();
  hosted_->set_policy(security_);
  host_ = &host;
  return hosted_;
}

}  // namespace rr
