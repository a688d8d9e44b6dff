// How names and types of definitions are called in C++. Layer: definitions.
// Source: service definitions spec sections 5.9 (identifiers), 5.12.
#pragma once

#include <string>
#include <string_view>

#include "node/generate/definition_set.hpp"

namespace rrgate {

/// With a '_' behind words of C++ and macros of its library.
std::string cpp_word(std::string_view name);
/// "com::example::robot"; a first word that is one of the C library gets a '_', too.
std::string cpp_namespace(std::string_view service);
/// "com__example__robot".
std::string cpp_file_name(std::string_view service);

/// Names as they are in the namespace of a definition, or in one of its classes.
class CppTypes {
 public:
  CppTypes(const DefinitionSet& set, const rr::ServiceDefinition& definition) : set_(set), definition_(definition) {}

  /// From now on inside the class that is declared by this name; empty: in the namespace.
  void enter(std::string class_name);

  /// A type as a value is held: "std::vector<double>".
  std::string value(const rr::TypeDefinition& type) const;
  /// A field with its default: "double x = 0".
  std::string field(const rr::TypeDefinition& type, std::string_view name) const;

  /// The class of a type or constant of the definition, or of another one: with its namespace where it needs that.
  std::string type_name(std::string_view qualified_name) const { return name(qualified_name, {}); }
  std::string client_name(std::string_view qualified_name) const { return name(qualified_name, "Client"); }
  std::string async_client_name(std::string_view qualified_name) const { return name(qualified_name, "AsyncClient"); }
  std::string service_name(std::string_view qualified_name) const { return name(qualified_name, "Service"); }
  /// The same, without namespace: as it is declared.
  std::string declared_name(std::string_view qualified_name, std::string_view suffix = {}) const;
  /// A member of the class that was entered.
  std::string member_name(std::string_view name) const;
  /// A constant of the class that was entered, or of the definition.
  std::string constant_name(std::string_view name) const;
  std::string parameter_name(std::string_view name) const;

 private:
  std::string name(std::string_view qualified_name, std::string_view suffix) const;
  std::string scalar(const rr::TypeDefinition& type) const;
  std::string default_value(const rr::TypeDefinition& type) const;

  const DefinitionSet& set_;
  const rr::ServiceDefinition& definition_;
  std::string class_name_ = {};
};

}  // namespace rrgate
