#include "core/robdef/resolve/resolve.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <string_view>

#include "core/robdef/model/cycles.hpp"
#include "core/robdef/model/names.hpp"

namespace rr {

namespace {

bool is_any_of(DataType type, std::initializer_list<DataType> types) {
  return std::find(types.begin(), types.end(), type) != types.end();
}

bool may_be_field(EntityKind kind, const TypeDefinition& type);
bool may_be_value(const TypeDefinition& type);
bool may_be_member(const MemberDefinition& member);

class Resolver {
 public:
  Resolver(std::span<ServiceDefinition* const> set, std::span<const ServiceDefinition* const> known)
      : set_(set), known_(known), has_error_(set.size()) {}
  std::vector<Diagnostic> run();

 private:
  struct Named {
    DataType type = DataType::void_t;
    const EntityDefinition* entity = nullptr;
    EntityDefinition* own = nullptr;  ///< the same, where it is of the set
    std::size_t service = 0;
  };

  void index_names();
  void index_entity(const EntityDefinition& entity, EntityDefinition* own, std::size_t service);
  void check_imports();
  void resolve_entity(std::size_t service, EntityDefinition& entity);
  bool resolve_type(std::size_t service, TypeDefinition& type, std::uint32_t line);
  std::string qualified_name(const ServiceDefinition& from, const std::string& name) const;
  void check_containment();
  bool flatten(EntityDefinition& array);
  void refuse(std::size_t service, std::uint32_t line, std::string message);

  std::span<ServiceDefinition* const> set_;
  std::span<const ServiceDefinition* const> known_;
  std::map<std::string, Named> names_ = {};  ///< by qualified name
  std::vector<bool> has_error_;
  std::vector<Diagnostic> errors_ = {};
};

std::vector<Diagnostic> Resolver::run() {
  index_names();
  check_imports();
  for (std::size_t service = 0; service < set_.size(); ++service)
    for (auto& entity : set_[service]->entities) resolve_entity(service, entity);
  check_containment();
  return std::move(errors_);
}

void Resolver::index_names() {
  const auto index_enums = [&](const ServiceDefinition& definition) {
    for (const auto& item : definition.enums)
      names_.emplace(definition.name + '.' + item.name, Named{.type = DataType::enum_t});
  };
  for (std::size_t service = 0; service < set_.size(); ++service) {
    auto& definition = *set_[service];
    for (auto& entity : definition.entities) {
      entity.qualified_name = definition.name + '.' + entity.name;
      index_entity(entity, &entity, service);
    }
    index_enums(definition);
  }
  for (const auto* definition : known_) {
    for (const auto& entity : definition->entities) index_entity(entity, nullptr, 0);
    index_enums(*definition);
  }
}

void Resolver::index_entity(const EntityDefinition& entity, EntityDefinition* own, std::size_t service) {
  constexpr DataType types[] = {DataType::structure_t, DataType::pod_t, DataType::namedarray_t, DataType::object_t};
  names_.emplace(entity.qualified_name, Named{types[static_cast<std::size_t>(entity.kind)], &entity, own, service});
}

void Resolver::check_imports() {
  std::map<std::string_view, std::size_t> services;
  for (std::size_t service = 0; service < set_.size(); ++service) {
    if (!services.emplace(set_[service]->name, service).second) refuse(service, 0, "a second definition of this name");
  }
  for (const auto* definition : known_) services.emplace(definition->name, set_.size());
  Graph graph(set_.size() + 1);  // the last node stands for all that is known, which imports nothing of the set
  for (std::size_t service = 0; service < set_.size(); ++service) {
    for (const auto& import : set_[service]->imports) {
      const auto found = services.find(import.name);
      if (found != services.end()) {
        graph[service].push_back(found->second);
      } else {
        refuse(service, import.line,
               "found the import of " + quote(import.name) + ", but no such definition was given");
      }
    }
  }
  for (const auto& cycle : find_cycles(graph)) refuse(cycle.front(), 0, "found a cycle of imports");
}

void Resolver::resolve_entity(std::size_t service, EntityDefinition& entity) {
  const auto& definition = *set_[service];
  for (auto& base : entity.implements) {
    const auto found = names_.find(qualified_name(definition, base.name));
    const bool is_object = found != names_.end() && found->second.type == DataType::object_t;
    base.qualified_name = is_object ? found->first : std::string();
  }
  for (auto& member : entity.members) {
    bool is_resolved = resolve_type(service, member.type, member.line);
    for (auto& parameter : member.parameters)
      is_resolved = resolve_type(service, parameter.type, member.line) && is_resolved;
    const bool is_valid =
        entity.kind == EntityKind::object ? may_be_member(member) : may_be_field(entity.kind, member.type);
    if (is_resolved && !is_valid)
      refuse(service, member.line,
             quote(member.name) + " of " + quote(entity.name) + ": found the type " + quote(format_type(member.type)) +
                 " or parameters that are not allowed there");
  }
}

bool Resolver::resolve_type(std::size_t service, TypeDefinition& type, std::uint32_t line) {
  if (type.name.empty()) return true;
  const auto found = names_.find(qualified_name(*set_[service], type.name));
  type.type = found == names_.end() ? DataType::namedtype_t : found->second.type;
  type.qualified_name = found == names_.end() ? std::string() : found->first;
  if (found == names_.end()) refuse(service, line, "found the unknown type " + quote(type.name));
  return found != names_.end();
}

/// Of a name as `from` sees it; "" for one of a definition that it does not import.
std::string Resolver::qualified_name(const ServiceDefinition& from, const std::string& name) const {
  auto service = split_qualified(name).service;
  const auto& usings = from.usings;
  const auto alias = std::find_if(usings.begin(), usings.end(), [&](const auto& item) { return item.alias == name; });
  const bool is_alias = service.empty() && alias != usings.end();
  if (is_alias) service = split_qualified(alias->qualified_name).service;
  if (service.empty()) return from.name + '.' + name;
  const auto& imports = from.imports;
  const auto is_wanted = [&](const auto& item) { return item.name == service; };
  if (service != from.name && std::none_of(imports.begin(), imports.end(), is_wanted)) return {};
  return is_alias ? alias->qualified_name : name;
}

/// Pods and namedarrays hold themselves nowhere; of namedarrays their elements are counted.
void Resolver::check_containment() {
  std::map<const EntityDefinition*, std::size_t> index;
  std::vector<Named*> nodes;
  for (auto& [name, item] : names_) {
    if (!item.own || (item.type != DataType::pod_t && item.type != DataType::namedarray_t)) continue;
    index.emplace(item.entity, nodes.size());
    nodes.push_back(&item);
  }
  Graph graph(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const auto& field : nodes[i]->entity->members) {
      const auto part = names_.find(field.type.qualified_name);
      if (part == names_.end()) continue;
      if (const auto node = index.find(part->second.entity); node != index.end()) graph[i].push_back(node->second);
    }
  }
  const auto cycles = find_cycles(graph);
  for (const auto& cycle : cycles) {
    const auto& first = *nodes[cycle.front()];
    refuse(first.service, first.entity->line, quote(first.entity->name) + " contains itself");
  }
  if (!cycles.empty()) return;
  for (const auto node : dependencies_first(graph)) {
    const auto& item = *nodes[node];
    if (item.type == DataType::namedarray_t && !flatten(*item.own))
      refuse(item.service, item.entity->line, quote(item.entity->name) + ": expected elements of one numeric type");
  }
}

/// Element type and count of a namedarray whose parts are known already.
bool Resolver::flatten(EntityDefinition& array) {
  array.namedarray_type = DataType::void_t;
  std::uint64_t count = 0;
  for (const auto& field : array.members) {
    const auto part = names_.find(field.type.qualified_name);
    const auto* inner = part == names_.end() ? nullptr : part->second.entity;
    const auto type = inner ? inner->namedarray_type : field.type.type;
    std::uint64_t elements = inner ? inner->namedarray_count : 1;
    if (field.type.array == ArrayKind::fixed) elements *= static_cast<std::uint64_t>(field.type.sizes.front());
    count = std::min<std::uint64_t>(count + elements, std::numeric_limits<std::uint32_t>::max());
    if (&field == &array.members.front()) array.namedarray_type = type;
    if (!is_numeric(type) || type != array.namedarray_type) return false;
  }
  array.namedarray_count = static_cast<std::uint32_t>(count);
  return !array.members.empty();
}

void Resolver::refuse(std::size_t service, std::uint32_t line, std::string message) {
  if (has_error_[service]) return;
  has_error_[service] = true;
  const auto& definition = *set_[service];
  errors_.push_back(
      {Severity::error, "definition-unusable", std::move(message), definition.file, definition.name, line});
}

bool has_no_container(const TypeDefinition& type) {
  return type.container == ContainerKind::none;
}

bool may_be_field(EntityKind kind, const TypeDefinition& type) {
  if (kind == EntityKind::structure) return may_be_value(type);
  const bool is_pod = kind == EntityKind::pod;
  const bool is_known =
      is_numeric(type.type) || type.type == DataType::namedarray_t || (is_pod && type.type == DataType::pod_t);
  const bool is_sized = std::all_of(type.sizes.begin(), type.sizes.end(), [](auto size) { return size > 0; });
  const bool is_shaped = type.array == ArrayKind::none || type.array == ArrayKind::fixed ||
                         (is_pod && (type.array == ArrayKind::max || type.array == ArrayKind::fixed_multidim));
  return is_known && is_sized && is_shaped && has_no_container(type);
}

/// As compat has it.
bool may_be_value(const TypeDefinition& type) {
  if (type.container == ContainerKind::generator || type.type == DataType::void_t) return false;
  if (type.type == DataType::object_t) return type.name.empty();
  return type.array == ArrayKind::none ||
         !is_any_of(type.type, {DataType::string_t, DataType::structure_t, DataType::enum_t});
}

bool may_be_stepped(TypeDefinition type) {
  type.container = ContainerKind::none;
  return may_be_value(type);
}

bool may_be_call(const MemberDefinition& member) {
  const auto& parameters = member.parameters;
  const bool may_generate = member.kind == MemberKind::function;
  const auto is_generator = [&](const TypeDefinition& type) {
    return may_generate && type.container == ContainerKind::generator;
  };
  bool has_generator = false;
  for (const auto& [name, type] : parameters) {
    if (has_generator) return false;  // only the last one may be
    has_generator = is_generator(type);
    if (has_generator ? !may_be_stepped(type) : !may_be_value(type)) return false;
  }
  const auto& result = member.type;
  if (member.kind == MemberKind::event) return true;
  if (is_generator(result)) return may_be_stepped(result);
  if (result.type != DataType::void_t) return !has_generator && may_be_value(result);
  return has_generator || (result.array == ArrayKind::none && has_no_container(result));
}

bool may_be_member(const MemberDefinition& member) {
  const auto& type = member.type;
  switch (member.kind) {
    case MemberKind::function:
    case MemberKind::callback:
    case MemberKind::event:
      return may_be_call(member);
    case MemberKind::memory:
      return (is_numeric(type.type) || type.type == DataType::pod_t || type.type == DataType::namedarray_t) &&
             (type.array == ArrayKind::variable || type.array == ArrayKind::multidim) &&
             type.container != ContainerKind::generator;
    case MemberKind::objref:
      return type.name.empty() ? type.type == DataType::varobject_t : type.type == DataType::object_t;
    default:
      return may_be_value(type);
  }
}

}  // namespace

std::vector<Diagnostic> resolve_service_definitions(std::span<ServiceDefinition* const> set,
                                                    std::span<const ServiceDefinition* const> known) {
  return Resolver(set, known).run();
}

}  // namespace rr
