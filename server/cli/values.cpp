// rrgate get, set, call: single values of a device. Layer: server/cli.
#include <fstream>
#include <iostream>

#include "server/cli/remote_service.hpp"
#include "server/json/arguments.hpp"
#include "server/json/value_from_json.hpp"

namespace rrgate {

namespace {

using enum rr::MemberKind;

bool is_json(const ParsedArguments& parsed) {
  return parsed.flags.contains("--json");
}

int get_value(const RemoteMember& found, const ParsedArguments& parsed) {
  expect_kind(found, {property, wire, memory}, "get");
  const auto& name = found.member->name;
  rr::Value value;
  if (found.member->kind == property)
    value = found.object.get(name);
  else if (found.member->kind == wire)
    value = found.object.peek_in(name);
  else
    value = found.object.memory(name).read();
  print_value(to_json(value, found.member->type, found.types()), is_json(parsed));
  return exit_ok;
}

int set_value(const RemoteMember& found, std::string_view text) {
  expect_kind(found, {property, wire}, "set");
  const auto& member = *found.member;
  const auto value =
      rr::value_from_json(read_json_argument(text, member.type), member.type, found.types(), {}, member.name);
  if (!value) throw NotUnderstood(value.error().message);
  if (member.kind == property)
    found.object.set(member.name, *value);
  else
    found.object.poke_out(member.name, *value);
  return exit_ok;
}

std::string signature(const rr::MemberDefinition& function) {
  std::string out = function.name + "(";
  for (const auto& parameter : function.parameters) {
    if (out.back() != '(') out += ", ";
    out += rr::format_type(parameter.type) + " " + parameter.name;
  }
  return out + ")";
}

/// By name ("radius=5000"); the others, in order, are those that no name was given for.
std::vector<rr::Value> read_arguments(const RemoteMember& found, const std::vector<std::string>& texts) {
  const auto& parameters = found.member->parameters;
  auto json = rr::Json::object();
  std::vector<std::string_view> unnamed;
  for (const auto& text : texts) {
    const auto name = text.substr(0, text.find('='));
    const auto is_it = [&](const auto& parameter) { return name != text && parameter.name == name; };
    const auto parameter = std::find_if(parameters.begin(), parameters.end(), is_it);
    if (parameter == parameters.end()) {
      unnamed.push_back(text);
      continue;
    }
    if (json.contains(name)) throw NotUnderstood("argument " + rr::quote(name) + " is given twice");
    json[name] = read_json_argument(std::string_view(text).substr(name.size() + 1), parameter->type);
  }
  auto next = unnamed.begin();
  for (const auto& parameter : parameters)
    if (next != unnamed.end() && !json.contains(parameter.name))
      json[parameter.name] = read_json_argument(*next++, parameter.type);
  if (next != unnamed.end())
    throw NotUnderstood(std::to_string(texts.size()) + " arguments for " + signature(*found.member));
  auto values = rr::arguments_from_json(json, *found.member, found.types(), {});
  if (!values) throw NotUnderstood(values.error().message + "; it is " + signature(*found.member));
  return std::move(*values);
}

int call_function(const RemoteMember& found, const ParsedArguments& parsed, const std::vector<std::string>& texts) {
  expect_kind(found, {function}, "call");
  const auto& member = *found.member;
  for (const auto& parameter : member.parameters)
    if (parameter.type.container == rr::ContainerKind::generator)
      throw NotUnderstood(rr::quote(member.name) + " takes values while it runs, which this command can't give");
  const auto values = read_arguments(found, texts);
  auto type = member.type;
  if (member.is_generator()) {
    type.container = rr::ContainerKind::none;
    auto generator = found.object.generator_values(member.name, values);
    for (const auto& value : generator) print_value(to_json(value, type, found.types()), is_json(parsed));
    return exit_ok;
  }
  const auto result = found.object.call_values(member.name, values);
  if (type.type != rr::DataType::void_t) print_value(to_json(result, type, found.types()), is_json(parsed));
  return exit_ok;
}

/// "-5" is a value; "--" ends the options.
int run_with_member(std::string_view command, Arguments arguments, std::size_t min_operands, std::string_view expected,
                    std::size_t max_operands, int (*run)(const RemoteMember& found, const ParsedArguments& parsed)) {
  const auto parsed = parse_arguments(arguments, {remote_options, remote_flags});
  if (!parsed.error.empty()) return usage_error(command, parsed.error);
  if (parsed.operands.size() < min_operands || parsed.operands.size() > max_operands)
    return usage_error(command, "expected " + std::string(expected));
  return run_remote(command, parsed.operands[0], [&] {
    return run(find_member(open_service(remote_address(parsed.operands[0], parsed)), parsed.operands[1]), parsed);
  });
}

}  // namespace

int run_get(Arguments arguments) {
  return run_with_member("get", arguments, 2, "URL MEMBER", 2, get_value);
}

int run_set(Arguments arguments) {
  return run_with_member("set", arguments, 3, "URL MEMBER VALUE", 3,
                         [](const auto& found, const auto& parsed) { return set_value(found, parsed.operands[2]); });
}

int run_call(Arguments arguments) {
  return run_with_member("call", arguments, 2, "URL FUNCTION [ARGUMENT...]", 1000,
                         [](const auto& found, const auto& parsed) {
                           return call_function(found, parsed, {parsed.operands.begin() + 2, parsed.operands.end()});
                         });
}

}  // namespace rrgate
