// The emitter behind generate_cpp(); its parts are in generate_cpp*.cpp. Layer: definitions.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "node/generate/constant_literal.hpp"
#include "node/generate/cpp_types.hpp"
#include "node/generate/generate_cpp.hpp"
#include "node/generate/source_writer.hpp"

namespace rrgate {

using namespace rr;

/// Walks a definition once and writes header and source side by side.
class CppEmitter {
 public:
  CppEmitter(const DefinitionSet& set, const ServiceDefinition& definition)
      : set_(set), definition_(definition), is_strict_(set.is_strict(definition)), types_(set, definition) {}

  CppFiles emit();

 private:
  std::string qualified(std::string_view name) const { return definition_.name + '.' + std::string(name); }
  void emit_definition_text();
  void emit_exceptions();
  void emit_enum(const EnumDefinition& item);
  void emit_exception(const ExceptionDefinition& item);
  /// `scope`  where they are declared, with "::" behind.
  void emit_constants(const std::vector<ConstantDefinition>& constants, std::string_view storage,
                      const std::string& scope);
  void emit_constants_of(const EntityDefinition& item) {
    emit_constants(all_constants(item), "static constexpr ", types_.type_name(item.qualified_name) + "::");
  }
  void emit_namedarray(const EntityDefinition& item);
  void emit_fields(const EntityDefinition& item);
  void emit_packing(const EntityDefinition& item);
  void emit_object(const EntityDefinition& item);

  void emit_client(const EntityDefinition& item);
  void emit_client_member(const std::string& client, const MemberDefinition& member);
  void emit_async_client(const EntityDefinition& item);
  void emit_async_client_member(const MemberDefinition& member);
  /// "rr::TypedWire<double, rr::readonly>", with `prefix` "rr::Typed"; empty for members that are no handles.
  std::string handle_type(const std::string& prefix, const MemberDefinition& member) const;
  void emit_service(const EntityDefinition& item);
  void emit_service_member(const EntityDefinition& item, const MemberDefinition& member);
  void emit_binding(const EntityDefinition& item);

  /// Structs come in source order; pods and named arrays hold others by value and come behind those.
  std::vector<const EntityDefinition*> in_order(EntityKind kind) const;

  /// Those of a call; the generator parameter is given later.
  static std::span<const ParameterDefinition> call_parameters(const MemberDefinition& member);
  /// What a generator takes with each step: "void" where it takes nothing.
  std::string step_parameter(const MemberDefinition& member) const;
  std::string parameters(const MemberDefinition& member) const;
  /// What hands the parameters on: ", a, std::move(b)".
  std::string arguments(const MemberDefinition& member) const;
  static bool is_small(const TypeDefinition& type);  ///< numbers and enums
  static std::string moved(const TypeDefinition& type, const std::string& name);
  /// Without the container that compat mode takes: a memory is an array.
  static TypeDefinition memory_type(const MemberDefinition& member);
  static std::string direction(const MemberDefinition& member);
  static std::string index_parameter(const TypeDefinition& objref);
  /// What hands the index of an objref on: ", index" as a string; empty without one.
  static std::string index_argument(const TypeDefinition& objref);

  const DefinitionSet& set_;
  const ServiceDefinition& definition_;
  const bool is_strict_;  ///< else services read their definitions in compat mode
  CppTypes types_;
  SourceWriter header_{DocStyle::lines};
  SourceWriter source_{DocStyle::lines};
};

}  // namespace rrgate
