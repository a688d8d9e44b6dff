#include "server/mcp/mcp_describe.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "core/support/utf8.hpp"
#include "core/support/whole_number.hpp"
#include "server/access/replay_name.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

namespace {

constexpr std::size_t page_items = 50;

void add_text(rr::OrderedJson& out, const std::string& documentation) {
  if (!documentation.empty()) rr::add_key(out, from_device) = bounded_text(plain_documentation(documentation));
}

rr::OrderedJson terms_for_agent(const AgentTerms& terms) {
  auto limits = rr::OrderedJson::object();
  for (const auto& [place, range] : terms.limits) rr::add_key(limits, place) = {range.least, range.most};
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "limits") = std::move(limits);
  rr::add_key(out, "approval") = terms.needs_approval ? "ask" : "none";
  rr::add_key(out, "lease") = terms.needs_lease;
  if (terms.needs_lease) rr::add_key(out, "hold_seconds") = terms.hold.count();
  return out;
}

rr::OrderedJson describe_member(const Target& target, const rr::MemberDefinition& member, const AccessRules& rules,
                                const Identity& who) {
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "name") = member.name;
  rr::add_key(out, "kind") = std::string(member_kind_name(member.kind));
  rr::add_key(out, "type") = format_type(member.type);
  auto may = rr::OrderedJson::array();
  std::optional<AgentTerms> terms;
  for (const auto verb : uses_of(member)) {
    auto wanted = access_request(target, verb);
    wanted.member = member.name;
    if (!rules.check(who, wanted)) continue;
    may.push_back(std::string(to_string(verb)));
    if (auto of_verb = rules.terms(who, wanted)) terms = std::move(of_verb);
  }
  rr::add_key(out, "may") = std::move(may);
  if (terms) rr::add_key(out, "terms") = terms_for_agent(*terms);
  const bool has_parameters = member.kind == rr::MemberKind::function || member.kind == rr::MemberKind::event ||
                              member.kind == rr::MemberKind::callback;
  if (has_parameters) rr::add_key(out, "parameters") = rr::arguments_schema(member);
  if (member.kind == rr::MemberKind::objref)
    rr::add_key(out, "object") = true;  // its path leads on
  else if (member.kind != rr::MemberKind::event)
    rr::add_key(out, has_parameters ? "returns" : "value") = rr::type_schema(member.type);
  add_text(out, member.documentation);
  return out;
}

void note_marked(rr::OrderedJson& schema, const std::string& documentation) {
  add_text(schema, documentation);
}

/// The names of "#/components/schemas/NAME" that a schema refers to.
void collect_references(const rr::OrderedJson& schema, std::vector<std::string>& out) {
  constexpr std::string_view prefix = "#/components/schemas/";
  if (schema.is_array())
    for (const auto& item : schema) collect_references(item, out);
  if (!schema.is_object()) return;
  for (const auto& [key, value] : schema.items()) {
    if (key == "$ref" && value.is_string())
      out.push_back(value.get_ref<const std::string&>().substr(prefix.size()));
    else
      collect_references(value, out);
  }
}

/// All types that the schemas in `members` name, and those that these name.
rr::OrderedJson named_types(const rr::OrderedJson& members, const rr::TypeRegistry& types) {
  auto out = rr::OrderedJson::object();
  std::set<std::string> known;
  std::vector<std::string> wanted;
  collect_references(members, wanted);
  while (!wanted.empty()) {
    const auto name = std::move(wanted.back());
    wanted.pop_back();
    if (!known.insert(name).second) continue;
    auto schema = rr::named_type_schema(types, name, note_marked);
    if (!schema) continue;
    collect_references(*schema, wanted);
    rr::add_key(out, name) = std::move(*schema);
  }
  return out;
}

}  // namespace

std::vector<Verb> uses_of(const rr::MemberDefinition& member) {
  std::vector<Verb> out;
  switch (member.kind) {
    case rr::MemberKind::property:
    case rr::MemberKind::wire:
    case rr::MemberKind::memory:
      if (member.direction() != rr::MemberDirection::writeonly) out.push_back(Verb::read);
      if (member.kind == rr::MemberKind::wire && member.direction() != rr::MemberDirection::writeonly)
        out.push_back(Verb::subscribe);
      if (member.kind == rr::MemberKind::property && member.direction() != rr::MemberDirection::readonly)
        out.push_back(Verb::write);
      break;
    case rr::MemberKind::event:
    case rr::MemberKind::pipe:
      out.push_back(Verb::subscribe);
      break;
    case rr::MemberKind::function:
      if (!member.step_parameter()) out.push_back(Verb::call);
      break;
    default:
      break;
  }
  return out;
}

std::string bounded_text(std::string_view text, std::size_t most) {
  constexpr std::string_view replacement = "\xEF\xBF\xBD";  // U+FFFD, for each byte that is no character's
  std::string out;
  while (!text.empty()) {
    const auto size = rr::utf8_character_size(text);
    const auto character = size == 0 ? replacement : text.substr(0, size);
    if (out.size() + character.size() > most) return out + " ... (" + std::to_string(text.size()) + " bytes more)";
    out += character;
    text.remove_prefix(std::max<std::size_t>(1, size));
  }
  return out;
}

McpPage page_of(std::size_t count, const std::string& cursor) {
  McpPage out;
  const auto first = cursor.empty() ? std::optional<std::size_t>(0) : rr::whole_number<std::size_t>(cursor);
  if (!first || *first > count)
    refuse(rr::ErrorCode::invalid_argument, "cursor is " + rr::quote(cursor) + ", expected the nextCursor of a list");
  out.first = *first;
  out.last = std::min(count, out.first + page_items);
  if (out.last < count) out.next = std::to_string(out.last);
  return out;
}

rr::OrderedJson device_for_agent(GatewayState& gateway, const Identity& who, const Device& device) {
  auto out = rr::OrderedJson::object();
  const auto& name = device.config().name;
  rr::add_key(out, "name") = name;
  rr::add_key(out, "state") = std::string(to_string(device.state()));
  rr::add_key(out, "mode") = device.is_shared() ? "shared" : "relay";
  if (is_replay(name)) rr::add_key(out, "plays_recording") = true;
  auto said = rr::OrderedJson::object();
  auto services = rr::OrderedJson::array();
  if (!device.last_error().empty()) rr::add_key(said, "last_error") = bounded_text(device.last_error());
  if (const auto& identity = device.identity()) {
    rr::add_key(said, "node_name") = bounded_text(identity->node_name);
    for (const auto& service : identity->services)
      if (gateway.access().sees(who, name, service.name))
        services.push_back({{"path", bounded_text(service.name)}, {"type", bounded_text(service.type)}});
  }
  rr::add_key(said, "services") = std::move(services);
  rr::add_key(out, from_device) = std::move(said);
  return out;
}

std::vector<const Device*> devices_for_agent(GatewayState& gateway, const Identity& who) {
  std::vector<const Device*> out;
  for (const auto& device : gateway.devices().all())
    if (gateway.access().sees(who, device->config().name)) out.push_back(device.get());
  return out;
}

rr::OrderedJson list_for_agent(GatewayState& gateway, const Identity& who, const std::string& cursor) {
  const auto seen = devices_for_agent(gateway, who);
  const auto page = page_of(seen.size(), cursor);
  auto out = rr::OrderedJson::object();
  auto& devices = rr::add_key(out, "devices") = rr::OrderedJson::array();
  for (auto i = page.first; i < page.last; ++i) devices.push_back(device_for_agent(gateway, who, *seen[i]));
  if (!page.next.empty()) rr::add_key(out, "nextCursor") = page.next;
  return out;
}

rr::OrderedJson describe_for_agent(GatewayState& gateway, const Identity& who, const Target& target,
                                   const std::string& cursor) {
  const auto& rules = gateway.access().state().rules;
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "object") = target.path();
  rr::add_key(out, "type") = target.type->qualified_name;
  if (!target.member) add_text(out, target.type->documentation);
  auto members = rr::OrderedJson::array();
  if (target.member) {
    members.push_back(describe_member(target, *target.member, rules, who));
  } else {
    const auto& all = target.type->members;
    const auto page = page_of(all.size(), cursor);
    for (auto i = page.first; i < page.last; ++i) members.push_back(describe_member(target, all[i], rules, who));
    if (!page.next.empty()) rr::add_key(out, "nextCursor") = page.next;
  }
  auto types = named_types(members, target.types());
  rr::add_key(out, "members") = std::move(members);
  if (!types.empty()) rr::add_key(out, "components")["schemas"] = std::move(types);
  return out;
}

}  // namespace rrgate
