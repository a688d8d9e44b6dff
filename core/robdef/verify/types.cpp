// Value types, and what structs, pods and namedarrays hold. Layer: robdef. Source: service definitions spec
// section 5.4.
#include <algorithm>
#include <limits>

#include "core/robdef/model/cycles.hpp"
#include "core/robdef/model/names.hpp"
#include "core/robdef/verify/scope.hpp"

namespace rr {

namespace {

std::string field_place(const EntityDefinition& entity, const MemberDefinition& field) {
  return "field " + quote(field.name) + " of " + quote(entity.name);
}

bool has_positive_sizes(const TypeDefinition& type) {
  return std::all_of(type.sizes.begin(), type.sizes.end(), [](std::int32_t size) { return size > 0; });
}

void verify_pod_field(VerifyScope& scope, const EntityDefinition& pod, const MemberDefinition& field) {
  const auto& type = field.type;
  const auto place = field_place(pod, field) + ": ";
  const bool is_named = !type.name.empty();
  const bool is_allowed =
      is_named ? type.type == DataType::pod_t || type.type == DataType::namedarray_t : is_numeric(type.type);
  if (!is_allowed) {
    scope.error("pod-field", field.line, field.name,
                place + "found the type " + quote(format_type(type)) + ", expected numbers, a pod or a namedarray");
  } else if (type.container != ContainerKind::none) {
    scope.error("pod-field", field.line, field.name,
                place + "found the container type " + quote(format_type(type)) + ", expected none in a pod");
  } else if (type.array == ArrayKind::variable || type.array == ArrayKind::multidim || !has_positive_sizes(type)) {
    scope.error(
        "pod-field", field.line, field.name,
        place + "found the array type " + quote(format_type(type)) + ", expected fixed or bounded sizes in a pod");
  }
}

void verify_namedarray_field(VerifyScope& scope, const EntityDefinition& array, const MemberDefinition& field) {
  const auto& type = field.type;
  const auto place = field_place(array, field) + ": ";
  const bool is_allowed = type.name.empty() ? is_numeric(type.type) : type.type == DataType::namedarray_t;
  if (!is_allowed) {
    scope.error("namedarray-field", field.line, field.name,
                place + "found the type " + quote(format_type(type)) + ", expected numbers or a namedarray");
  } else if (type.container != ContainerKind::none ||
             (type.array != ArrayKind::none && type.array != ArrayKind::fixed)) {
    scope.error("namedarray-field", field.line, field.name,
                place + "found the type " + quote(format_type(type)) + ", expected a scalar or [n] in a namedarray");
  }
}

bool is_contained_by_value(const EntityDefinition& entity) {
  return entity.kind == EntityKind::pod || entity.kind == EntityKind::namedarray;
}

struct Node {
  VerifyScope* scope;
  EntityDefinition* entity;
};

using NodeIndex = std::unordered_map<std::string_view, std::size_t>;

/// Element type and count of a namedarray whose parts are known already.
void flatten_namedarray(const Node& node, const std::vector<Node>& nodes, const NodeIndex& index) {
  auto& array = *node.entity;
  array.namedarray_type = DataType::void_t;
  array.namedarray_count = 0;
  std::uint64_t count = 0;
  for (const auto& field : array.members) {
    auto type = field.type.type;
    std::uint64_t elements = 1;
    if (!field.type.name.empty()) {
      const auto part = index.find(field.type.qualified_name);
      if (part == index.end()) continue;
      type = nodes[part->second].entity->namedarray_type;
      elements = nodes[part->second].entity->namedarray_count;
    }
    if (!is_numeric(type)) continue;  // reported where it is declared
    if (field.type.array == ArrayKind::fixed) elements *= static_cast<std::uint64_t>(field.type.sizes.front());
    count = std::min<std::uint64_t>(count + elements, std::numeric_limits<std::uint32_t>::max());
    if (array.namedarray_type == DataType::void_t) {
      array.namedarray_type = type;
    } else if (array.namedarray_type != type) {
      node.scope->error("namedarray-field", field.line, field.name,
                        field_place(array, field) + ": found elements of type " + quote(builtin_type_word(type)) +
                            ", expected " + quote(builtin_type_word(array.namedarray_type)) +
                            " as in the fields before");
      break;
    }
  }
  array.namedarray_count = static_cast<std::uint32_t>(count);
}

void report_recursion(const std::vector<std::size_t>& cycle, const std::vector<Node>& nodes) {
  const auto& first = nodes[cycle.front()];
  first.scope->error("recursion", first.entity->line, first.entity->name,
                     quote(first.entity->name) + " contains itself, which a pod or namedarray cannot");
  for (const auto member : cycle) {
    first.scope->reporter.note(nodes[member].entity->line, quote(nodes[member].entity->name) + " is part of the cycle");
  }
}

}  // namespace

bool check_value_type(VerifyScope& scope, const TypeDefinition& type, std::uint32_t line, std::string_view place) {
  const auto found = std::string(place) + ": found the type " + quote(format_type(type));
  const auto word = type.name.empty() ? builtin_type_word(type.type) : std::string_view(type.name);
  const auto refuse = [&](std::string_view code, std::string_view expected) {
    scope.error(code, line, word, found + ", expected " + std::string(expected));
    return false;
  };
  const auto relax = [&](std::string_view expected) {
    scope.relaxed("type-not-allowed", line, word, found + ", expected " + std::string(expected));
    return scope.reporter.is_compat();
  };
  if (type.type == DataType::namedtype_t) return false;  // unresolved, reported
  if (type.container == ContainerKind::generator) return refuse("generator", "no generator here");
  switch (type.type) {
    case DataType::void_t:
      return refuse("type-not-allowed", "a value type");
    case DataType::object_t:
      if (!type.name.empty()) return refuse("type-not-allowed", "a value type; objects are reached by objref");
      return relax("a value type; objects are reached by objref");
    case DataType::varobject_t:
      return relax("a value type; objects are reached by objref");
    default:
      break;
  }
  if (type.array == ArrayKind::none) return true;
  switch (type.type) {
    case DataType::string_t:
    case DataType::structure_t:
    case DataType::enum_t:
      return refuse("type-not-allowed", "no array of it; use {list}");
    case DataType::varvalue_t:
      return relax("no array of it; use {list}");
    default:
      return true;
  }
}

void verify_fields(VerifyScope& scope) {
  for (auto& entity : scope.definition->entities) {
    if (entity.kind == EntityKind::object) continue;
    for (auto& field : entity.members) {
      if (!resolve_type(scope, field.type, field.line)) continue;
      switch (entity.kind) {
        case EntityKind::pod:
          verify_pod_field(scope, entity, field);
          break;
        case EntityKind::namedarray:
          verify_namedarray_field(scope, entity, field);
          break;
        default:
          check_value_type(scope, field.type, field.line, field_place(entity, field));
      }
    }
    if (entity.kind == EntityKind::namedarray && entity.members.empty()) {
      scope.error("namedarray-field", entity.line, entity.name,
                  "the namedarray " + quote(entity.name) + " has no fields, expected at least one");
    }
  }
}

void verify_containment(VerifySet& set) {
  std::vector<Node> nodes;
  std::deque<std::string> names;
  NodeIndex index;
  for (auto& scope : set) {
    for (auto& entity : scope.definition->entities) {
      if (!is_contained_by_value(entity)) continue;
      index.emplace(names.emplace_back(scope.definition->name + '.' + entity.name), nodes.size());
      nodes.push_back({&scope, &entity});
    }
  }
  Graph graph(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto& [scope, entity] = nodes[i];
    for (const auto& field : entity->members) {
      if (field.type.name.empty()) continue;
      const auto part = index.find(field.type.qualified_name);
      if (part == index.end()) continue;
      graph[i].push_back(part->second);
      const auto& inner = *nodes[part->second].entity;
      if (&inner == entity || inner.name != entity->name) continue;
      scope->warning("interop", field.line, field.name,
                     field_place(*entity, field) + ": existing peers take " + quote(field.type.qualified_name) +
                         " for the type that contains it, and refuse it");
    }
  }
  const auto cycles = find_cycles(graph);
  std::vector<bool> is_cyclic(nodes.size(), false);
  for (const auto& cycle : cycles) {
    report_recursion(cycle, nodes);
    for (const auto member : cycle) is_cyclic[member] = true;
  }
  for (const auto node : dependencies_first(graph)) {
    if (nodes[node].entity->kind == EntityKind::namedarray && !is_cyclic[node])
      flatten_namedarray(nodes[node], nodes, index);
  }
}

}  // namespace rr
