#include "server/config/lease_options.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "core/support/glob.hpp"
#include "core/support/hex.hpp"

namespace rrgate {

namespace {

void read_lease_rule(ObjectReader& in, LeaseRule& rule) {
  in.required_text("member", [&](const std::string& text) -> std::string {
    rule.member = text;
    return {};
  });
  std::string need = "covered";
  in.choice("lease", need, {"required", "covered", "never"});
  rule.need = need == "required" ? LeaseNeed::required : need == "never" ? LeaseNeed::never : LeaseNeed::covered;
}

void read_safe_action(ObjectReader& in, SafeAction& action) {
  std::size_t kinds = 0;
  const auto target = [&](const char* key, SafeAction::Kind kind) {
    std::string text;
    in.text(key, text);
    if (text.empty()) return;
    ++kinds;
    action.kind = kind;
    const auto dot = text.rfind('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == text.size())
      return in.finding(key, wrong_text(text, "path.member, as \"Create.Drive\""));
    action.path = text.substr(0, dot);
    action.member = text.substr(dot + 1);
  };
  target("call", SafeAction::Kind::call);
  target("wire", SafeAction::Kind::wire);
  target("property", SafeAction::Kind::property);
  if (kinds != 1) in.finding("call", "expected one of call, wire and property: what is safe to do");
  std::string arguments;
  std::string value;
  in.json("arguments", "array", arguments);
  in.json("value", "", value);
  const bool is_call = action.kind == SafeAction::Kind::call;
  if (is_call && !value.empty()) in.finding("value", "calls have arguments, an array");
  if (!is_call && !arguments.empty()) in.finding("arguments", "wires and properties have a value");
  if (!is_call && value.empty()) in.finding("value", "missing; expected what is safe to write");
  action.json = !is_call ? value : arguments.empty() ? "[]" : arguments;
}

/// "Create.arm[left%5fone].stop" as "Create.arm.left_one.stop", patterns too: an index has many spellings.
std::string dotted(std::string_view place) {
  std::string out;
  for (std::size_t i = 0; i < place.size(); ++i) {
    const auto c = place[i];
    if (const auto byte = c == '%' ? rr::hex_byte(place.substr(i + 1)) : -1; byte >= 0) {
      out += static_cast<char>(byte);
      i += 2;
    } else if (c != ']') {
      out += c == '[' ? '.' : c;
    }
  }
  return out;
}

}  // namespace

void read_leases(ObjectReader& in, LeaseConfig& leases) {
  leases.is_offered = true;
  in.objects("members", false, [&](ObjectReader& item) { read_lease_rule(item, leases.members.emplace_back()); });
  in.objects("safe", false, [&](ObjectReader& item) { read_safe_action(item, leases.safe.emplace_back()); });
  in.texts("takeover", false, [&](const std::string& text) -> std::string {
    leases.takeover.push_back(text);
    return text.empty() ? "empty; expected a role, or \"*\"" : "";
  });
}

LeaseNeed LeaseConfig::need_of(std::string_view member) const {
  const auto place = dotted(member);
  const auto rule = std::find_if(members.begin(), members.end(),
                                 [&](const auto& each) { return rr::glob_matches(dotted(each.member), place); });
  return rule == members.end() ? LeaseNeed::covered : rule->need;
}

bool LeaseConfig::is_urgent(std::string_view place) const {
  return is_offered && need_of(place) == LeaseNeed::never;
}

bool LeaseConfig::makes_safe(std::string_view place) const {
  const auto object = dotted(place);
  return is_offered && std::any_of(safe.begin(), safe.end(), [&](const SafeAction& action) {
           return rr::is_within(dotted(action.path), object);
         });
}

}  // namespace rrgate
