// Named arrays, pods and structs as C++. Layer: definitions.
#include "node/generate/cpp_emitter.hpp"

namespace rrgate {

void CppEmitter::emit_namedarray(const EntityDefinition& item) {
  types_.enter(types_.declared_name(item.qualified_name));
  header_.documentation(item.documentation);
  header_.open("struct " + types_.declared_name(item.qualified_name) + " {");
  TypeDefinition number;
  number.type = item.namedarray_type;
  header_.line("static constexpr std::string_view rr_type = \"" + item.qualified_name + "\";");
  header_.line("static constexpr rr::EntityKind rr_kind = rr::EntityKind::namedarray;");
  header_.line("using rr_item = " + types_.value(number) + ";");
  header_.line("static constexpr std::size_t rr_count = " + std::to_string(item.namedarray_count) + ";");
  emit_constants_of(item);
  header_.gap();
  for (const auto& field : item.members) {
    header_.documentation(field.documentation);
    // Always without indirection: the fields are the numbers of the wire, one behind the other.
    auto scalar = field.type;
    scalar.array = ArrayKind::none;
    const auto type = types_.value(scalar);
    const auto name = types_.member_name(field.name);
    if (field.type.array == ArrayKind::none)
      header_.line(types_.field(field.type, name) + ";");
    else
      header_.line("std::array<" + type + ", " + std::to_string(field.type.sizes.front()) + "> " + name + " = {};");
  }
  header_.gap();
  header_.line("bool operator==(const " + types_.declared_name(item.qualified_name) + "&) const = default;");
  header_.close("};");
  header_.gap();
  types_.enter({});
}

/// Structs and pods.
void CppEmitter::emit_fields(const EntityDefinition& item) {
  types_.enter(types_.declared_name(item.qualified_name));
  const auto name = types_.declared_name(item.qualified_name);
  header_.documentation(item.documentation);
  header_.open("struct " + name + " {");
  header_.line("static constexpr std::string_view rr_type = \"" + item.qualified_name + "\";");
  header_.line("static constexpr rr::EntityKind rr_kind = rr::EntityKind::" +
               std::string(item.kind == EntityKind::pod ? "pod" : "structure") + ";");
  emit_constants_of(item);
  header_.gap();
  for (const auto& field : item.members) {
    header_.documentation(field.documentation);
    header_.line(types_.field(field.type, types_.member_name(field.name)) + ";");
  }
  header_.gap();
  header_.line("bool operator==(const " + name + "&) const = default;");
  header_.close("};");
  emit_packing(item);
  types_.enter({});
}

void CppEmitter::emit_packing(const EntityDefinition& item) {
  const auto name = types_.declared_name(item.qualified_name);
  header_.line("rr::Structure rr_pack(" + name + " rr_value);");
  header_.line("void rr_unpack(const rr::Structure& rr_fields, " + name + "& rr_value);");
  header_.gap();
  source_.open("rr::Structure rr_pack([[maybe_unused]] " + name + " rr_value) {");
  source_.line("rr::FieldPacker rr_fields(" + name + "::rr_type, " + std::to_string(item.members.size()) + ");");
  for (const auto& field : item.members)
    source_.line("rr_fields.add(\"" + field.name + "\", " +
                 moved(field.type, "rr_value." + types_.member_name(field.name)) + ");");
  source_.line("return rr_fields.take();");
  source_.close();
  source_.gap();
  source_.open("void rr_unpack([[maybe_unused]] const rr::Structure& rr_fields, [[maybe_unused]] " + name +
               "& rr_value) {");
  for (const auto& field : item.members)
    source_.line("rr::unpack_field(rr_fields, \"" + field.name + "\", rr_value." + types_.member_name(field.name) +
                 ");");
  source_.close();
  source_.gap();
}

}  // namespace rrgate
