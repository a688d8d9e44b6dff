// Client classes for the objects of a definition: those that wait, and those for Asio. Layer: definitions.
#include "node/generate/cpp_emitter.hpp"

namespace rrgate {

void CppEmitter::emit_client(const EntityDefinition& item) {
  const auto name = types_.declared_name(item.qualified_name, "Client");
  types_.enter(name);
  header_.documentation(item.documentation);
  header_.line("class " + name + " : public rr::ClientStub {");
  header_.open(" public:");
  header_.line("/// The root object: rr::connect(url). Throws rr::ClientException: not an object of this type.");
  header_.line("explicit " + name + "(rr::RemoteObject object);");
  header_.gap();
  source_.line(name + "::" + name + "(rr::RemoteObject object)");
  source_.line("    : rr::ClientStub(std::move(object), " + types_.type_name(item.qualified_name) +
               "::rr_type, rr_throw_declared) {}");
  source_.gap();
  for (const auto& member : item.members) emit_client_member(name, member);
  header_.close("};");
  header_.gap();
}

void CppEmitter::emit_client_member(const std::string& client, const MemberDefinition& member) {
  const auto name = types_.member_name(member.name);
  const auto emit_function = [&](const std::string& type, const std::string& taken, const std::string& body) {
    header_.documentation(member.documentation);
    header_.line(type + ' ' + name + "(" + taken + ") const;");
    source_.open(type + ' ' + client + "::" + name + "(" + taken + ") const {");
    source_.line("return " + body + ";");
    source_.close();
    source_.gap();
  };
  if (const auto type = handle_type("rr::Typed", member); !type.empty()) {
    header_.documentation(member.documentation);
    return header_.line(type + ' ' + name + "() const { return {*this, \"" + member.name + "\"}; }");
  }
  switch (member.kind) {
    case MemberKind::objref: {
      const bool is_any = member.type.type == DataType::varobject_t;
      const auto child = is_any ? "rr::RemoteObject" : types_.client_name(member.type.qualified_name);
      return emit_function(child, index_parameter(member.type),
                           "rr_child<" + child + ">(\"" + member.name + "\"" + index_argument(member.type) + ")");
    }
    case MemberKind::function: {
      const auto type = types_.value(member.type);
      if (member.is_generator()) {
        const auto both = "<" + type + ", " + step_parameter(member) + ">";
        return emit_function("rr::TypedGenerator" + both, parameters(member),
                             "rr_generator" + both + "(\"" + member.name + "\"" + arguments(member) + ")");
      }
      return emit_function(type, parameters(member),
                           "rr_call<" + type + ">(\"" + member.name + "\"" + arguments(member) + ")");
    }
    default:
      break;
  }
}

std::string CppEmitter::handle_type(const std::string& prefix, const MemberDefinition& member) const {
  const auto of_value = [&](std::string_view kind) {
    return prefix + std::string(kind) + '<' + types_.value(member.type) + direction(member) + '>';
  };
  switch (member.kind) {
    case MemberKind::property:
      return of_value("Property");
    case MemberKind::wire:
      return of_value("Wire");
    case MemberKind::pipe:
      return of_value("Pipe");
    case MemberKind::memory:
      return prefix + "Memory<" + types_.value(memory_type(member)) + direction(member) + '>';
    case MemberKind::event:
    case MemberKind::callback: {
      std::vector<std::string> arguments;
      if (member.kind == MemberKind::callback) arguments.push_back(types_.value(member.type));
      for (const auto& parameter : member.parameters) arguments.push_back(types_.value(parameter.type));
      return prefix + (member.kind == MemberKind::callback ? "Callback<" : "Event<") + joined(arguments) + '>';
    }
    default:
      return {};
  }
}

void CppEmitter::emit_async_client(const EntityDefinition& item) {
  const auto name = types_.declared_name(item.qualified_name, "AsyncClient");
  types_.enter(name);
  header_.line("/// " + types_.declared_name(item.qualified_name, "Client") +
               " for programs on Asio: what waits there takes a completion token as its last argument here.");
  header_.line("class " + name + " : public rr::AsyncClientStub {");
  header_.open(" public:");
  header_.line(name + "() = default;  ///< no object");
  header_.line("/// The root object: rr::async_connect(io, url), or a client of a rr::ServiceSubscription. Throws");
  header_.line("/// rr::ClientException: not an object of this type.");
  header_.line("explicit " + name + "(rr::AsyncObject object);");
  header_.gap();
  source_.line(name + "::" + name + "(rr::AsyncObject object)");
  source_.line("    : rr::AsyncClientStub(std::move(object), " + types_.type_name(item.qualified_name) +
               "::rr_type, rr_throw_declared) {}");
  source_.gap();
  for (const auto& member : item.members) emit_async_client_member(member);
  header_.close("};");
  header_.gap();
}

void CppEmitter::emit_async_client_member(const MemberDefinition& member) {
  const auto name = types_.member_name(member.name);
  header_.documentation(member.documentation);
  if (const auto type = handle_type("rr::Async", member); !type.empty())
    return header_.line(type + ' ' + name + "() const { return {*this, \"" + member.name + "\"}; }");
  // What completes with an R is called as R: rr_call<R>, rr_generator<R, P>, rr_child<R>.
  const auto emit_function = [&](const std::string& taken, const std::string& call, const std::string& given) {
    header_.line("template <class RrToken = rr::UseAwaitable>");
    header_.open("auto " + name + "(" + taken + (taken.empty() ? "" : ", ") + "RrToken&& rr_token = {}) const {");
    header_.line("return " + call + "(\"" + member.name + "\", rr_token" + given + ");");
    header_.close();
  };
  if (member.kind == MemberKind::objref) {
    const bool is_any = member.type.type == DataType::varobject_t;
    const auto child = is_any ? "rr::AsyncObject" : types_.async_client_name(member.type.qualified_name);
    return emit_function(index_parameter(member.type), "rr_child<" + child + ">", index_argument(member.type));
  }
  std::string given;
  std::vector<std::string> taken;
  for (const auto& parameter : call_parameters(member)) {
    const auto type = types_.value(parameter.type);
    const auto parameter_name = types_.parameter_name(parameter.name);
    taken.push_back(is_small(parameter.type) ? type + ' ' + parameter_name : "const " + type + "& " + parameter_name);
    given += ", " + parameter_name;
  }
  const auto type = types_.value(member.type);
  const auto call =
      member.is_generator() ? "rr_generator<" + type + ", " + step_parameter(member) + ">" : "rr_call<" + type + ">";
  emit_function(joined(taken), call, given);
}

}  // namespace rrgate
