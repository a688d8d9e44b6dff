// The model of one service definition. Layer: robdef. Source: service definitions spec sections 5.1..5.6.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/wire/message.hpp"

namespace rr {

/// `stdver` / `option version`; all zero means unspecified.
struct Version {
  std::uint32_t major = 0;
  std::uint32_t minor = 0;
  std::uint32_t patch = 0;
  std::uint32_t tweak = 0;

  bool is_unspecified() const { return *this == Version{}; }
  auto operator<=>(const Version&) const = default;  // NOLINT(modernize-use-nullptr): of what it makes
};

Result<Version> parse_version(std::string_view text);
std::string format_version(const Version& version);

enum class ArrayKind : std::uint8_t {
  none,            ///< scalar
  variable,        ///< [] any length
  fixed,           ///< [5] exactly 5
  max,             ///< [5-] 0 to 5
  multidim,        ///< [*] any shape
  fixed_multidim,  ///< [3,4] or [3,]; column-major, first index fastest
};

enum class ContainerKind : std::uint8_t { none, list, map_int32, map_string, generator };

/// A type as written in a definition, e.g. `com.x.Pose[3]{list}`.
struct TypeDefinition {
  /// A builtin type, or DataType::namedtype_t. After verification a named type is enum_t, structure_t, pod_t,
  /// namedarray_t or object_t.
  DataType type = DataType::void_t;
  std::string name = {};            ///< named types: as written (may be an alias or unqualified)
  std::string qualified_name = {};  ///< named types, after verification: "service.Name"
  ArrayKind array = ArrayKind::none;
  std::vector<std::int32_t> sizes = {};  ///< fixed, max: one; fixed_multidim: one a dimension
  ContainerKind container = ContainerKind::none;

  bool operator==(const TypeDefinition&) const = default;
};

/// `BASE[…]{…}` with the name as written.
std::string format_type(const TypeDefinition& type);

struct Modifier {
  std::string name;
  std::vector<std::string> arguments = {};
  std::string text = {};  ///< as written, for the canonical text
  bool operator==(const Modifier& other) const { return name == other.name && arguments == other.arguments; }
};

struct ParameterDefinition {
  std::string name;
  TypeDefinition type;
  bool operator==(const ParameterDefinition&) const = default;
};

enum class MemberKind : std::uint8_t { field, property, function, event, objref, pipe, callback, wire, memory };

std::string_view member_kind_name(MemberKind kind);

enum class MemberDirection : std::uint8_t { both, readonly, writeonly };

struct MemberDefinition {
  MemberKind kind = MemberKind::property;
  std::string name;
  TypeDefinition type = {};  ///< property, field, pipe, wire, memory: value; function, callback: return; objref: target
  std::vector<ParameterDefinition> parameters = {};  ///< function, event, callback
  std::vector<Modifier> modifiers = {};
  std::string documentation = {};
  std::uint32_t line = 0;

  bool has_modifier(std::string_view name) const;
  MemberDirection direction() const;  ///< readonly wins where both are given
  /// A function whose return type or last parameter is a generator.
  bool is_generator() const;
  /// Its last parameter where that is a generator, which takes a value with each step; null: there is none.
  const ParameterDefinition* step_parameter() const;
  /// An objref to many objects: a list, or a map by int32 or string.
  bool is_indexed() const {
    return kind == MemberKind::objref && (type.container != ContainerKind::none || type.array != ArrayKind::none);
  }
};

struct ConstantDefinition {
  TypeDefinition type = {};  ///< struct constants: namedtype_t with the type word in `name`
  std::string name;
  std::string value_text;  ///< as read, without outer blanks
  std::string documentation = {};
  std::uint32_t line = 0;
};

struct EnumValueDefinition {
  std::string name;
  std::int32_t value = 0;
  bool is_implicit = false;
  bool is_hex = false;
  std::string documentation = {};
  std::uint32_t line = 0;
};

struct EnumDefinition {
  std::string name;
  std::vector<EnumValueDefinition> values = {};
  std::string documentation = {};
  std::uint32_t line = 0;
};

struct ExceptionDefinition {
  std::string name;
  std::string documentation = {};
  std::uint32_t line = 0;
};

struct UsingDefinition {
  std::string qualified_name;
  std::string alias;  ///< the last segment of qualified_name where no `as` is given
  std::uint32_t line = 0;
};

struct ImportDefinition {
  std::string name;
  std::uint32_t line = 0;
};

struct OptionDefinition {
  std::string text;  ///< what follows `option`, without outer blanks
  std::uint32_t line = 0;
};

struct ImplementsDefinition {
  std::string name;                 ///< as written
  std::string qualified_name = {};  ///< after verification
  std::uint32_t line = 0;
};

enum class EntityKind : std::uint8_t { structure, pod, namedarray, object };

/// struct, pod, namedarray (members are fields) or object.
struct EntityDefinition {
  EntityKind kind = EntityKind::structure;
  std::string name;
  std::string qualified_name = {};  ///< "service.Name", after verification
  std::vector<ImplementsDefinition> implements = {};
  std::vector<OptionDefinition> options = {};
  std::vector<ConstantDefinition> constants = {};
  std::vector<MemberDefinition> members = {};
  std::string documentation = {};
  std::uint32_t line = 0;
  /// namedarrays, after verification: the one numeric type and how many of them one value holds.
  DataType namedarray_type = DataType::void_t;
  std::uint32_t namedarray_count = 0;

  const MemberDefinition* find_member(std::string_view name) const;
  /// By the modifier or the old `option pipe NAME unreliable`.
  bool is_unreliable_pipe(const MemberDefinition& pipe) const;
};

struct ServiceDefinition {
  std::string name;
  Version version = {};
  bool version_is_option = false;  ///< `option version` instead of `stdver`
  std::vector<ImportDefinition> imports = {};
  std::vector<UsingDefinition> usings = {};
  std::vector<OptionDefinition> options = {};
  std::vector<ConstantDefinition> constants = {};
  std::vector<EnumDefinition> enums = {};
  std::vector<ExceptionDefinition> exceptions = {};
  std::vector<EntityDefinition> entities = {};  ///< structs, pods, namedarrays, objects in source order
  std::string documentation = {};
  std::string text = {};           ///< the source as received: what a node sends on
  std::string file = {};           ///< where the text came from, for diagnostics; may be empty
  std::uint32_t line = 0;          ///< of the `service` statement
  std::uint32_t version_line = 0;  ///< of `stdver` or `option version`; 0 where there is none

  const EntityDefinition* find_entity(std::string_view name) const;
  const EnumDefinition* find_enum(std::string_view name) const;
  const ExceptionDefinition* find_exception(std::string_view name) const;
};

}  // namespace rr
