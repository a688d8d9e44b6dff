#include "node/generate/cpp_types.hpp"

#include <algorithm>

#include "core/robdef/model/names.hpp"
#include "core/types/multidim.hpp"
#include "node/generate/constant_literal.hpp"
#include "node/generate/cpp_taken_names.hpp"
#include "node/generate/source_writer.hpp"

namespace rrgate {

using namespace rr;

namespace {

constexpr std::string_view words[] = {
    "alignas", "alignof", "and", "and_eq", "asm", "auto", "bitand", "bitor", "bool", "break", "case", "catch", "char",
    "char16_t", "char32_t", "char8_t", "class", "co_await", "co_return", "co_yield", "compl", "concept", "const",
    "const_cast", "consteval", "constexpr", "constinit", "continue", "decltype", "default", "delete", "do", "double",
    "dynamic_cast", "else", "enum", "explicit", "export", "extern", "false", "float", "for", "friend", "goto", "if",
    "inline", "int", "long", "mutable", "namespace", "new", "noexcept", "not", "not_eq", "nullptr", "operator", "or",
    "or_eq", "private", "protected", "public", "register", "reinterpret_cast", "requires", "return", "short", "signed",
    "sizeof", "static", "static_assert", "static_cast", "struct", "switch", "template", "this", "thread_local", "throw",
    "true", "try", "typedef", "typeid", "typename", "union", "unsigned", "using", "virtual", "void", "volatile",
    "wchar_t", "while", "xor", "xor_eq",
    // the two namespaces that generated code names, and macros of headers that it does not include by itself
    "rr", "std", "major", "makedev", "minor", "stderr", "stdin", "stdout"};

/// [n] is a std::array up to this many items: it lies where the value lies, which may be the stack.
constexpr std::int32_t max_array_items = 1024;
/// Zeros that a default value may hold.
constexpr std::uint64_t max_default_items = 1 << 20;

bool has_name(const ServiceDefinition& definition, std::string_view name) {
  const auto constants = all_constants(definition);
  return definition.find_entity(name) || definition.find_enum(name) || definition.find_exception(name) ||
         std::any_of(constants.begin(), constants.end(), [&](const auto& item) { return item.name == name; });
}

/// "varvalue[]" of compat mode is any value.
TypeDefinition as_held(TypeDefinition type) {
  if (type.type == DataType::varvalue_t || type.type == DataType::varobject_t || type.type == DataType::object_t)
    type.array = ArrayKind::none;
  return type;
}

template <class Convert>
std::vector<std::string> segments_of(std::string_view service, Convert convert) {
  std::vector<std::string> segments;
  for (std::size_t at = 0; at <= service.size();) {
    const auto end = std::min(service.find('.', at), service.size());
    segments.push_back(convert(service.substr(at, end - at)));
    at = end + 1;
  }
  return segments;
}

}  // namespace

std::string cpp_word(std::string_view name) {
  const bool is_taken = is_macro(name) || std::find(std::begin(words), std::end(words), name) != std::end(words);
  return std::string(name) + (is_taken ? "_" : "");
}

std::string cpp_namespace(std::string_view service) {
  auto segments = segments_of(service, cpp_word);
  if (is_global(segments.front())) segments.front() += '_';
  return joined(segments, "::");
}

std::string cpp_file_name(std::string_view service) {
  return joined(segments_of(service, [](std::string_view segment) { return std::string(segment); }), "__");
}

void CppTypes::enter(std::string class_name) {
  class_name_ = std::move(class_name);
}

std::string CppTypes::parameter_name(std::string_view name) const {
  // Compat mode lets numbers through as names.
  const auto chosen = (is_digit(name.front()) ? "p" : "") + cpp_word(name);
  // The types of later parameters would be looked up in it.
  return chosen + (has_name(definition_, chosen) ? "_" : "");
}

std::string CppTypes::member_name(std::string_view name) const {
  // What is called like its class would be a constructor.
  const auto chosen = cpp_word(name);
  return chosen + (chosen == class_name_ ? "_" : "");
}

std::string CppTypes::constant_name(std::string_view name) const {
  return class_name_.empty() ? declared_name(definition_.name + '.' + std::string(name)) : member_name(name);
}

std::string CppTypes::declared_name(std::string_view qualified_name, std::string_view suffix) const {
  const auto [service, name] = split_qualified(qualified_name);
  auto chosen = cpp_word(std::string(name) + std::string(suffix));
  const auto* definition = set_.find_service(service);
  // Classes that are made from an object's name give way to names of the definition, and to the object's members, which
  // have the same name in all classes; all do to inner namespaces.
  const auto is_taken = [&, service = service, name = name] {  // clang 14 captures no bindings by itself
    if (set_.has_service_within(std::string(service) + '.' + chosen)) return true;
    if (suffix.empty() || !definition) return false;
    const auto* object = definition->find_entity(name);
    return has_name(*definition, chosen) || (object && object->find_member(chosen)) ||
           (suffix == "AsyncClient" && has_name(*definition, std::string(name) + "Async"));
  };
  while (is_taken()) chosen += '_';
  return chosen;
}

std::string CppTypes::name(std::string_view qualified_name, std::string_view suffix) const {
  const auto service = split_qualified(qualified_name).service;
  const auto declared = declared_name(qualified_name, suffix);
  // In a class, its members and those of its bases hide the names of the namespace.
  if (service == definition_.name && class_name_.empty()) return declared;
  return "::" + cpp_namespace(service) + "::" + declared;
}

std::string CppTypes::value(const TypeDefinition& given) const {
  const auto type = as_held(given);
  const auto item = scalar(type);
  std::string array = item;
  if (is_multidim(type)) {
    array = "rr::MultiDim<" + item + ">";
  } else if (type.array == ArrayKind::fixed && type.sizes.front() <= max_array_items) {
    array = "std::array<" + item + ", " + std::to_string(type.sizes.front()) + ">";
  } else if (type.array != ArrayKind::none) {
    array = "std::vector<" + item + ">";
  }
  switch (type.container) {
    case ContainerKind::list:
      return "rr::Nullable<std::vector<" + array + ">>";
    case ContainerKind::map_int32:
      return "rr::Nullable<std::map<std::int32_t, " + array + ">>";
    case ContainerKind::map_string:
      return "rr::Nullable<std::map<std::string, " + array + ">>";
    case ContainerKind::none:
    case ContainerKind::generator:
      break;
  }
  return array;
}

std::string CppTypes::scalar(const TypeDefinition& type) const {
  switch (type.type) {
    case DataType::void_t:
      return "void";
    case DataType::double_t:
      return "double";
    case DataType::single_t:
      return "float";
    case DataType::bool_t:
      return "bool";
    case DataType::cdouble_t:
      return "rr::CDouble";
    case DataType::csingle_t:
      return "rr::CSingle";
    case DataType::string_t:
      return "std::string";
    case DataType::varvalue_t:
    case DataType::varobject_t:  // values of unknown type, in compat mode
    case DataType::object_t:
      return "rr::Value";
    case DataType::structure_t:
      return "rr::Nullable<" + type_name(type.qualified_name) + ">";
    case DataType::enum_t:
    case DataType::pod_t:
    case DataType::namedarray_t:
      return type_name(type.qualified_name);
    default:
      return "std::" + std::string(data_type_name(type.type)) + "_t";
  }
}

std::string CppTypes::field(const TypeDefinition& type, std::string_view name) const {
  return value(type) + ' ' + std::string(name) + default_value(type);
}

std::string CppTypes::default_value(const TypeDefinition& given) const {
  const auto type = as_held(given);
  if (type.container != ContainerKind::none) return " = {}";
  if (type.array == ArrayKind::none) {
    if (type.type == DataType::bool_t) return " = false";
    if (type.type == DataType::enum_t) {
      const auto [service, name] = split_qualified(type.qualified_name);
      const auto* item = set_.find_service(service)->find_enum(name);
      if (!item->values.empty()) return " = " + scalar(type) + "::" + cpp_word(item->values.front().name);
    }
    return is_numeric(type.type) && type.type != DataType::cdouble_t && type.type != DataType::csingle_t ? " = 0"
                                                                                                         : " = {}";
  }
  const auto product = product_of(std::span<const std::int32_t>(type.sizes));
  if (!product || *product > max_default_items) return " = {}";
  const auto zeros = "std::vector<" + scalar(type) + ">(" + std::to_string(*product) + ")";
  if (type.array == ArrayKind::fixed && type.sizes.front() > max_array_items) return " = " + zeros;
  if (type.array != ArrayKind::fixed_multidim) return " = {}";
  std::vector<std::string> sizes;
  for (const auto size : type.sizes) sizes.push_back(std::to_string(size));
  return " = {{" + joined(sizes) + "}, " + zeros + "}";
}

}  // namespace rrgate
