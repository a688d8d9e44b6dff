#include "node/generate/generate_typescript.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "core/robdef/model/constant_value.hpp"
#include "core/robdef/model/names.hpp"
#include "core/types/multidim.hpp"
#include "core/types/value.hpp"
#include "node/generate/constant_literal.hpp"
#include "node/generate/source_writer.hpp"

namespace rrgate {

namespace {

using namespace rr;

constexpr std::string_view words_of_the_language[] = {
    "any",    "arguments", "await",      "bigint",    "boolean",   "break",    "case",     "catch",      "class",
    "const",  "continue",  "debugger",   "default",   "delete",    "do",       "else",     "enum",       "eval",
    "export", "extends",   "false",      "finally",   "for",       "function", "if",       "implements", "import",
    "in",     "infer",     "instanceof", "interface", "keyof",     "let",      "never",    "new",        "null",
    "number", "object",    "package",    "private",   "protected", "public",   "readonly", "return",     "static",
    "string", "super",     "switch",     "symbol",    "this",      "throw",    "true",     "try",        "type",
    "typeof", "undefined", "unique",     "unknown",   "var",       "void",     "while",    "with",       "yield"};

/// Global types that the output uses, and what it imports from rrgate-client.
constexpr std::string_view used_types[] = {"Array",
                                           "AsyncGenerator",
                                           "BigInt64Array",
                                           "BigUint64Array",
                                           "Float32Array",
                                           "Float64Array",
                                           "Int16Array",
                                           "Int32Array",
                                           "Int8Array",
                                           "Map",
                                           "Object",
                                           "Omit",
                                           "Pick",
                                           "Promise",
                                           "Uint16Array",
                                           "Uint32Array",
                                           "Uint8Array",
                                           "CallbackMember",
                                           "Complex",
                                           "EventMember",
                                           "ExactValue",
                                           "FunctionMember",
                                           "GeneratorMember",
                                           "MemoryMember",
                                           "MultiDim",
                                           "ObjectInfo",
                                           "ObjRefMember",
                                           "PipeMember",
                                           "PropertyMember",
                                           "RemoteObject",
                                           "RobotRaconteurError",
                                           "RrValue",
                                           "WireMember"};

/// Members that the client does not put on its objects, because JavaScript calls them by itself.
constexpr std::string_view implicit_names[] = {"then", "toString", "toJSON", "valueOf"};

bool contains(std::span<const std::string_view> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string with_underscores(std::string qualified_name) {
  std::replace(qualified_name.begin(), qualified_name.end(), '.', '_');
  return qualified_name;
}

std::string fields_text(const std::map<std::string, std::string>& types) {
  std::vector<std::string> fields;
  for (const auto& [name, type] : types) fields.push_back("readonly " + name + ": " + type);
  return fields.empty() ? "{}" : "{ " + joined(fields, "; ") + " }";
}

std::string array_of(const std::string& item) {
  return (item.find('|') == std::string::npos ? item : '(' + item + ')') + "[]";
}

/// Values that the client receives, or those that it may send, which are more.
enum class Way { received, sent };

class TypeScriptEmitter {
 public:
  TypeScriptEmitter(const DefinitionSet& set, TypeScriptFlavour flavour) : set_(set), flavour_(flavour) {}

  std::string emit();

 private:
  void choose_names();
  void emit_definition(const ServiceDefinition& definition);
  void emit_enum(const ServiceDefinition& definition, const EnumDefinition& item);
  void emit_exception(const ServiceDefinition& definition, const ExceptionDefinition& item);
  void emit_entity(const ServiceDefinition& definition, const EntityDefinition& item);
  void emit_object(const ServiceDefinition& definition, const EntityDefinition& item);
  void emit_constants(const std::string& name, const EntityDefinition& item);
  std::map<std::string, std::string> constant_types(std::span<const ConstantDefinition> constants);
  /// What `$.constants` gives: those of the definition and of the type, which count where both have one of a name.
  std::string constants_text(const ServiceDefinition& definition, const EntityDefinition& item);
  std::string constant_text(const ConstantDefinition& item, std::span<const ConstantDefinition> scope, int& budget);
  std::string member_type(const MemberDefinition& member);
  std::string objref_type(const TypeDefinition& type);

  std::string type_text(const TypeDefinition& type, Way way);
  std::string item_text(const TypeDefinition& type, Way way);
  std::string scalar_text(const TypeDefinition& type, Way way);
  std::string array_text(const TypeDefinition& type, Way way);
  /// "T" or, where more may be sent than received, "T, S".
  std::string both_ways(const TypeDefinition& type);
  std::string parameters_text(std::span<const ParameterDefinition> parameters, Way way);

  const std::string& name_of(std::string_view service, std::string_view name) {
    return names_.at(std::string(service) + '.' + std::string(name));
  }
  /// A name of rrgate-client, which is imported then.
  std::string from_client(std::string_view name) { return *imports_.emplace(name).first; }

  const DefinitionSet& set_;
  TypeScriptFlavour flavour_;
  std::map<std::string, std::string> names_ = {};            ///< by qualified name
  std::map<std::string, std::string> constants_names_ = {};  ///< by service: the type of the definition's constants
  std::map<std::string, std::string> value_names_ = {};      ///< of enums: the type of the names of their values
  std::map<std::string, std::string> definition_constants_ = {};  ///< types of those of the one that is being written
  std::set<std::string> imports_ = {};
  SourceWriter out_{DocStyle::block};
};

std::string TypeScriptEmitter::emit() {
  choose_names();
  std::vector<std::string> services;
  for (const auto* definition : set_.in_order()) {
    services.push_back(definition->name);
    emit_definition(*definition);
  }
  const auto body = out_.take();
  out_.line("// Generated by `rrgate generate ts`; do not edit. Service definitions: " + joined(services));
  if (!imports_.empty())
    out_.line("import type { " + joined({imports_.begin(), imports_.end()}) + " } from \"rrgate-client\";");
  return out_.take() + "\n" + body;
}

/// Names stand for themselves; where several definitions have the same, each gets its service in front.
void TypeScriptEmitter::choose_names() {
  std::multimap<std::string, std::string> services;
  std::set<std::string> used;
  const auto choose_unused = [&used](std::string chosen) {
    while (contains(words_of_the_language, chosen) || contains(used_types, chosen) || !used.insert(chosen).second)
      chosen += '_';
    return chosen;
  };
  for (const auto* definition : set_.in_order()) {
    const auto add = [&](const std::string& name) { services.emplace(name, definition->name); };
    for (const auto& item : definition->enums) add(item.name);
    for (const auto& item : definition->exceptions) add(item.name);
    for (const auto& item : definition->entities) add(item.name);
    for (const auto& item : all_constants(*definition)) add(item.name);
  }
  for (const auto& [name, service] : services) {
    auto chosen = name;
    if (services.count(name) > 1) chosen = with_underscores(service + '.' + name);
    names_.emplace(service + '.' + name, choose_unused(chosen));
  }
  for (const auto* definition : set_.in_order()) {
    constants_names_.emplace(definition->name, choose_unused(with_underscores(definition->name + ".Constants")));
    for (const auto& item : definition->enums) {
      const auto key = definition->name + '.' + item.name;
      value_names_.emplace(key, choose_unused(names_.at(key) + "Name"));
    }
  }
}

void TypeScriptEmitter::emit_definition(const ServiceDefinition& definition) {
  if (flavour_ == TypeScriptFlavour::module) {
    const auto constants = all_constants(definition);
    for (const auto& item : constants) {
      out_.documentation(item.documentation);
      out_.line("export const " + name_of(definition.name, item.name) + " = " + typescript_constant(item, constants) +
                ";");
    }
    out_.gap();
  }
  for (const auto& item : definition.enums) emit_enum(definition, item);
  for (const auto& item : definition.exceptions) emit_exception(definition, item);
  definition_constants_ = constant_types(all_constants(definition));
  const bool has_objects =
      std::ranges::find(definition.entities, EntityKind::object, &EntityDefinition::kind) != definition.entities.end();
  if (has_objects && !definition_constants_.empty()) {
    out_.line("export type " + constants_names_.at(definition.name) + " = " + fields_text(definition_constants_) + ";");
    out_.gap();
  }
  for (const auto& item : definition.entities) emit_entity(definition, item);
}

void TypeScriptEmitter::emit_enum(const ServiceDefinition& definition, const EnumDefinition& item) {
  const auto& name = name_of(definition.name, item.name);
  // Values of newer services are numbers that no name is known for.
  const std::string unknown = "(number & {})";
  if (flavour_ == TypeScriptFlavour::module) {
    out_.documentation(item.documentation);
    out_.open("export const " + name + " = {");
    for (const auto& value : item.values) {
      out_.documentation(value.documentation);
      out_.line(value.name + ": " + std::to_string(value.value) + ",");
    }
    out_.close("} as const;");
    out_.line("export type " + name + " = (typeof " + name + ")[keyof typeof " + name + "] | " + unknown + ";");
  } else {
    out_.documentation(item.documentation);
    out_.open("export type " + name + " =");
    for (const auto& value : item.values) {
      out_.documentation(value.documentation);
      out_.line("| " + std::to_string(value.value) + " // " + value.name);
    }
    out_.close("  | " + unknown + ";");
  }
  std::vector<std::string> names;
  for (const auto& value : item.values) names.push_back('"' + value.name + '"');
  out_.line("export type " + value_names_.at(definition.name + '.' + item.name) + " = " +
            (names.empty() ? "never" : joined(names, " | ")) + ";");
  out_.gap();
}

void TypeScriptEmitter::emit_exception(const ServiceDefinition& definition, const ExceptionDefinition& item) {
  const auto& name = name_of(definition.name, item.name);
  const auto qualified = '"' + definition.name + '.' + item.name + '"';
  out_.documentation(item.documentation);
  out_.open("export interface " + name + " extends " + from_client("RobotRaconteurError") + " {");
  out_.line("readonly name: " + qualified + ";");
  out_.close();
  if (flavour_ == TypeScriptFlavour::module) out_.line("export const " + name + " = " + qualified + ";");
  out_.gap();
}

void TypeScriptEmitter::emit_entity(const ServiceDefinition& definition, const EntityDefinition& item) {
  const auto& name = names_.at(item.qualified_name);
  if (flavour_ == TypeScriptFlavour::module) emit_constants(name, item);
  out_.documentation(item.documentation);
  out_.open("export interface " + name + " {");
  if (item.kind == EntityKind::object) {
    emit_object(definition, item);
  } else {
    for (const auto& field : item.members) {
      out_.documentation(field.documentation);
      out_.line(field.name + ": " + type_text(field.type, Way::received) + ";");
    }
  }
  out_.close();
  out_.gap();
}

void TypeScriptEmitter::emit_constants(const std::string& name, const EntityDefinition& item) {
  const auto constants = all_constants(item);
  if (constants.empty()) return;
  out_.open("export const " + name + " = Object.freeze({");
  for (const auto& constant : constants) {
    out_.documentation(constant.documentation);
    out_.line(constant.name + ": " + typescript_constant(constant, constants) + ",");
  }
  out_.close("});");
}

void TypeScriptEmitter::emit_object(const ServiceDefinition& definition, const EntityDefinition& item) {
  std::string info =
      from_client("ObjectInfo") + "<" + names_.at(item.qualified_name) + ", " + constants_text(definition, item) + ">";
  for (const auto& member : item.members)
    if (contains(implicit_names, member.name))
      info = "{ member(name: \"" + member.name + "\"): " + member_type(member) + " } & " + info;
  out_.line("readonly $: " + info + ";");
  for (const auto& member : item.members) {
    if (contains(implicit_names, member.name)) continue;
    out_.documentation(member.documentation);
    out_.line("readonly " + member.name + ": " + member_type(member) + ";");
  }
}

std::map<std::string, std::string> TypeScriptEmitter::constant_types(std::span<const ConstantDefinition> constants) {
  std::map<std::string, std::string> types;
  for (const auto& constant : constants) {
    int budget = 100;
    types[constant.name] = constant_text(constant, constants, budget);
  }
  return types;
}

std::string TypeScriptEmitter::constants_text(const ServiceDefinition& definition, const EntityDefinition& item) {
  const auto own = constant_types(all_constants(item));
  if (definition_constants_.empty()) return fields_text(own);
  std::string inherited = constants_names_.at(definition.name);
  std::vector<std::string> hidden;
  for (const auto& [name, type] : own)
    if (definition_constants_.contains(name)) hidden.push_back('"' + name + '"');
  if (!hidden.empty()) inherited = "Omit<" + inherited + ", " + joined(hidden, " | ") + ">";
  return own.empty() ? inherited : inherited + " & " + fields_text(own);
}

/// Struct constants may share others again and again: what is written out is bounded.
std::string TypeScriptEmitter::constant_text(const ConstantDefinition& item, std::span<const ConstantDefinition> scope,
                                             int& budget) {
  if (!is_struct_constant(item)) return type_text(item.type, Way::received);
  if (--budget < 0) return from_client("RrValue");
  std::vector<std::string> fields;
  const auto value = value_of(item);
  if (const auto* parts = std::get_if<std::vector<ConstantField>>(&value.data))
    for (const auto& [name, constant] : *parts)
      for (const auto& target : scope)
        if (target.name == constant) fields.push_back("readonly " + name + ": " + constant_text(target, scope, budget));
  return fields.empty() ? "{}" : "{ " + joined(fields, "; ") + " }";
}

std::string TypeScriptEmitter::member_type(const MemberDefinition& member) {
  const auto directed = [&](const std::string& type, std::string_view reading, std::string_view writing) {
    if (member.direction() == MemberDirection::both) return type;
    const auto allowed = member.direction() == MemberDirection::readonly ? reading : writing;
    return "Pick<" + type + ", " + std::string(allowed) + ">";
  };
  switch (member.kind) {
    case MemberKind::property:
      return directed(from_client("PropertyMember") + "<" + both_ways(member.type) + ">", R"("get")", R"("set")");
    case MemberKind::wire:
      return directed(from_client("WireMember") + "<" + both_ways(member.type) + ">", R"("connect" | "peek")",
                      R"("connect" | "peekOut" | "poke")");
    case MemberKind::memory:
      return directed(from_client("MemoryMember") + "<" + type_text(member.type, Way::received) + ">",
                      R"("dimensions" | "read")", R"("dimensions" | "write")");
    case MemberKind::pipe:
      return from_client("PipeMember") + "<" + both_ways(member.type) + ">";
    case MemberKind::event:
      return from_client("EventMember") + "<" + parameters_text(member.parameters, Way::received) + ">";
    case MemberKind::callback:
      return from_client("CallbackMember") + "<" + parameters_text(member.parameters, Way::received) + ", " +
             type_text(member.type, Way::sent) + ">";
    case MemberKind::objref:
      return from_client("ObjRefMember") + "<" + objref_type(member.type) + ">";
    case MemberKind::function:
      break;
    case MemberKind::field:
      return {};
  }
  std::span<const ParameterDefinition> parameters = member.parameters;
  if (!member.is_generator())
    return from_client("FunctionMember") + "<" + parameters_text(parameters, Way::sent) + ", " +
           type_text(member.type, Way::received) + ">";
  std::string next = "void";
  if (const auto* step = member.step_parameter()) {
    next = type_text(step->type, Way::sent);
    parameters = parameters.first(parameters.size() - 1);
  }
  return from_client("GeneratorMember") + "<" + parameters_text(parameters, Way::sent) + ", " +
         type_text(member.type, Way::received) + ", " + next + ">";
}

std::string TypeScriptEmitter::objref_type(const TypeDefinition& type) {
  const auto target = type.type == DataType::varobject_t ? from_client("RemoteObject") : names_.at(type.qualified_name);
  if (type.container == ContainerKind::map_string) return target + ", string";
  const bool is_single = type.container == ContainerKind::none && type.array == ArrayKind::none;
  return target + (is_single ? ", void" : ", number");
}

// --- types of values ---

std::string TypeScriptEmitter::type_text(const TypeDefinition& type, Way way) {
  const auto item = item_text(type, way);
  switch (type.container) {
    case ContainerKind::list:
      return array_of(item) + " | null";
    case ContainerKind::map_int32:
      return "Map<number, " + item + "> | null";
    case ContainerKind::map_string:
      return "Map<string, " + item + "> | null";
    case ContainerKind::none:
    case ContainerKind::generator:
      break;
  }
  return item;
}

/// The type without its container.
std::string TypeScriptEmitter::item_text(const TypeDefinition& type, Way way) {
  if (type.array == ArrayKind::none) return scalar_text(type, way);
  const auto array = array_text(type, way);
  return is_multidim(type) ? from_client("MultiDim") + "<" + array + ">" : array;
}

std::string TypeScriptEmitter::scalar_text(const TypeDefinition& type, Way way) {
  switch (type.type) {
    case DataType::void_t:
      return "void";
    case DataType::int64_t:
    case DataType::uint64_t:
      return "bigint";
    case DataType::bool_t:
      return "boolean";
    case DataType::string_t:
      return "string";
    case DataType::cdouble_t:
    case DataType::csingle_t:
      return from_client("Complex");
    case DataType::varvalue_t:
    case DataType::varobject_t:  // values of unknown type, in compat mode
    case DataType::object_t:
      return from_client("RrValue") + (way == Way::sent ? " | " + from_client("ExactValue") : "");
    case DataType::structure_t:
      return names_.at(type.qualified_name) + " | null";
    case DataType::enum_t:
      return names_.at(type.qualified_name) +
             (way == Way::sent ? " | " + value_names_.at(type.qualified_name) : std::string());
    case DataType::pod_t:
    case DataType::namedarray_t:
      return names_.at(type.qualified_name);
    default:
      return "number";
  }
}

std::string TypeScriptEmitter::array_text(const TypeDefinition& type, Way way) {
  static const std::map<DataType, std::string> typed_arrays = {
      {DataType::double_t, "Float64Array"},  {DataType::single_t, "Float32Array"}, {DataType::int8_t, "Int8Array"},
      {DataType::uint8_t, "Uint8Array"},     {DataType::int16_t, "Int16Array"},    {DataType::uint16_t, "Uint16Array"},
      {DataType::int32_t, "Int32Array"},     {DataType::uint32_t, "Uint32Array"},  {DataType::int64_t, "BigInt64Array"},
      {DataType::uint64_t, "BigUint64Array"}};
  if (const auto found = typed_arrays.find(type.type); found != typed_arrays.end()) return found->second;
  if (type.type == DataType::cdouble_t) return from_client("Complex") + "<Float64Array>";
  if (type.type == DataType::csingle_t) return from_client("Complex") + "<Float32Array>";
  return array_of(scalar_text(type, way));
}

std::string TypeScriptEmitter::both_ways(const TypeDefinition& type) {
  const auto received = type_text(type, Way::received);
  const auto sent = type_text(type, Way::sent);
  return received == sent ? received : received + ", " + sent;
}

std::string TypeScriptEmitter::parameters_text(std::span<const ParameterDefinition> parameters, Way way) {
  std::vector<std::string> items;
  for (const auto& parameter : parameters) {
    const std::string suffix = contains(words_of_the_language, parameter.name) ? "_: " : ": ";
    const std::string prefix = is_digit(parameter.name.front()) ? "p" : "";  // compat mode lets numbers through
    items.push_back(prefix + parameter.name + suffix + type_text(parameter.type, way));
  }
  return "[" + joined(items) + "]";
}

}  // namespace

std::string generate_typescript(const DefinitionSet& set, TypeScriptFlavour flavour) {
  return TypeScriptEmitter(set, flavour).emit();
}

}  // namespace rrgate
