// Base classes for services that implement the objects of a definition. Layer: definitions.
#include <algorithm>

#include "core/types/multidim.hpp"
#include "node/generate/cpp_emitter.hpp"

namespace rrgate {

void CppEmitter::emit_service(const EntityDefinition& item) {
  const auto name = types_.declared_name(item.qualified_name, "Service");
  types_.enter(name);
  std::vector<std::string> bases;
  for (const auto& base : item.implements)
    bases.push_back("public virtual " + types_.service_name(base.qualified_name));
  if (bases.empty()) bases.push_back("public virtual rr::ServiceStub");
  header_.documentation(item.documentation);
  header_.line("class " + name + " : " + joined(bases) + " {");
  header_.open(" public:");
  for (const auto& member : item.members) emit_service_member(item, member);
  header_.gap();
  header_.line("std::string_view rr_object_type() const override;");
  header_.line("std::vector<std::string> rr_object_definitions() const override;");
  if (!is_strict_)
    header_.line("rr::RobdefMode rr_definition_mode() const override { return rr::RobdefMode::compat; }");
  header_.gap();
  header_.label("protected:");
  header_.line("void rr_bind(rr::Object& object) override;");
  header_.close("};");
  header_.gap();

  source_.open("std::string_view " + name + "::rr_object_type() const {");
  source_.line("return " + types_.type_name(item.qualified_name) + "::rr_type;");
  source_.close();
  source_.gap();
  source_.open("std::vector<std::string> " + name + "::rr_object_definitions() const {");
  source_.line("return rr_definitions();");
  source_.close();
  source_.gap();
  emit_binding(item);
}

void CppEmitter::emit_service_member(const EntityDefinition& item, const MemberDefinition& member) {
  const auto name = types_.member_name(member.name);
  const auto type = types_.value(member.type);
  const bool is_inherited = std::any_of(item.implements.begin(), item.implements.end(), [&](const auto& base) {
    const auto* entity = set_.find_entity(base.qualified_name);
    return entity && entity->find_member(member.name);
  });
  const auto emit_virtual = [&](const std::string& signature, std::string_view body) {
    header_.line((is_inherited ? "" : "virtual ") + signature + (is_inherited ? " override" : "") + std::string(body));
  };
  const auto emit_telling = [&](const std::string& result, const std::string& taken, const std::string& body) {
    header_.line(result + ' ' + name + "(" + taken + ");");
    source_.open(result + ' ' + types_.declared_name(item.qualified_name, "Service") + "::" + name + "(" + taken +
                 ") {");
    source_.line(body);
    source_.close();
    source_.gap();
  };
  header_.documentation(member.documentation);
  const auto way = member.direction();
  switch (member.kind) {
    case MemberKind::function:
      if (member.is_generator()) {
        const auto next = step_parameter(member);
        const auto result = type == "void" ? "bool" : "std::optional<" + type + ">";
        return emit_virtual("std::function<" + result + "(" + (next == "void" ? "" : next) + ")> " + name + "(" +
                                parameters(member) + ")",
                            " = 0;");
      }
      return emit_virtual(type + ' ' + name + "(" + parameters(member) + ")", " = 0;");
    case MemberKind::property:
      if (way != MemberDirection::writeonly) emit_virtual(type + " get_" + member.name + "()", " = 0;");
      if (way != MemberDirection::readonly) emit_virtual("void set_" + member.name + "(" + type + " value)", " = 0;");
      return;
    case MemberKind::wire:
      if (way != MemberDirection::readonly) emit_virtual("void set_" + member.name + "(" + type + " /*value*/)", " {}");
      if (way != MemberDirection::writeonly)
        emit_telling("void", type + " value",
                     "rr_set_wire(\"" + member.name + "\", rr::pack_value(" + moved(member.type, "value") + "));");
      return;
    case MemberKind::pipe:
      if (way != MemberDirection::readonly)
        emit_virtual("void set_" + member.name + "(const rr::PipeEndpoint& /*from*/, " + type + " /*packet*/)", " {}");
      if (way != MemberDirection::writeonly)
        emit_telling(
            "std::size_t", type + " packet",
            "return rr_broadcast(\"" + member.name + "\", rr::pack_value(" + moved(member.type, "packet") + "));");
      return;
    case MemberKind::event:
      return emit_telling("void", parameters(member), "rr_fire(\"" + member.name + "\"" + arguments(member) + ");");
    case MemberKind::objref: {
      const bool is_any = member.type.type == DataType::varobject_t;
      const auto child = is_any ? "rr::ServiceStub" : types_.service_name(member.type.qualified_name);
      return emit_virtual(
          "std::shared_ptr<" + child + "> get_" + member.name + "(" + index_parameter(member.type) + ")", " = 0;");
    }
    case MemberKind::callback: {
      const auto taken = parameters(member);
      return emit_telling(
          "void",
          "rr::ClientId rr_client, " + taken + (taken.empty() ? "" : ", ") + "std::function<void(rr::Result<" + type +
              ">)> rr_done",
          "rr_ask<" + type + ">(rr_client, \"" + member.name + "\", std::move(rr_done)" + arguments(member) + ");");
    }
    case MemberKind::memory: {
      auto scalar = memory_type(member);
      scalar.array = ArrayKind::none;
      return emit_virtual("std::shared_ptr<rr::MemoryBuffer<" + types_.value(scalar) + ">> get_" + member.name + "()",
                          " = 0;");
    }
    case MemberKind::field:
      break;
  }
}

void CppEmitter::emit_binding(const EntityDefinition& item) {
  const auto name = types_.declared_name(item.qualified_name, "Service");
  source_.open("void " + name + "::rr_bind([[maybe_unused]] rr::Object& object) {");
  for (const auto& member : item.members) {
    const auto bind = [&](std::string_view how, const std::string& function) {
      source_.line(std::string(how) + "(object, \"" + member.name + "\", &" + name + "::" + function + ");");
    };
    const bool is_read = member.direction() != MemberDirection::writeonly;
    const bool is_written = member.direction() != MemberDirection::readonly;
    if (member.kind == MemberKind::function)
      bind(member.is_generator() ? "rr_generator" : "rr_function", types_.member_name(member.name));
    if (member.kind == MemberKind::property && is_read) bind("rr_getter", "get_" + member.name);
    if (member.kind == MemberKind::property && is_written) bind("rr_setter", "set_" + member.name);
    if (member.kind == MemberKind::wire && is_written) bind("rr_wire_setter", "set_" + member.name);
    if (member.kind == MemberKind::pipe && is_written) bind("rr_pipe_setter", "set_" + member.name);
    if (member.kind == MemberKind::memory)
      bind(is_multidim(member.type) ? "rr_multidim_memory" : "rr_memory", "get_" + member.name);
    if (member.kind == MemberKind::objref) bind("rr_objref", "get_" + member.name);
  }
  source_.close();
  source_.gap();
}

}  // namespace rrgate
