// The statements of a definition, one function each. Layer: robdef. Source: service definitions spec section 5.3.
#pragma once

#include <string>
#include <vector>

#include "core/robdef/model/service_definition.hpp"
#include "core/robdef/parse/statement_reader.hpp"

namespace rr {

// Each reads what follows the statement's keyword. False: reported.

/// field, property, objref, pipe, wire, memory, function, callback, event; `out.kind` is set by the caller.
bool parse_member(StatementReader& reader, MemberDefinition& out);

/// `constant`, and what follows `option constant` where `is_option`: there, compat takes dotted names and makes them
/// names with underscores.
bool parse_constant(StatementReader& reader, bool is_option, ConstantDefinition& out);

/// The constants among options of the old form `option constant TYPE NAME VALUE`. Names written with dots come with
/// underscores. Options that are no such constants, or bad ones, are left out.
std::vector<ConstantDefinition> option_constants(const std::vector<OptionDefinition>& options);

/// One line between the header and the end of an enum.
class EnumReader {
 public:
  explicit EnumReader(EnumDefinition& out) : out_(&out) {}

  /// Reports errors; `documentation` goes to the first value of the line.
  void read_line(StatementReader& reader, std::string documentation);

 private:
  bool read_item(StatementReader& reader, std::string& documentation);
  void count_on(StatementReader& reader, std::size_t start, std::size_t end, EnumValueDefinition& item);

  EnumDefinition* out_;
  bool is_comma_due_ = false;
  bool has_bad_count_ = false;
};

}  // namespace rr
