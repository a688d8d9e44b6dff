#include "node/service/service_stub.hpp"

#include "core/support/whole_number.hpp"

namespace rr {

Service& ServiceStub::rr_service() const {
  if (!service_)
    throw std::logic_error(std::string(rr_object_type()) + " is in no service yet: no client has asked for it");
  return *service_;
}

void ServiceStub::rr_attach(Service& service, const std::shared_ptr<Object>& object) {
  if (service_ && service_ != &service)
    throw std::logic_error(std::string(rr_object_type()) + " belongs to service '" + service_->name() + "' already");
  service_ = &service;
  object_ = object;
  rr_bind(*object);
  for (const auto& [wire, value] : in_values_) object->set_wire(wire, value);
}

std::shared_ptr<Object> ServiceStub::rr_child(const std::shared_ptr<ServiceStub>& child) const {
  if (!child) return nullptr;
  if (auto object = child->object_.lock()) return object;
  auto object = rr_service().make_object(child->rr_object_type());
  child->rr_attach(rr_service(), object);
  return object;
}

void ServiceStub::rr_set_wire(const char* wire, Value value) {
  if (const auto object = object_.lock()) object->set_wire(wire, value);
  in_values_.insert_or_assign(wire, std::move(value));
}

std::size_t ServiceStub::rr_broadcast(std::string_view pipe, const Value& packet) {
  const auto object = object_.lock();
  return object ? object->pipe(pipe).broadcast(packet) : 0;
}

std::int32_t ServiceStub::rr_number(std::string_view text) {
  if (const auto number = whole_number<std::int32_t>(text)) return *number;
  throw Exception(make_error(ErrorCode::invalid_argument, "index " + quote(text) + ": expected an int32"));
}

std::shared_ptr<Service> make_service(std::string name, const std::shared_ptr<ServiceStub>& root) {
  auto service = Service::from_text(root->rr_object_definitions(), std::move(name), std::string(root->rr_object_type()),
                                    root->rr_definition_mode());
  root->rr_attach(*service, service->root().shared_from_this());
  return service;
}

}  // namespace rr
