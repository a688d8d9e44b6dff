// Reads a whole definition: the order of statements, versions, blocks, documentation, recovery. Layer: robdef.
// Source: service definitions spec sections 5.1, 5.2, 5.3, 5.8, 5.11.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/robdef/parse/documentation.hpp"
#include "core/robdef/parse/lexer.hpp"
#include "core/robdef/parse/parse.hpp"
#include "core/robdef/parse/statement_reader.hpp"

namespace rr {

/// The first word of the line; may be empty.
std::string_view first_word(const LogicalLine& line);

/// One text, one use.
class DefinitionParser {
 public:
  DefinitionParser(std::string_view text, RobdefMode mode, std::string_view file)
      : reporter_(mode, file), lines_(text, reporter_) {
    definition_.text = text;
    definition_.file = file;
  }

  ParseResult parse();

 private:
  /// Statements outside of blocks stand in this order.
  enum class Group : std::uint8_t { service, version, imports, usings, declarations, entities };

  void parse_top_level(LogicalLine line);
  bool check_order(StatementReader& reader, std::string_view keyword, Group group);
  void parse_service(StatementReader& reader);
  void parse_stdver(StatementReader& reader);
  void parse_option_version(StatementReader& reader, std::string_view value, std::size_t from);
  void parse_option(StatementReader& reader, bool is_top_level, std::vector<OptionDefinition>& out);
  void parse_import(StatementReader& reader);
  void parse_using(StatementReader& reader);
  void parse_exception(StatementReader& reader);
  void parse_enum(StatementReader& reader);
  void parse_entity(StatementReader& reader, EntityKind kind);
  void parse_constant_statement(StatementReader& reader, std::vector<ConstantDefinition>& out);
  void parse_implements(StatementReader& reader, EntityDefinition& entity);
  void parse_body_line(LogicalLine line, EntityDefinition& entity);
  void check_version(StatementReader& reader, std::size_t from, const Version& version);

  /// Calls `handle(LogicalLine)` for each statement up to the end of the block.
  template <class Handle>
  void parse_block(const LogicalLine& header, std::string_view keyword, bool is_header_good, const Handle& handle);
  void skip_block(const LogicalLine& header, std::string_view keyword);
  void parse_end(const LogicalLine& line, std::string_view keyword);
  bool join_wrapped_parameters(LogicalLine& line);

  Reporter reporter_;
  LineReader lines_;
  ServiceDefinition definition_ = {};
  Documentation documentation_ = {};
  Group group_ = Group::service;
  bool has_service_ = false;
  std::optional<Version> stdver_ = {};
  std::optional<Version> option_version_ = {};
  /// Options met so far: a later `stdver` may forbid them.
  std::vector<SourceSpan> options_ = {};
};

}  // namespace rr
