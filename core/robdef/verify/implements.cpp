// Inheritance of objects: bases spelled out, members repeated. Layer: robdef.
// Source: service definitions spec section 5.5.5.
#include <unordered_set>

#include "core/robdef/model/cycles.hpp"
#include "core/robdef/model/names.hpp"
#include "core/robdef/verify/scope.hpp"

namespace rr {

namespace {

/// One object lacks hardly more than this without lacking everything; the rest would be noise.
constexpr std::size_t max_missing_members = 20;

/// An object, its bases and members each once: a text may repeat them without end, and every object that implements
/// this one looks through them.
struct ObjectNode {
  VerifyScope* scope;
  EntityDefinition* object;
  bool is_cyclic = false;
  std::vector<const ImplementsDefinition*> bases = {};  ///< those that are objects
  std::vector<const MemberDefinition*> members = {};
};

class ImplementsCheck {
 public:
  explicit ImplementsCheck(VerifySet& set);
  void run();

 private:
  void resolve(ObjectNode& node);
  void report_cycles();
  void check_object(const ObjectNode& node);
  void check_bases(const ObjectNode& node, const ObjectNode& base, const ImplementsDefinition& implements,
                   const std::unordered_set<std::string_view>& own_bases);
  void check_members(const ObjectNode& node, const ObjectNode& base, const ImplementsDefinition& implements,
                     const std::unordered_map<std::string_view, const MemberDefinition*>& own_members);

  std::vector<ObjectNode> nodes_ = {};
  std::deque<std::string> names_ = {};
  std::unordered_map<std::string_view, std::size_t> index_ = {};
  Graph graph_ = {};
};

ImplementsCheck::ImplementsCheck(VerifySet& set) {
  for (auto& scope : set) {
    for (auto& entity : scope.definition->entities) {
      if (entity.kind != EntityKind::object) continue;
      index_.emplace(names_.emplace_back(scope.definition->name + '.' + entity.name), nodes_.size());
      auto& node = nodes_.emplace_back(ObjectNode{&scope, &entity});
      std::unordered_set<std::string_view> seen;
      for (const auto& member : entity.members)
        if (seen.insert(member.name).second) node.members.push_back(&member);
    }
  }
  graph_.resize(nodes_.size());
}

void ImplementsCheck::run() {
  for (auto& node : nodes_) resolve(node);
  report_cycles();
  for (const auto& node : nodes_) {
    if (!node.bases.empty()) check_object(node);
  }
}

void ImplementsCheck::resolve(ObjectNode& node) {
  std::unordered_set<std::string_view> seen;
  for (auto& item : node.object->implements) {
    const auto found = resolve_name(*node.scope, item.name, item.line, "implements-unknown");
    item.qualified_name = found.type == DataType::object_t ? found.qualified_name : std::string();
    if (found.type == DataType::void_t) continue;
    if (found.type != DataType::object_t) {
      node.scope->error("implements-unknown", item.line, item.name,
                        "found " + quote(item.name) + " after implements, expected an object type");
      continue;
    }
    if (!seen.insert(item.qualified_name).second) {
      node.scope->warning("duplicate-implements", item.line, item.name, "found 'implements " + item.name + "' again");
      continue;
    }
    graph_[static_cast<std::size_t>(&node - nodes_.data())].push_back(index_.at(item.qualified_name));
    node.bases.push_back(&item);
  }
}

void ImplementsCheck::report_cycles() {
  for (const auto& cycle : find_cycles(graph_)) {
    const auto& first = nodes_[cycle.front()];
    first.scope->error("implements-cycle", first.object->line, first.object->name,
                       "the object " + quote(first.object->name) + " implements itself");
    for (const auto member : cycle) {
      nodes_[member].is_cyclic = true;
      first.scope->reporter.note(nodes_[member].object->line,
                                 quote(nodes_[member].object->name) + " is part of the cycle");
    }
  }
}

bool is_same_type(const TypeDefinition& a, const TypeDefinition& b) {
  return a.type == b.type && a.qualified_name == b.qualified_name && a.array == b.array && a.sizes == b.sizes &&
         a.container == b.container;
}

bool is_resolved(const TypeDefinition& type) {
  return type.type != DataType::namedtype_t;
}

/// What differs between a member and its redeclaration; empty where nothing does, or a type is unknown anyway.
std::string_view difference(const MemberDefinition& own, const MemberDefinition& base) {
  if (own.kind != base.kind) return "the kind of member";
  if (!is_resolved(own.type) || !is_resolved(base.type)) return {};
  if (!is_same_type(own.type, base.type)) return "the type";
  if (own.parameters.size() != base.parameters.size()) return "the number of parameters";
  for (std::size_t i = 0; i < own.parameters.size(); ++i) {
    if (!is_resolved(own.parameters[i].type) || !is_resolved(base.parameters[i].type)) return {};
    if (own.parameters[i].name != base.parameters[i].name) return "the name of a parameter";
    if (!is_same_type(own.parameters[i].type, base.parameters[i].type)) return "the type of a parameter";
  }
  if (own.modifiers != base.modifiers) return "the modifiers or their order";
  return {};
}

void ImplementsCheck::check_object(const ObjectNode& node) {
  std::unordered_set<std::string_view> own_bases;
  std::unordered_map<std::string_view, const MemberDefinition*> own_members;
  for (const auto* item : node.bases) own_bases.insert(item->qualified_name);
  for (const auto* member : node.members) own_members.emplace(member->name, member);
  for (const auto* item : node.bases) {
    const auto& base = nodes_[index_.at(item->qualified_name)];
    if (base.object == node.object) continue;
    if (!node.is_cyclic) check_bases(node, base, *item, own_bases);
    check_members(node, base, *item, own_members);
  }
}

void ImplementsCheck::check_bases(const ObjectNode& node, const ObjectNode& base,
                                  const ImplementsDefinition& implements,
                                  const std::unordered_set<std::string_view>& own_bases) {
  std::size_t missing = 0;
  for (const auto* item : base.bases) {
    if (own_bases.contains(item->qualified_name)) continue;
    if (++missing > max_missing_members) return;
    node.scope->error("implements-missing", node.object->line, node.object->name,
                      quote(node.object->name) + " implements " + quote(implements.name) + ", which implements " +
                          quote(item->qualified_name) + ": expected 'implements' for it here too");
    node.scope->reporter.note(implements.line, quote(implements.name) + " is implemented here");
  }
}

void ImplementsCheck::check_members(const ObjectNode& node, const ObjectNode& base,
                                    const ImplementsDefinition& implements,
                                    const std::unordered_map<std::string_view, const MemberDefinition*>& own_members) {
  std::size_t missing = 0;
  for (const auto* member : base.members) {
    const auto own = own_members.find(member->name);
    if (own != own_members.end()) {
      const auto what = difference(*own->second, *member);
      if (what.empty()) continue;
      node.scope->error("implements-mismatch", own->second->line, member->name,
                        std::string(member_kind_name(own->second->kind)) + ' ' + quote(member->name) +
                            " differs from that of " + quote(implements.name) + " in " + std::string(what) +
                            ", expected them equal");
      node.scope->reporter.note(
          base.scope == node.scope ? member->line : 0,
          "the member of " + quote(implements.qualified_name) + ", line " + std::to_string(member->line));
      continue;
    }
    if (++missing > max_missing_members) return;
    node.scope->error("implements-missing", node.object->line, node.object->name,
                      quote(node.object->name) + " implements " + quote(implements.name) + " but lacks its " +
                          std::string(member_kind_name(member->kind)) + ' ' + quote(member->name));
    node.scope->reporter.note(implements.line, quote(implements.name) + " is implemented here");
  }
}

}  // namespace

void verify_implements(VerifySet& set) {
  ImplementsCheck(set).run();
}

}  // namespace rr
