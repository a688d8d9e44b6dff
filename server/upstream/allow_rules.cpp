#include "server/upstream/allow_rules.hpp"

#include <algorithm>
#include <optional>

#include "core/support/glob.hpp"

namespace rrgate {

namespace {

bool is_close(const rr::ConnectionUrl& url) {
  const auto address = rr::parse_url_address(url.host);
  return !address || address->is_link_local() || address->is_loopback();  // no address: a transport of this machine
}

bool matches_node(const DiscoverRule& rule, const rr::NodeDiscoveryInfo& node) {
  return (rule.node_name.empty() || rr::glob_matches(rule.node_name, node.node_name)) &&
         (rule.node_id.is_any() || rule.node_id == node.node_id);
}

void add_new(std::vector<rr::ConnectionUrl>& to, const std::vector<rr::ConnectionUrl>& urls) {
  for (const auto& url : urls)
    if (std::find(to.begin(), to.end(), url) == to.end()) to.push_back(url);
}

}  // namespace

Verdict judge(const std::vector<DiscoverRule>& rules, const rr::NodeDiscoveryInfo& node,
              const std::vector<rr::ServiceInfo>* services) {
  Verdict out;
  std::optional<std::vector<rr::ConnectionUrl>> all;
  for (const auto& rule : rules) {
    if (!matches_node(rule, node)) continue;
    if (!all) all = rr::candidate_urls(node);
    auto urls = *all;
    const bool is_narrow = !rule.node_name.empty() || !rule.node_id.is_any();
    if (!is_narrow) std::erase_if(urls, [](const auto& url) { return !is_close(url); });
    if (!rule.service_type.empty()) {
      add_new(out.urls_to_ask, urls);
      const auto is_wanted = [&](const rr::ServiceInfo& service) { return service.implements(rule.service_type); };
      if (urls.empty() || !services || std::none_of(services->begin(), services->end(), is_wanted)) continue;
    }
    out.is_allowed = true;
    add_new(out.device_urls, urls);
  }
  return out;
}

}  // namespace rrgate
