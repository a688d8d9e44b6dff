#include "node/subscribe/service_subscription_filter.hpp"

#include <algorithm>
#include <optional>

#include "core/support/glob.hpp"

namespace rr {

namespace {

using Operation = ServiceSubscriptionFilterOperation;
using Group = ServiceSubscriptionFilterAttributeGroup;

/// std::regex recurses: what others wrote must not decide how deep.
constexpr std::size_t max_matched_size = 1024;

/// Key, empty where there is none, and text.
using Texts = std::vector<std::pair<std::string, std::string>>;

/// What an attribute is matched by: one text, which groups split, or those of a list or a map, which stay whole.
struct AttributeTexts {
  Texts texts;
  bool is_one = false;
};

void add_text(Texts& to, const std::string& key, const Value& value) {
  if (const auto text = value.to_text()) to.emplace_back(key, *text);
}

AttributeTexts texts_of(const MapString& attributes, std::string_view name) {
  AttributeTexts out;
  for (const auto& [key, value] : attributes.items) {
    if (key != name) continue;
    if (const auto* list = value.get_if<List>())
      for (const auto& item : list->items) add_text(out.texts, {}, item);
    else if (const auto* numbered = value.get_if<MapInt32>())
      for (const auto& [number, item] : numbered->items) add_text(out.texts, {}, item);
    else if (const auto* named = value.get_if<MapString>())
      for (const auto& [item_key, item] : named->items) add_text(out.texts, item_key, item);
    else
      add_text(out.texts, {}, value);
    out.is_one = static_cast<bool>(value.to_text());
  }
  return out;
}

Texts split(const AttributeTexts& attribute, char at) {
  if (at == 0 || !attribute.is_one) return attribute.texts;
  Texts out;
  for (const auto& [key, text] : attribute.texts) {
    std::size_t begin = 0;
    for (auto end = text.find(at); end != std::string::npos; begin = end + 1, end = text.find(at, begin))
      out.emplace_back(key, text.substr(begin, end - begin));
    out.emplace_back(key, text.substr(begin));
  }
  return out;
}

bool matches(const ServiceSubscriptionFilterAttribute& wanted, const std::string& key, const std::string& text) {
  if (!wanted.name.empty() && wanted.name != key) return false;
  if (const auto* exactly = std::get_if<std::string>(&wanted.text)) return text == *exactly;
  return text.size() <= max_matched_size && std::regex_match(text, std::get<std::regex>(wanted.text));
}

/// Over any number of conditions. "any" and "all" of none hold, so that "not any" and "not all" of none don't.
class Combined {
 public:
  explicit Combined(Operation operation) : operation_(operation) {}
  void add(bool holds) {
    any_ = any_.value_or(false) || holds;
    all_ = all_ && holds;
  }
  bool result() const {
    switch (operation_) {
      case Operation::or_of:
        return any_.value_or(true);
      case Operation::and_of:
        return all_;
      case Operation::nor_of:
        return !any_.value_or(true);
      case Operation::nand_of:
        return !all_;
    }
    return false;
  }

 private:
  Operation operation_;
  std::optional<bool> any_;
  bool all_ = true;
};

bool holds(const Group& group, const AttributeTexts& attribute) {
  const auto texts = split(attribute, group.split_at);
  Combined combined(group.operation);
  for (const auto& wanted : group.attributes)
    combined.add(std::any_of(texts.begin(), texts.end(),
                             [&](const auto& each) { return matches(wanted, each.first, each.second); }));
  for (const auto& inner : group.groups) combined.add(holds(inner, attribute));
  return combined.result();
}

}  // namespace

const ServiceSubscriptionFilterNode* ServiceSubscriptionFilter::find_node(const NodeIdentity& node) const {
  const auto found = std::find_if(nodes.begin(), nodes.end(), [&](const ServiceSubscriptionFilterNode& each) {
    return (each.node_id.is_any() || each.node_id == node.id) &&
           (each.node_name.empty() || glob_matches(each.node_name, node.name));
  });
  return found == nodes.end() ? nullptr : &*found;
}

bool ServiceSubscriptionFilter::takes(const ServiceInfo& service) const {
  if (!takes_node(service.node)) return false;
  if (!service_names.empty() &&
      std::find(service_names.begin(), service_names.end(), service.name) == service_names.end())
    return false;
  Combined combined(attributes_operation);
  for (const auto& [name, group] : attributes) combined.add(holds(group, texts_of(service.attributes, name)));
  return (attributes.empty() || combined.result()) && (!predicate || predicate(service));
}

}  // namespace rr
