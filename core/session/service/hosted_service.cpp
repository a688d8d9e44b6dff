#include "core/session/service/hosted_service.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "core/robdef/model/names.hpp"
#include "core/session/service/service_index.hpp"
#include "core/session/service_path.hpp"
#include "core/support/whole_number.hpp"

namespace rr {

namespace {

/// The definitions of these names and all that they import.
std::set<std::string, std::less<>> with_imports(const TypeRegistry& types, std::vector<std::string> open) {
  std::set<std::string, std::less<>> names;
  while (!open.empty()) {
    const auto name = std::move(open.back());
    open.pop_back();
    const auto* definition = types.find_service(name);
    if (!definition || !names.insert(name).second) continue;
    for (const auto& import : definition->imports) open.push_back(import.name);
  }
  return names;
}

bool can_read(const Version& client, const ServiceDefinition& definition) {
  return client.is_unspecified() || definition.version.is_unspecified() || definition.version <= client;
}

}  // namespace

Result<> check_index(const MemberDefinition& objref, const std::optional<std::string>& index) {
  const auto& type = objref.type;
  if (!objref.is_indexed()) {
    if (!index) return {};
    return make_error(ErrorCode::invalid_argument, "objref '" + objref.name + "' has no index");
  }
  if (!index) return make_error(ErrorCode::invalid_argument, "objref '" + objref.name + "' needs an index");
  if (type.container != ContainerKind::map_string && !canonical_number<std::int32_t>(*index))
    return make_error(ErrorCode::invalid_argument,
                      "objref '" + objref.name + "': index " + quote(*index) + ": expected a decimal int32");
  return {};
}

std::vector<std::string> unimported_definitions(const TypeRegistry& types, std::string_view root_type) {
  const auto imported = with_imports(types, {std::string(split_qualified(root_type).service)});
  std::vector<std::string> names;
  for (const auto& definition : types.definitions())
    if (!imported.contains(definition->name)) names.push_back(definition->name);
  return names;
}

std::string_view implements_name(const EntityDefinition& type, const ImplementsDefinition& base) {
  const auto [definition, name] = split_qualified(base.qualified_name);
  return definition == split_qualified(type.qualified_name).service ? name : std::string_view(base.qualified_name);
}

Result<std::shared_ptr<HostedService>> HostedService::make(std::string name, std::shared_ptr<ServiceObject> root,
                                                           std::shared_ptr<const TypeRegistry> types,
                                                           MapString attributes,
                                                           std::vector<std::string> extra_imports) {
  if (const auto path = parse_service_path(name); !path || path->size() != 1)
    return make_error(ErrorCode::invalid_argument,
                      "service name " + quote(name) + ": expected letters, digits and inner underscores");
  const auto* type = types->find_entity(root->type_name());
  if (!type || type->kind != EntityKind::object)
    return make_error(ErrorCode::service_definition_error,
                      "service " + quote(name) + ": " + quote(root->type_name()) + " is not an object type");
  std::shared_ptr<HostedService> service(new HostedService);
  service->root_ = root;
  service->types_ = std::move(types);
  service->root_type_ = type;
  service->attributes_ = Value(std::move(attributes));
  service->extra_imports_ = std::move(extra_imports);
  service->remember(name, Found{std::move(root), type});
  service->name_ = std::move(name);
  return service;
}

const EntityDefinition* HostedService::type_for_client(const EntityDefinition& type, const Version& client) const {
  const auto is_known = [&](const EntityDefinition& candidate) { return can_read(client, definition_of(candidate)); };
  if (is_known(type)) return &type;
  for (const auto& base : type.implements)
    if (const auto* candidate = types_->find_entity(base.qualified_name); candidate && is_known(*candidate))
      return candidate;
  return nullptr;
}

const ServiceDefinition& HostedService::definition_of(const EntityDefinition& type) const {
  return *types_->find_service(split_qualified(type.qualified_name).service);
}

std::vector<std::string_view> HostedService::extra_imports_for_client(const Version& client) const {
  std::vector<std::string_view> names;
  for (const auto& name : extra_imports_)
    if (const auto* definition = types_->find_service(name); definition && can_read(client, *definition))
      names.push_back(definition->name);
  return names;
}

std::vector<const ServiceDefinition*> HostedService::definitions_for_client(const EntityDefinition& root,
                                                                            const Version& client) const {
  const auto extra = extra_imports_for_client(client);
  std::vector<std::string> open(extra.begin(), extra.end());
  open.push_back(definition_of(root).name);
  std::vector<const ServiceDefinition*> definitions;
  for (const auto& name : with_imports(*types_, std::move(open))) definitions.push_back(types_->find_service(name));
  return definitions;
}

Result<HostedService::Found> HostedService::find_object(std::string_view path, RememberObjects remembers) {
  if (const auto known = objects_.find(path); known != objects_.end()) return Found(known->second);
  const auto segments = parse_service_path(path);
  if (!segments) return segments.error();
  if (segments->front().name != name_)
    return make_error(ErrorCode::object_not_found, "path " + quote(path) + " does not begin with this service");
  Found found = objects_.find(name_)->second;
  std::size_t length = name_.size();
  for (std::size_t i = 1; i < segments->size(); ++i) {
    const auto& segment = (*segments)[i];
    length = std::min(path.find('.', length + 1), path.size());
    const auto prefix = path.substr(0, length);
    if (const auto known = objects_.find(prefix); known != objects_.end()) {
      found = known->second;
      continue;
    }
    const auto* objref = found.type->find_member(segment.name);
    if (!objref || objref->kind != MemberKind::objref)
      return make_error(ErrorCode::member_not_found, found.type->name + " has no objref " + quote(segment.name));
    if (auto valid = check_index(*objref, segment.index); !valid) return valid.error();
    auto child = found.object->find_child(*objref, segment.index);
    if (!child) return child.error();
    if (!*child) return make_error(ErrorCode::service_error, "Requested object is null: " + quote(prefix));
    found.object = std::move(*child);
    found.type = types_->find_entity(found.object->type_name());
    if (!found.type || found.type->kind != EntityKind::object)
      return make_error(ErrorCode::internal_error,
                        "object " + quote(prefix) + " has the unknown type " + quote(found.object->type_name()));
    if (remembers == RememberObjects::no) continue;
    // One that is not remembered would be another object for each who asks: none of them would hear of the others'.
    if (objects_.size() >= max_cached_objects && !make_room(prefix)) return no_room(prefix);
    remember(std::string(prefix), found);
  }
  return found;
}

std::shared_ptr<const void> HostedService::use_object(std::string_view path) {
  const auto known = objects_.find(path);
  if (known == objects_.end()) return nullptr;
  auto& use = known->second.use;
  if (!use) use = std::make_shared<char>();
  return use;
}

/// Forgets a path that nobody uses, to begin with those behind `path`. Returns whether there was one.
bool HostedService::make_room(std::string_view path) {
  const auto is_unused = [this](const auto& known) {
    return known.second.use.use_count() <= 1 && known.first != name_;
  };
  const auto behind = objects_.upper_bound(path);
  auto victim = std::find_if(behind, objects_.end(), is_unused);
  if (victim == objects_.end()) {
    victim = std::find_if(objects_.begin(), behind, is_unused);
    if (victim == behind) return false;
  }
  forget(victim);
  return true;
}

Error HostedService::no_room(std::string_view path) {
  return make_error(ErrorCode::out_of_system_resource,
                    "object " + quote(path) + ": clients use too many paths of objects, expected at most " +
                        std::to_string(max_cached_objects));
}

Result<> HostedService::add_object(const std::string& path, std::shared_ptr<ServiceObject> object) {
  const auto* type = types_->find_entity(object->type_name());
  if (!type || type->kind != EntityKind::object)
    return make_error(ErrorCode::service_definition_error,
                      "object " + quote(path) + " has the unknown type " + quote(object->type_name()));
  if (objects_.size() >= max_cached_objects && !objects_.contains(path) && !make_room(path)) return no_room(path);
  remember(path, Found{std::move(object), type});
  return {};
}

std::vector<std::string> HostedService::forget_path(std::string_view path) {
  if (path == name_) return {};
  const auto wanted = canonical_path(path);
  object_locks_.handle_release(wanted);
  const auto segments = static_cast<std::size_t>(std::count(path.begin(), path.end(), '.'));
  const auto stem = path.substr(0, path.find('['));
  std::vector<std::string> spellings;
  for (auto object = objects_.lower_bound(stem); object != objects_.end() && object->first.starts_with(stem);) {
    const auto known_as = first_segments(object->first, segments + 1);
    if (canonical_path(known_as) != wanted) {
      ++object;
      continue;
    }
    if (spellings.empty() || spellings.back() != known_as) spellings.emplace_back(known_as);
    object = forget(object);
  }
  return spellings;
}

std::vector<std::string> HostedService::paths_of(const ServiceObject& object) const {
  std::vector<std::string> paths;
  for (auto known = paths_.lower_bound({&object, {}}); known != paths_.end() && known->first == &object; ++known)
    paths.emplace_back(known->second);
  return paths;
}

void HostedService::remember(std::string path, Found found) {
  std::shared_ptr<const void> use;
  if (const auto known = objects_.find(path); known != objects_.end()) {
    use = std::move(known->second.use);
    forget(known);
  }
  const auto object = objects_.emplace(std::move(path), Known(std::move(found))).first;
  object->second.use = std::move(use);
  paths_.emplace(object->second.object.get(), object->first);
}

HostedService::Objects::iterator HostedService::forget(Objects::iterator object) {
  paths_.erase({object->second.object.get(), object->first});
  return objects_.erase(object);
}

ServiceDirectory::ServiceDirectory(NodeIdentity identity) : identity_(std::move(identity)) {
  auto index = make_service_index();
  services_.emplace(index->name(), std::move(index));
}

Result<> ServiceDirectory::add(std::shared_ptr<HostedService> service) {
  const auto name = service->name();
  if (!services_.emplace(name, std::move(service)).second)
    return make_error(ErrorCode::invalid_argument, "the node has a service " + quote(name) + " already");
  return {};
}

bool ServiceDirectory::remove(std::string_view name) {
  const auto found = services_.find(name);
  if (found == services_.end() || name == service_index_name) return false;
  services_.erase(found);
  return true;
}

std::shared_ptr<HostedService> ServiceDirectory::find(std::string_view name) const {
  const auto found = services_.find(name);
  return found == services_.end() ? nullptr : found->second;
}

}  // namespace rr
