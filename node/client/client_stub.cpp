#include "node/client/client_stub.hpp"

#include <algorithm>

#include "node/client/async_stub.hpp"

namespace rr {

namespace {

bool is_kind_of(const EntityDefinition& entity, std::string_view type) {
  return entity.qualified_name == type ||
         std::any_of(entity.implements.begin(), entity.implements.end(),
                     [&](const ImplementsDefinition& base) { return base.qualified_name == type; });
}

void throw_failure(const Result<>& result) {
  if (!result) throw ClientException(result.error());
}

}  // namespace

Result<> detail::check_object_type(const ClientConnection& connection, std::string_view path, std::string_view type) {
  const auto* entity = connection.session().object_type(path);
  const auto object = "object " + std::string(path);
  if (!entity) return make_error(ErrorCode::object_not_found, object + " was replaced");
  if (is_kind_of(*entity, type)) return {};
  return make_error(ErrorCode::object_not_found,
                    object + " is a " + entity->qualified_name + ", which is no " + std::string(type));
}

ClientStub::ClientStub(RemoteObject object, std::string_view type, ThrowDeclared throw_declared)
    : rr_object(std::move(object)), throw_declared_(throw_declared) {
  throw_failure(detail::check_object_type(rr_object.connection().asynchronous(), rr_object.path(), type));
}

AsyncClientStub::AsyncClientStub(AsyncObject object, std::string_view type, ThrowDeclared throw_declared)
    : rr_object(std::move(object)), throw_declared_(throw_declared) {
  throw_failure(detail::check_object_type(*rr_object.connection(), rr_object.path(), type));
}

}  // namespace rr
