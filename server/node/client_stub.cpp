#include "server/node/client_stub.hpp"

#include <algorithm>

namespace rr {

namespace {

bool is_kind_of(const EntityDefinition& entity, std::string_view type) {
  return entity.qualified_name == type ||
         std::any_of(entity.implements.begin(), entity.implements.end(),
                     [&](const ImplementsDefinition& base) { return base.qualified_name == type; });
}

}  // namespace

ClientStub::ClientStub(RemoteObject object, std::string_view type, ThrowDeclared throw_declared)
    : rr_object(std::move(object)), throw_declared_(throw_declared) {
  const auto* entity = rr_object.connection().asynchronous().session().object_type(rr_object.path());
  if (entity && is_kind_of(*entity, type)) return;
  throw ClientException(make_error(
      ErrorCode::object_not_found,
      "object " + rr_object.path() + " is a " + rr_object.type_name() + ", which is no " + std::string(type)));
}

}  // namespace rr
