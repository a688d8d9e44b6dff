// Which of the services that are found a subscription wants. Layer: node/subscribe. Source: sessions spec
// section 2.17.
#pragma once

#include <functional>
#include <map>
#include <regex>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "node/discovery/service_query.hpp"

namespace rr {

/// A node, and how to log in there.
struct ServiceSubscriptionFilterNode {
  NodeId node_id = {};         ///< any: by the name alone
  std::string node_name = {};  ///< '*' stands for any characters, '?' for one; empty: by the id alone
  std::string username = {};   ///< empty: as the subscription's options say
  Value credentials = {};
};

enum class ServiceSubscriptionFilterOperation : std::uint8_t { or_of, and_of, nor_of, nand_of };

/// A text that an attribute may have: exactly, or as a whole by a regular expression (at most 1024 characters of text).
struct ServiceSubscriptionFilterAttribute {
  ServiceSubscriptionFilterAttribute(std::string exactly) : text(std::move(exactly)) {}
  ServiceSubscriptionFilterAttribute(const char* exactly) : text(std::string(exactly)) {}
  ServiceSubscriptionFilterAttribute(std::regex expression) : text(std::move(expression)) {}

  std::string name = {};  ///< of attributes that are maps: the key; empty: any
  std::variant<std::string, std::regex> text;
};

/// What the texts of one attribute must be together. An attribute is a text, which is split, or a list or a map of
/// texts, which are not; one that is not there has none. A group without conditions takes all, but none by nor_of and
/// nand_of.
struct ServiceSubscriptionFilterAttributeGroup {
  ServiceSubscriptionFilterOperation operation = ServiceSubscriptionFilterOperation::or_of;
  std::vector<ServiceSubscriptionFilterAttribute> attributes = {};
  std::vector<ServiceSubscriptionFilterAttributeGroup> groups = {};
  char split_at = ',';  ///< 0: texts are not split
};

/// All conditions that are given must hold; none is given at first.
struct ServiceSubscriptionFilter {
  std::vector<ServiceSubscriptionFilterNode> nodes = {};  ///< one of them; the first also says how to log in
  std::vector<std::string> service_names = {};            ///< one of them
  std::vector<std::string> transport_schemes = {};        ///< "rr+tcp", ...: URLs that will do
  std::map<std::string, ServiceSubscriptionFilterAttributeGroup> attributes = {};  ///< by the name of the attribute
  ServiceSubscriptionFilterOperation attributes_operation = ServiceSubscriptionFilterOperation::and_of;
  std::function<bool(const ServiceInfo& service)> predicate = {};

  /// The entry of `nodes` that a node falls under; null where there is none, or none is needed: see takes_node().
  const ServiceSubscriptionFilterNode* find_node(const NodeIdentity& node) const;
  bool takes_node(const NodeIdentity& node) const { return nodes.empty() || find_node(node); }
  /// All but the schemes, which are a matter of URLs.
  bool takes(const ServiceInfo& service) const;
};

}  // namespace rr
