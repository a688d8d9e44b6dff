#include "core/member/arguments.hpp"

namespace rr {

namespace {

bool returns_nothing(const MemberDefinition& member) {
  return member.type.type == DataType::void_t;
}

Result<Value> read_element(const Message& message, const MessageEntry& entry, std::string_view name,
                           const MemberDefinition& member, const TypeDefinition& type, const TypeRegistry& types) {
  const auto* element = message.elements_of(entry).find(name);
  if (!element)
    return make_error(ErrorCode::message_element_not_found, std::string(member_kind_name(member.kind)) + " '" +
                                                                member.name + "': element '" + std::string(name) +
                                                                "' not found");
  auto value = unpack(message, *element, type, types);
  if (value) return value;
  auto error = value.error();
  error.message = std::string(member_kind_name(member.kind)) + " '" + member.name + "': " + error.message;
  return error;
}

}  // namespace

Result<> write_arguments(Message& message, std::span<const Value> arguments, const MemberDefinition& member,
                         const TypeRegistry& types) {
  const auto& parameters = member.parameters;
  const std::size_t expected = parameters.size() - (member.step_parameter() ? 1 : 0);
  if (arguments.size() != expected)
    return make_error(ErrorCode::invalid_argument, std::string(member_kind_name(member.kind)) + " '" + member.name +
                                                       "': " + std::to_string(arguments.size()) + " arguments given, " +
                                                       std::to_string(expected) + " expected");
  for (std::size_t i = 0; i < expected; ++i)
    if (auto done = pack(message, std::string_view(parameters[i].name), arguments[i], parameters[i].type, types); !done)
      return done;
  return {};
}

Result<std::vector<Value>> read_arguments(const Message& message, const MessageEntry& entry,
                                          const MemberDefinition& member, const TypeRegistry& types) {
  std::vector<Value> arguments;
  arguments.reserve(member.parameters.size());
  for (const auto& parameter : member.parameters) {
    if (&parameter == member.step_parameter()) continue;
    auto value = read_element(message, entry, parameter.name, member, parameter.type, types);
    if (!value) return value.error();
    arguments.push_back(std::move(*value));
  }
  return arguments;
}

Result<> write_return(Message& message, const Value& value, const MemberDefinition& member, const TypeRegistry& types) {
  if (!returns_nothing(member)) return pack(message, "return", value, member.type, types);
  message.add_scalar("return", DataType::int32_t, std::int32_t{0});
  return {};
}

Result<Value> read_return(const Message& message, const MessageEntry& entry, const MemberDefinition& member,
                          const TypeRegistry& types) {
  if (returns_nothing(member)) return Value{};
  return read_element(message, entry, "return", member, member.type, types);
}

Result<> write_property(Message& message, const Value& value, const MemberDefinition& member,
                        const TypeRegistry& types) {
  return pack(message, "value", value, member.type, types);
}

Result<Value> read_property(const Message& message, const MessageEntry& entry, const MemberDefinition& member,
                            const TypeRegistry& types) {
  return read_element(message, entry, "value", member, member.type, types);
}

}  // namespace rr
