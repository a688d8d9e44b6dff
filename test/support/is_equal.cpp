#include "test/support/is_equal.hpp"

#include <algorithm>

#include "core/robdef/model/canonical_names.hpp"
#include "core/robdef/model/names.hpp"
#include "core/support/words.hpp"

namespace rr::test {

namespace {

template <class Item, class Same>
bool is_equal_list(const std::vector<Item>& a, const std::vector<Item>& b, Same same) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

bool is_equal_options(const std::vector<OptionDefinition>& a, const std::vector<OptionDefinition>& b) {
  return is_equal_list(a, b, [](const auto& x, const auto& y) { return x.text == y.text; });
}

bool is_equal_constants(const std::vector<ConstantDefinition>& a, const std::vector<ConstantDefinition>& b) {
  return is_equal_list(a, b, [](const auto& x, const auto& y) {
    return format_type(x.type) == format_type(y.type) && x.name == y.name && trim(x.value_text) == trim(y.value_text);
  });
}

bool is_equal_enum(const EnumDefinition& a, const EnumDefinition& b) {
  return a.name == b.name && is_equal_list(a.values, b.values, [](const auto& x, const auto& y) {
           return x.name == y.name && x.value == y.value && x.is_implicit == y.is_implicit && x.is_hex == y.is_hex;
         });
}

/// Types as they are written canonically: neither resolution nor the choice between alias and full name counts.
class Comparison {
 public:
  Comparison(const ServiceDefinition& a, const ServiceDefinition& b) : a_(a), b_(b) {}

  bool is_equal_entity(const EntityDefinition& x, const EntityDefinition& y) const {
    const auto same_base = [this](const auto& p, const auto& q) { return a_.name(p.name) == b_.name(q.name); };
    const auto same_member = [this](const auto& p, const auto& q) { return is_equal_member(p, q); };
    return x.kind == y.kind && x.name == y.name && is_equal_list(x.implements, y.implements, same_base) &&
           is_equal_options(x.options, y.options) && is_equal_constants(x.constants, y.constants) &&
           is_equal_list(x.members, y.members, same_member);
  }

 private:
  bool is_equal_type(const TypeDefinition& x, const TypeDefinition& y) const {
    return format_type(a_.type(x)) == format_type(b_.type(y));
  }

  bool is_equal_member(const MemberDefinition& x, const MemberDefinition& y) const {
    const auto same_parameter = [this](const auto& p, const auto& q) {
      return p.name == q.name && is_equal_type(p.type, q.type);
    };
    return x.kind == y.kind && x.name == y.name && is_equal_type(x.type, y.type) && x.modifiers == y.modifiers &&
           is_equal_list(x.parameters, y.parameters, same_parameter);
  }

  CanonicalNames a_;
  CanonicalNames b_;
};

/// Structs, pods, namedarrays, objects: the order that counts is within a kind.
std::vector<const EntityDefinition*> entities_by_kind(const ServiceDefinition& definition) {
  std::vector<const EntityDefinition*> entities;
  for (const auto& item : definition.entities) entities.push_back(&item);
  std::stable_sort(entities.begin(), entities.end(), [](const auto* a, const auto* b) { return a->kind < b->kind; });
  return entities;
}

}  // namespace

bool is_equal(const ServiceDefinition& left, const ServiceDefinition& right) {
  const Comparison comparison(left, right);
  const auto same_entity = [&comparison](const auto* a, const auto* b) { return comparison.is_equal_entity(*a, *b); };
  return left.name == right.name && left.version == right.version &&
         is_equal_list(left.imports, right.imports, [](const auto& a, const auto& b) { return a.name == b.name; }) &&
         is_equal_list(
             left.usings, right.usings,
             [](const auto& a, const auto& b) { return a.qualified_name == b.qualified_name && a.alias == b.alias; }) &&
         is_equal_options(left.options, right.options) && is_equal_constants(left.constants, right.constants) &&
         is_equal_list(left.enums, right.enums, is_equal_enum) &&
         is_equal_list(left.exceptions, right.exceptions,
                       [](const auto& a, const auto& b) { return a.name == b.name; }) &&
         is_equal_list(entities_by_kind(left), entities_by_kind(right), same_entity);
}

}  // namespace rr::test
