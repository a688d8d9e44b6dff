#include "server/access/access_rules.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <set>

#include "server/access/replay_name.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

Identity who(std::string name, std::vector<std::string> roles, Proof proof = Proof::password) {
  Identity out;
  out.name = std::move(name);
  out.roles = std::move(roles);
  out.proof = proof;
  return out;
}

// --- the naive model: every pattern is spelt out as the texts that it means ---

const std::vector<std::string> all_roles{"viewer", "operator", "admin"};
const std::vector<std::string> all_devices{"create", "arm1", "arm2"};
const std::vector<std::string> all_services{"Create", "Arm"};
const std::vector<std::string> all_paths{"Create", "Create.axes[0]", "Create.axes[1]", "Arm", "Arm.tool"};
const std::vector<std::string> all_members{"", "Drive", "DistanceTraveled", "packets"};

using Meanings = std::map<std::string, std::set<std::string>>;
const Meanings device_meanings{{"*", {"create", "arm1", "arm2"}}, {"arm?", {"arm1", "arm2"}}, {"create", {"create"}}};
const Meanings service_meanings{{"*", {"Create", "Arm"}}, {"Arm", {"Arm"}}, {"C*", {"Create"}}};
const Meanings path_meanings{{"**", {"Create", "Create.axes[0]", "Create.axes[1]", "Arm", "Arm.tool"}},
                             {"Create.*", {"Create.axes[0]", "Create.axes[1]"}},
                             {"*.axes[1]", {"Create.axes[1]"}},
                             {"Arm", {"Arm"}}};
/// Objects that are fitted, or on the way to others that are.
const Meanings path_leads{{"**", {"Create", "Create.axes[0]", "Create.axes[1]", "Arm", "Arm.tool"}},
                          {"Create.*", {"Create", "Create.axes[0]", "Create.axes[1]"}},
                          {"*.axes[1]", {"Create", "Create.axes[0]", "Create.axes[1]", "Arm", "Arm.tool"}},
                          {"Arm", {"Arm"}}};
const Meanings member_meanings{{"*", {"", "Drive", "DistanceTraveled", "packets"}},
                               {"D*", {"Drive", "DistanceTraveled"}},
                               {"packets", {"packets"}},
                               {"", {""}}};

bool means(const Meanings& meanings, const std::vector<std::string>& patterns, const std::string& text) {
  if (patterns.empty()) return true;
  for (const auto& pattern : patterns)
    if (meanings.at(pattern).contains(text)) return true;
  return false;
}

bool model_allows(const std::vector<AccessRule>& rules, const Identity& identity, const std::string& device,
                  const std::string& service, const std::string& path, const std::string& member, Verb verb) {
  for (const auto& rule : rules) {
    // Rules for agents are for them alone, and no others give them anything that moves a device.
    const bool is_command = verb == Verb::write || verb == Verb::call || verb == Verb::lock;
    if (identity.face == Face::mcp ? is_command && !rule.agent : rule.agent.has_value()) continue;
    bool is_for = false;
    for (const auto& role : rule.roles)
      is_for = is_for || (role == "*" && identity.is_proven()) ||
               std::set<std::string>(identity.roles.begin(), identity.roles.end()).contains(role);
    if (!is_for || !means(device_meanings, rule.devices, device) || !means(service_meanings, rule.services, service))
      continue;
    // Whoever may do anything to an object, or to one below it, may look at it.
    if (verb == Verb::read && member.empty()) {
      if (means(path_leads, rule.paths, path) && std::any_of(rule.may.begin(), rule.may.end(), is_device_verb))
        return true;
      continue;
    }
    if (!means(path_meanings, rule.paths, path)) continue;
    if (std::set<Verb>(rule.may.begin(), rule.may.end()).contains(verb) && means(member_meanings, rule.members, member))
      return true;
  }
  return false;
}

class RandomRules {
 public:
  explicit RandomRules(unsigned seed) : random_(seed) {}

  std::vector<AccessRule> rules() {
    std::vector<AccessRule> out(1 + pick(4));
    for (auto& rule : out) {
      rule.roles = some({"viewer", "operator", "admin", "*"});
      rule.devices = some(keys(device_meanings));
      rule.services = some(keys(service_meanings));
      rule.paths = some(keys(path_meanings));
      rule.members = some(keys(member_meanings));
      for (const auto verb : all_verbs)
        if (pick(2)) rule.may.push_back(verb);
      if (pick(2)) rule.agent.emplace();
    }
    return out;
  }
  Identity identity() {
    auto out = who("somebody", some(all_roles));
    if (pick(4) == 0) out.proof = Proof::none;
    if (pick(2)) out.face = Face::mcp;
    return out;
  }

 private:
  std::size_t pick(std::size_t below) { return random_() % below; }
  static std::vector<std::string> keys(const Meanings& meanings) {
    std::vector<std::string> out;
    for (const auto& [key, unused] : meanings) out.push_back(key);
    return out;
  }
  std::vector<std::string> some(const std::vector<std::string>& from) {
    std::vector<std::string> out;
    for (const auto& each : from)
      if (pick(3) == 0) out.push_back(each);
    return out;
  }

  std::mt19937 random_;
};

}  // namespace

TEST_CASE("rights: every verb, path and role, against a plain model of the rules") {
  std::size_t allowed = 0;
  std::size_t refused = 0;
  std::map<Extent, std::size_t> extents;
  for (unsigned seed = 0; seed < 400; ++seed) {
    INFO("seed " << seed);
    RandomRules random(seed);
    const auto list = random.rules();
    const AccessRules rules(list, true);
    const auto identity = random.identity();
    for (const auto& device : all_devices) {
      bool has_all = true;
      std::map<Verb, std::set<bool>> found;  // of members: whether some are allowed, and some not
      for (const auto& service : all_services)
        for (const auto& path : all_paths) {
          if (!path.starts_with(service)) continue;
          for (const auto& member : all_members)
            for (const auto verb : all_verbs) {
              const bool expected = model_allows(list, identity, device, service, path, member, verb);
              const auto checked = rules.check(identity, {device, service, path, member, verb});
              ++(expected ? allowed : refused);
              if (expected != checked.has_value()) {
                INFO(device << " " << service << " " << path << " " << member << " " << to_string(verb));
                REQUIRE(checked.has_value() == expected);
              }
              if (!checked) REQUIRE(checked.error().code == rr::ErrorCode::permission_denied);
              if (expected && is_device_verb(verb)) {
                REQUIRE(rules.sees(identity, device));
                REQUIRE(rules.sees(identity, device, service));
                REQUIRE(rules.sees(identity, device, service, path));
              }
              if (!member.empty()) found[verb].insert(expected);
              if (!expected && verb <= Verb::lock) has_all = false;  // a recording is the gateway's own
            }
        }
      // Bytes that nobody reads pass for those alone who could have done anything.
      if (rules.check_whole_device(identity, device)) REQUIRE(has_all);
      for (const auto verb : device_verbs) {
        const auto extent = rules.extent(identity, device, verb);
        INFO("extent of " << to_string(verb) << " on " << device << ": " << to_string(extent));
        if (extent == Extent::all) REQUIRE(found[verb] == std::set<bool>{true});
        if (extent == Extent::none) REQUIRE(found[verb] == std::set<bool>{false});
        ++extents[extent];
      }
    }
  }
  CHECK(allowed > 10'000);
  CHECK(refused > 10'000);
  for (const auto extent : {Extent::none, Extent::some, Extent::all}) CHECK(extents[extent] > 50);
}

TEST_CASE("rights: without rules those may everything who have proven who they are") {
  const AccessRequest request{"create", "Create", "Create", "Drive", Verb::call};
  CHECK(AccessRules().check(Identity{}, request));
  CHECK(AccessRules().is_open());
  const AccessRules rules({}, true);
  CHECK(rules.check(who("alice", {}), request));
  CHECK(rules.check_whole_device(who("alice", {}), "create"));
  CHECK_FALSE(rules.check(Identity{}, request));
  CHECK_FALSE(rules.check_whole_device(Identity{}, "create"));
  CHECK_FALSE(rules.sees(Identity{}, "create"));
  CHECK(AccessRules().sees_any(Identity{}));
  CHECK(rules.sees_any(who("alice", {})));
  CHECK_FALSE(rules.sees_any(Identity{}));
  CHECK(AccessRules().gives_any(Identity{}, Verb::record));
  CHECK(rules.gives_any(who("alice", {}), Verb::record));
  CHECK_FALSE(rules.gives_any(Identity{}, Verb::record));
}

TEST_CASE("agents: what moves a device is given by rules for agents alone, and those give nothing by any other face") {
  const AccessRequest drive{"create", "Create", "Create", "Drive", Verb::call};
  auto agent = who("mind", {"agent"});
  agent.face = Face::mcp;
  CHECK_FALSE(AccessRules().check(agent, drive));
  CHECK_FALSE(AccessRules({}, true).check(agent, drive));
  CHECK(AccessRules({}, true).check(agent, {"create", "Create", "Create", "DistanceTraveled", Verb::read}));
  CHECK_FALSE(AccessRules({}, true).check_whole_device(agent, "create"));
  const AccessRules ordinary({AccessRule{.roles = {"agent"}, .may = {Verb::read, Verb::write, Verb::call}}}, true);
  CHECK_FALSE(ordinary.check(agent, drive));
  CHECK_FALSE(ordinary.terms(agent, drive));

  const AccessRules rules(
      {AccessRule{.roles = {"agent"}, .members = {"Drive"}, .may = {Verb::call}, .agent = AgentTerms{}}}, true);
  CHECK(rules.check(agent, drive));
  REQUIRE(rules.terms(agent, drive));
  CHECK(rules.terms(agent, drive)->needs_approval);
  CHECK(rules.terms(agent, drive)->needs_lease);
  CHECK_FALSE(rules.check(agent, {"create", "Create", "Create", "Other", Verb::call}));
  for (const auto face : {Face::none, Face::native, Face::websocket, Face::rest, Face::stream, Face::json}) {
    agent.face = face;
    CHECK_FALSE(rules.check(agent, drive));
    CHECK_FALSE(rules.terms(agent, drive));
    CHECK_FALSE(rules.sees(agent, "create"));
    CHECK_FALSE(rules.check_whole_device(agent, "create"));
  }
}

TEST_CASE("agents: of several rules the terms hold together") {
  auto agent = who("mind", {"agent"});
  agent.face = Face::mcp;
  const AgentTerms wide{{{"v", {-500, 100}}}, false, false, std::chrono::seconds(9)};
  const AgentTerms narrow{{{"v", {-50, 300}}, {"w", {0, 1}}}, true, true, std::chrono::seconds(2)};
  std::vector<AccessRule> list{AccessRule{.roles = {"agent"}, .may = {Verb::call}, .agent = wide},
                               AccessRule{.roles = {"*"}, .may = {Verb::call}, .agent = narrow}};
  const AccessRules rules(list, true);
  std::reverse(list.begin(), list.end());
  const AccessRules reversed(list, true);
  const AgentTerms both{{{"v", {-50, 100}}, {"w", {0, 1}}}, true, true, std::chrono::seconds(2)};
  CHECK(rules.terms(agent, {"d", "s", "s", "m", Verb::call}) == both);
  CHECK(reversed.terms(agent, {"d", "s", "s", "m", Verb::call}) == both);
  CHECK(rules.terms(agent, {"d", "s", "s", "m", Verb::write}) == std::nullopt);
}

TEST_CASE("agents: what has a limit must be there, be a number, and lie within") {
  const auto passes = [](const std::string& place, const std::string& json) {
    const AgentTerms terms{.limits = {{place, {-2, 3}}}};
    return terms.check(rr::OrderedJson::parse(json)).has_value();
  };
  for (const auto* good :
       {R"({"v": -2})", R"({"v": 3, "w": 99})", R"({"v": 2.5})", R"({"v": [1, 2]})", R"({"v": [[1], [2]]})"})
    CHECK(passes("v", good));
  for (const auto* bad :
       {R"({})", R"({"v": 3.1})", R"({"v": -3})", R"({"v": null})", R"({"v": true})", R"({"v": "NaN"})",
        R"({"v": "Infinity"})", R"({"v": "3"})", R"({"v": " 3"})", R"({"v": "+3"})", R"({"v": "03"})",
        R"({"v": "1e0"})", R"({"v": ""})", R"({"v": []})", R"({"v": [1, 4]})", R"({"v": [1, []]})",
        R"({"v": {"v": 1}})", R"({"w": 1})", R"({"v": "18446744073709551616"})"})
    CHECK_FALSE(passes("v", bad));
  CHECK(passes("a.b", R"({"a": {"b": 1}})"));
  CHECK(passes("a.b", R"({"a": [{"b": 1}, {"b": 2}]})"));
  for (const auto* bad :
       {R"({"a": {"b": 4}})", R"({"a": [{"b": 1}, {}]})", R"({"a": 1})", R"({"a.b": 1})", R"({"a": []})"})
    CHECK_FALSE(passes("a.b", bad));
  const AgentTerms terms{.limits = {{"v", {-2, 3}}}};
  CHECK_THAT(terms.check(rr::OrderedJson::object()).error().message,
             Catch::Contains("'v' has to be a number from -2.0 to 3.0"));
}

TEST_CASE("rights: a refusal says who may not do what") {
  const AccessRules rules({AccessRule{.roles = {"viewer"}, .may = {Verb::read}}}, true);
  const AccessRequest request{"create", "Create", "Create.axes[0]", "speed", Verb::write};
  CHECK(rules.check(who("alice", {"viewer", "guest"}), request).error().message ==
        "'alice' (viewer, guest) may not write 'speed' of 'Create.axes[0]' on device 'create'");
  CHECK(rules.check(Identity{}, request).error().message ==
        "who is not logged in may not write 'speed' of 'Create.axes[0]' on device 'create'");
  CHECK(rules.check(who("bob", {}), {.verb = Verb::admin}).error().message ==
        "'bob' (no roles) may not manage the gateway");
  CHECK_THAT(rules.check_whole_device(who("alice", {"viewer"}), "create").error().message,
             Catch::Contains(R"("mode": "shared")"));
}

TEST_CASE("rights: all of a device is what rules give that name no service, path or member") {
  const auto all = std::vector<Verb>(std::begin(device_verbs), std::end(device_verbs));
  const auto has = [&](AccessRule rule) {
    rule.roles = {"r"};
    return AccessRules({std::move(rule)}, true).check_whole_device(who("a", {"r"}), "arm1").has_value();
  };
  CHECK(has({.may = all}));
  CHECK(has({.devices = {"arm*"}, .services = {"*"}, .paths = {"**"}, .members = {"*"}, .may = all}));
  CHECK_FALSE(has({.devices = {"create"}, .may = all}));
  CHECK_FALSE(has({.services = {"Arm"}, .may = all}));
  CHECK_FALSE(has({.paths = {"Arm*"}, .may = all}));
  CHECK_FALSE(has({.members = {"?*"}, .may = all}));
  CHECK_FALSE(has({.may = {Verb::read, Verb::write, Verb::call, Verb::subscribe}}));
  // Two rules together may give it.
  CHECK(AccessRules({AccessRule{.roles = {"a"}, .may = {Verb::read, Verb::subscribe}},
                     AccessRule{.roles = {"b"}, .may = {Verb::write, Verb::call, Verb::lock}}},
                    true)
            .check_whole_device(who("x", {"a", "b"}), "arm1"));
}

TEST_CASE("rights: how much of a device somebody may do something to") {
  const auto extent = [&](AccessRule rule, Verb verb = Verb::call) {
    rule.roles = {"r"};
    return to_string(AccessRules({std::move(rule)}, true).extent(who("a", {"r"}), "arm1", verb));
  };
  const std::vector<Verb> call{Verb::call}, record{Verb::record};
  CHECK(extent({.may = call}) == "all");
  CHECK(extent({.devices = {"arm*"}, .services = {"*"}, .paths = {"**"}, .members = {"*"}, .may = call}) == "all");
  CHECK(extent({.services = {"Arm"}, .may = call}) == "some");
  CHECK(extent({.paths = {"Arm.tool"}, .may = call}) == "some");
  CHECK(extent({.members = {"Drive"}, .may = call}) == "some");
  CHECK(extent({.devices = {"create"}, .may = call}) == "none");
  CHECK(extent({.may = call}, Verb::write) == "none");
  CHECK(extent({.may = call, .agent = AgentTerms{}}) == "none");  // for agents alone
  // Recordings are of whole services: a rule about less gives none.
  CHECK(extent({.may = record}, Verb::record) == "all");
  CHECK(extent({.services = {"Arm"}, .may = record}, Verb::record) == "some");
  CHECK(extent({.paths = {"Arm.tool"}, .may = record}, Verb::record) == "none");
  CHECK(extent({.members = {"Drive"}, .may = record}, Verb::record) == "none");
  // Two rules that together give it on everything.
  const AccessRules halves({AccessRule{.roles = {"r"}, .services = {"Arm"}, .may = call},
                            AccessRule{.roles = {"r"}, .services = {"Create"}, .may = call}},
                           true);
  CHECK(halves.extent(who("a", {"r"}), "arm1", Verb::call) == Extent::some);
  // Without rules.
  CHECK(AccessRules().extent(Identity{}, "arm1", Verb::call) == Extent::all);
  CHECK(AccessRules({}, true).extent(Identity{}, "arm1", Verb::call) == Extent::none);
  CHECK(AccessRules({}, true).extent(who("a", {}), "arm1", Verb::call) == Extent::all);
  auto agent = who("a", {});
  agent.face = Face::mcp;
  CHECK(AccessRules({}, true).extent(agent, "arm1", Verb::call) == Extent::none);
  CHECK(AccessRules({}, true).extent(agent, "arm1", Verb::read) == Extent::all);
}

TEST_CASE("rights: who may command something of an object, or of one below it") {
  const auto may = [](AccessRule rule, std::string_view path, Face face = Face::rest) {
    rule.roles = {"operator"};
    auto olga = who("olga", {"operator"});
    olga.face = face;
    const AccessRequest object{.device = "create", .service = "Create", .path = path};
    return AccessRules({std::move(rule)}, true).may_command(olga, object);
  };
  CHECK(may({.may = {Verb::write}}, "Create"));
  CHECK(may({.members = {"Drive"}, .may = {Verb::call}}, "Create"));
  CHECK_FALSE(may({.may = {Verb::read, Verb::subscribe, Verb::lock}}, "Create"));
  CHECK(may({.paths = {"Create.axes*"}, .may = {Verb::call}}, "Create"));
  CHECK_FALSE(may({.paths = {"Create"}, .may = {Verb::call}}, "Create.axes[0]"));
  CHECK_FALSE(may({.devices = {"arm1"}, .may = {Verb::call}}, "Create"));
  CHECK_FALSE(may({.services = {"Arm"}, .may = {Verb::call}}, "Create"));
  CHECK_FALSE(may({.may = {Verb::call}}, "Create", Face::mcp));
  CHECK(may({.may = {Verb::call}, .agent = AgentTerms()}, "Create", Face::mcp));
  const AccessRequest object{.device = "create", .service = "Create", .path = "Create"};
  CHECK(AccessRules().may_command(who("", {}, Proof::none), object));
}

TEST_CASE("rights: a device is seen by those who may do something with it, and by no one else") {
  const std::vector<AccessRule> list{
      AccessRule{
          .roles = {"viewer"}, .devices = {"arm*"}, .services = {"Arm"}, .paths = {"Arm.tool"}, .may = {Verb::read}},
      AccessRule{.roles = {"operator"}, .devices = {"create"}, .may = {Verb::call}},
      AccessRule{.roles = {"watcher"}, .may = {Verb::metrics}}};
  const AccessRules rules(list, true);
  const auto viewer = who("vera", {"viewer"}), oper = who("oscar", {"operator"}), watcher = who("wendy", {"watcher"});
  CHECK(rules.sees(viewer, "arm1"));
  CHECK_FALSE(rules.sees(viewer, "create"));
  CHECK(rules.sees(oper, "create"));
  CHECK_FALSE(rules.sees(oper, "arm1"));
  CHECK_FALSE(rules.sees(watcher, "arm1"));  // what he may is of no device
  CHECK_FALSE(rules.sees(who("stranger", {}), "arm1"));
  CHECK_FALSE(rules.sees(Identity{}, "create"));
  CHECK(rules.sees_any(viewer));
  CHECK_FALSE(rules.sees_any(watcher));
  CHECK_FALSE(rules.sees_any(who("stranger", {})));
  CHECK(rules.gives_any(viewer, Verb::read));
  CHECK_FALSE(rules.gives_any(viewer, Verb::call));
  CHECK(rules.gives_any(watcher, Verb::metrics));
  CHECK_FALSE(rules.gives_any(who("stranger", {}), Verb::read));
  CHECK(rules.sees(viewer, "arm1", "Arm"));
  CHECK_FALSE(rules.sees(viewer, "arm1", "Create"));
  CHECK_FALSE(rules.sees(viewer, "create", "Arm"));
  CHECK(rules.sees(viewer, "arm1", "Arm", "Arm.tool"));
  CHECK(rules.sees(viewer, "arm1", "Arm", "Arm"));  // the way to the tool
  CHECK_FALSE(rules.sees(viewer, "arm1", "Arm", "Arm.tools"));
  CHECK_FALSE(rules.sees(viewer, "arm1", "Arm", "Arm.axes[0]"));
  CHECK_FALSE(rules.sees(oper, "arm1", "Arm", "Arm.tool"));
}

TEST_CASE("rights: what the gateway's own service tells of all devices is for those who see all of them") {
  const AccessRules rules(
      {{.roles = {"partner"}, .devices = {"gateway", "arm1"}, .may = {Verb::read, Verb::call, Verb::subscribe}},
       {.roles = {"viewer"}, .devices = {"gateway", "*"}, .may = {Verb::read, Verb::subscribe}},
       {.roles = {"guide"}, .devices = {"*"}, .paths = {"Arm"}, .may = {Verb::read}}},
      true);
  const auto may = [&](const char* role, const char* member, Verb verb = Verb::read) {
    return rules
        .check(who("somebody", {role}),
               {.device = "gateway", .service = "gateway", .path = "gateway", .member = member, .verb = verb})
        .has_value();
  };
  for (const char* member : {"devices", "subscriptions", "locks", "leases"}) {
    CHECK(may("viewer", member));
    CHECK_FALSE(may("partner", member));
    CHECK_FALSE(may("guide", member));
  }
  CHECK_FALSE(may("partner", "find_device", Verb::call));
  for (const char* member : {"statistics", "device_changed", "device_removed", "lease_changed"}) {
    CHECK(may("viewer", member, Verb::subscribe));
    CHECK_FALSE(may("partner", member, Verb::subscribe));
  }
  CHECK(may("partner", "version"));
  CHECK(may("partner", "acquire_lease", Verb::call));
  CHECK(AccessRules().check(who("", {}), {.device = "gateway", .member = "devices"}).has_value());
}

TEST_CASE("rights to record are to whole services") {
  const auto alice = who("alice", {"operator"});
  const auto allows = [&](AccessRule rule, std::string_view device, std::string_view service) {
    rule.roles = {"operator"};
    return AccessRules({rule}, true)
        .check(alice, {.device = device, .service = service, .verb = Verb::record})
        .has_value();
  };
  AccessRule rule;
  rule.may = {Verb::record};
  rule.devices = {"arm"};
  rule.services = {"A*"};
  CHECK(allows(rule, "arm", "Arm"));
  CHECK(!allows(rule, "arm", "Tool"));
  CHECK(!allows(rule, "base", "Arm"));
  auto narrow = rule;
  narrow.members = {"pose"};
  CHECK(!allows(narrow, "arm", "Arm"));
  narrow = rule;
  narrow.paths = {"Arm.axes*"};
  CHECK(!allows(narrow, "arm", "Arm"));
  rule.may = {Verb::read, Verb::subscribe};
  CHECK(!allows(rule, "arm", "Arm"));
}

TEST_CASE("verbs by name") {
  for (const auto verb : all_verbs) CHECK(parse_verb(to_string(verb)) == verb);
  CHECK_FALSE(parse_verb("execute"));
  CHECK_FALSE(parse_verb(""));
}

TEST_CASE(
    "rights: what plays a recording is used by the rights to what was recorded, and controlled by those who may "
    "record") {
  const std::string replay = "replay~lab.arm.Arm.20261125T083000123Z";
  const auto viewer = who("vera", {"viewer"});
  const auto operators = who("alice", {"operator"});
  const auto stranger = who("eve", {"other"});
  AccessRule look;
  look.roles = {"viewer", "operator"};
  look.devices = {"lab.arm"};
  look.paths = {"Arm.axes*"};
  look.may = {Verb::read, Verb::subscribe};
  AccessRule record;
  record.roles = {"operator"};
  record.devices = {"lab.arm"};
  record.services = {"Arm"};
  record.may = {Verb::record};
  AccessRule elsewhere;  // its name is no reason
  elsewhere.roles = {"other"};
  elsewhere.devices = {"replay*", "lab", "arm"};
  elsewhere.may = {Verb::read, Verb::subscribe, Verb::call, Verb::record};
  AccessRule agents = elsewhere;
  agents.roles = {"operator"};
  agents.devices = {"*"};
  agents.agent = AgentTerms{};
  const AccessRules rules({look, record, elsewhere, agents}, true);

  const auto may = [&](const Identity& who_asks, std::string_view service, std::string_view path, Verb verb) {
    return rules.check(who_asks, {.device = replay, .service = service, .path = path, .member = "x", .verb = verb})
        .has_value();
  };
  CHECK(may(viewer, "Arm", "Arm.axes[1]", Verb::subscribe));
  CHECK_FALSE(may(viewer, "Arm", "Arm", Verb::subscribe));
  CHECK_FALSE(may(viewer, "Arm", "Arm.axes[1]", Verb::call));
  for (const auto verb : {Verb::read, Verb::write, Verb::call, Verb::subscribe, Verb::lock}) {
    CHECK(may(operators, "replay", "replay", verb));
    CHECK_FALSE(may(viewer, "replay", "replay", verb));
    CHECK_FALSE(may(stranger, "replay", "replay", verb));
    CHECK_FALSE(may(stranger, "Arm", "Arm.axes[1]", verb));
  }
  CHECK(rules.sees(viewer, replay));
  CHECK(rules.sees(viewer, replay, "Arm"));
  CHECK_FALSE(rules.sees(viewer, replay, "replay"));
  CHECK(rules.sees(operators, replay, "replay"));
  CHECK_FALSE(rules.sees(stranger, replay));
  CHECK_FALSE(rules.check(stranger, {.device = replay}));
  CHECK(rules.extent(viewer, replay, Verb::read) == Extent::some);
  CHECK(rules.extent(stranger, replay, Verb::read) == Extent::none);

  auto agent = operators;
  agent.face = Face::mcp;
  const AccessRequest seek{
      .device = replay, .service = "replay", .path = "replay", .member = "seek", .verb = Verb::call};
  CHECK_FALSE(rules.terms(agent, seek));
  CHECK_FALSE(rules.check(agent, seek));

  AccessRule all;
  all.roles = {"viewer"};
  all.devices = {"lab.arm"};
  all.may.assign(std::begin(device_verbs), std::end(device_verbs));
  CHECK(AccessRules({all}, true).extent(viewer, "lab.arm", Verb::call) == Extent::all);
  CHECK(AccessRules({all}, true).extent(viewer, replay, Verb::call) == Extent::some);
  all.may.push_back(Verb::record);
  CHECK(AccessRules({all}, true).extent(viewer, replay, Verb::call) == Extent::all);
}

TEST_CASE("the name of a device that plays a recording says what was recorded") {
  const auto name = replay_name("lab.arm.Arm.20261125T083000123Z-2");
  const auto played = played_by(name);
  REQUIRE(played);
  CHECK(played->device == "lab.arm");
  CHECK(played->service == "Arm");
  CHECK_FALSE(played_by("lab.arm.Arm.20261125T083000123Z"));
  CHECK(played_by("replay~x")->service.empty());
}
