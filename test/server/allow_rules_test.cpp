#include "server/upstream/allow_rules.hpp"

#include <catch2/catch.hpp>

#include "core/support/glob.hpp"

using namespace rrgate;

namespace {

const rr::NodeId id{{1, 2, 3}};

rr::NodeDiscoveryInfo node_at(const std::vector<std::string>& addresses, const std::string& name = "lab.arm") {
  rr::NodeDiscoveryInfo node{id, name, {}, "nonce"};
  for (const auto& address : addresses)
    node.urls.push_back({"rr+tcp://" + address + "/?nodeid=" + rr::format_node_id(id, rr::NodeIdFormat::dashes) +
                             "&service=RobotRaconteurServiceIndex",
                         {}});
  return node;
}

std::string hosts(const std::vector<rr::ConnectionUrl>& urls) {
  std::string out;
  for (const auto& url : urls) out += (out.empty() ? "" : " ") + url.host;
  return out;
}

std::vector<rr::ServiceInfo> services_of(const std::string& type, const std::string& base = {}) {
  rr::ServiceInfo info;
  info.root_object_type = type;
  if (!base.empty()) info.root_object_implements.push_back(base);
  return {info};
}

}  // namespace

TEST_CASE("globs") {
  CHECK(rr::glob_matches("*", ""));
  CHECK(rr::glob_matches("lab.*", "lab.arm"));
  CHECK_FALSE(rr::glob_matches("lab.*", "xlab.arm"));
  CHECK_FALSE(rr::glob_matches("lab.*", "lab"));
  CHECK(rr::glob_matches("*.arm?", "lab.left.arm2"));
  CHECK_FALSE(rr::glob_matches("*.arm?", "lab.left.arm"));
  CHECK(rr::glob_matches("a*b*c", "aXbXbXc"));
  CHECK_FALSE(rr::glob_matches("a*b*c", "aXbXbX"));
  CHECK_FALSE(rr::glob_matches("", "a"));
  CHECK_FALSE(rr::glob_matches("Lab", "lab"));
  CHECK_FALSE(rr::glob_matches("*a*a*a*a*a*a*a*a*b", std::string(128, 'a')));
}

TEST_CASE("without a rule nobody is allowed, and nobody is asked") {
  const auto verdict = judge({}, node_at({"[fe80::1%eth0]:1"}), nullptr);
  CHECK_FALSE(verdict.is_allowed);
  CHECK(verdict.device_urls.empty());
  CHECK(verdict.urls_to_ask.empty());
}

TEST_CASE("a rule by name or id allows the node at all its URLs, unasked") {
  const auto node = node_at({"[fe80::1%eth0]:1", "10.0.0.1:1"});
  for (const auto& rule : {DiscoverRule{"lab.*", {}, ""}, DiscoverRule{"", id, ""}, DiscoverRule{"*", id, ""}}) {
    const auto verdict = judge({rule}, node, nullptr);
    CHECK(verdict.is_allowed);
    CHECK(hosts(verdict.device_urls) == "fe80::1%eth0 10.0.0.1");
    CHECK(verdict.urls_to_ask.empty());
  }
  for (const auto& rule :
       {DiscoverRule{"home.*", {}, ""}, DiscoverRule{"", rr::NodeId{{9}}, ""}, DiscoverRule{"home.*", id, ""}})
    CHECK_FALSE(judge({rule}, node, nullptr).is_allowed);
}

TEST_CASE("a rule by service type alone asks and connects on the link only") {
  const auto node = node_at({"[fe80::1%eth0]:1", "10.0.0.1:1", "127.0.0.1:1", "169.254.1.1:1"});
  const std::vector<DiscoverRule> rules{{"", {}, "com.x.Arm"}};
  auto verdict = judge(rules, node, nullptr);
  CHECK_FALSE(verdict.is_allowed);
  CHECK(hosts(verdict.urls_to_ask) == "fe80::1%eth0 127.0.0.1 169.254.1.1");
  const auto other = services_of("com.x.Hand");
  CHECK_FALSE(judge(rules, node, &other).is_allowed);
  for (const auto& wanted : {services_of("com.x.Arm"), services_of("com.x.BigArm", "com.x.Arm")}) {
    verdict = judge(rules, node, &wanted);
    CHECK(verdict.is_allowed);
    CHECK(hosts(verdict.device_urls) == "fe80::1%eth0 127.0.0.1 169.254.1.1");
  }
  const auto wanted = services_of("com.x.Arm");
  CHECK_FALSE(judge(rules, node_at({"10.0.0.1:1"}), &wanted).is_allowed);
  CHECK(judge(rules, node_at({"10.0.0.1:1"}), nullptr).urls_to_ask.empty());
}

TEST_CASE("a rule by name and service type asks anywhere, but only who has the name") {
  const std::vector<DiscoverRule> rules{{"lab.*", {}, "com.x.Arm"}};
  CHECK(hosts(judge(rules, node_at({"10.0.0.1:1"}), nullptr).urls_to_ask) == "10.0.0.1");
  CHECK(judge(rules, node_at({"10.0.0.1:1"}, "home.arm"), nullptr).urls_to_ask.empty());
}

TEST_CASE("a node without a URL that can be dialed is allowed, but is no device") {
  auto node = node_at({});
  node.urls.push_back({"rr+pci:///?nodeid=01020300-0000-0000-0000-000000000000&service=x", {}});
  node.urls.back().url = "rr+bluetooth:///?nodeid=01020300-0000-0000-0000-000000000000&service=x";
  const auto verdict = judge({{"*", {}, ""}}, node, nullptr);
  CHECK(verdict.is_allowed);
  CHECK(verdict.device_urls.empty());
}
