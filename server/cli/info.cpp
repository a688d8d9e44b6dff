// rrgate info, robdef: what a service says of itself. Layer: server/cli.
#include <iostream>

#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace {

std::string parameters_text(const rr::MemberDefinition& member) {
  std::string out;
  for (const auto& parameter : member.parameters)
    out += (out.empty() ? "" : ", ") + rr::format_type(parameter.type) + " " + parameter.name;
  return "(" + out + ")";
}

/// "function double move_to(double[] joints)", as a service definition says it.
std::string declaration(const rr::MemberDefinition& member) {
  std::string out(rr::member_kind_name(member.kind));
  if (member.kind != rr::MemberKind::event) out += " " + rr::format_type(member.type);
  out += " " + member.name;
  const bool has_parameters = member.kind == rr::MemberKind::function || member.kind == rr::MemberKind::event ||
                              member.kind == rr::MemberKind::callback;
  if (has_parameters) out += parameters_text(member);
  if (!member.modifiers.empty()) {
    out += " [";
    for (const auto& modifier : member.modifiers) out += (out.ends_with("[") ? "" : ", ") + modifier.name;
    out += "]";
  }
  return out;
}

std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

rr::OrderedJson describe(const RemoteMember& object) {
  auto out = rr::OrderedJson::object();
  out["path"] = object.object.path();
  out["type"] = object.type->qualified_name;
  auto implements = rr::OrderedJson::array();
  for (const auto& each : object.type->implements) implements.push_back(each.name);
  out["implements"] = std::move(implements);
  out["documentation"] = object.type->documentation;
  auto members = rr::OrderedJson::array();
  for (const auto& member : object.type->members) {
    auto each = rr::OrderedJson::object();
    each["name"] = member.name;
    each["kind"] = rr::member_kind_name(member.kind);
    each["declaration"] = declaration(member);
    each["documentation"] = member.documentation;
    members.push_back(std::move(each));
  }
  out["members"] = std::move(members);
  return out;
}

void print_description(const rr::OrderedJson& description) {
  std::cout << description["path"].get<std::string>() << ": " << description["type"].get<std::string>() << "\n";
  if (const auto text = description["documentation"].get<std::string>(); !text.empty())
    std::cout << "  " << first_line(text) << "\n";
  for (const auto& member : description["members"]) {
    std::cout << "  " << member["declaration"].get<std::string>() << "\n";
    if (const auto text = member["documentation"].get<std::string>(); !text.empty())
      std::cout << "      " << first_line(text) << "\n";
  }
}

}  // namespace

int run_info(Arguments arguments) {
  const auto parsed = parse_arguments(arguments, {remote_options, remote_flags});
  if (!parsed.error.empty()) return usage_error("info", parsed.error);
  if (parsed.operands.empty() || parsed.operands.size() > 2) return usage_error("info", "expected URL [OBJECT]");
  return run_remote("info", parsed.operands[0], [&] {
    const auto root = open_service(remote_address(parsed.operands[0], parsed));
    const auto found = find_member(root, parsed.operands.size() > 1 ? parsed.operands[1] : "");
    auto description = describe(found);
    if (found.member) {  // one member alone
      auto& members = description["members"];
      const auto is_other = [&](const auto& each) { return each["name"] != found.member->name; };
      members.erase(std::remove_if(members.begin(), members.end(), is_other), members.end());
    }
    if (parsed.flags.contains("--json"))
      print_value(description, true);
    else
      print_description(description);
    return static_cast<int>(exit_ok);
  });
}

int run_robdef(Arguments arguments) {
  const auto parsed = parse_arguments(arguments, {remote_options});
  if (!parsed.error.empty()) return usage_error("robdef", parsed.error);
  if (parsed.operands.size() != 1) return usage_error("robdef", "expected URL");
  return run_remote("robdef", parsed.operands[0], [&] {
    const auto root = open_service(remote_address(parsed.operands[0], parsed));
    std::string separator;
    for (const auto& definition : root.connection().asynchronous().session().types().definitions()) {
      std::cout << separator << definition->text;
      separator = definition->text.ends_with("\n") ? "\n" : "\n\n";
    }
    std::cout << std::endl;
    return static_cast<int>(exit_ok);
  });
}

}  // namespace rrgate
