#include <algorithm>
#include <utility>

#include "core/robdef/model/names.hpp"
#include "core/robdef/model/number_literal.hpp"
#include "core/robdef/parse/constant_check.hpp"
#include "core/robdef/parse/statement.hpp"
#include "core/robdef/parse/type.hpp"

namespace rr {

namespace {

bool parse_parameter(StatementReader& reader, ParameterDefinition& out) {
  if (!parse_type(reader, out.type)) return false;
  if (!reader.expect_blank("the name of the parameter")) return false;
  const auto start = reader.position();
  if (!reader.expect_word("the name of the parameter", out.name)) return false;
  if (!is_name(out.name)) {
    reader.reporter().relaxed("name-invalid", reader.span(start, reader.position()),
                              "found " + quote(out.name) +
                                  ", expected the name of the parameter: a letter, then letters, digits and inner '_'");
  }
  return true;
}

bool parse_parameters(StatementReader& reader, std::vector<ParameterDefinition>& out) {
  reader.skip_blanks();
  if (!reader.accept('(')) return reader.fail("'(' and the parameters");
  reader.skip_blanks();
  if (reader.accept(')')) return true;
  // Room for all at once: "a a," takes 4 bytes, what it becomes 136, and three times that in a growing vector.
  const auto ahead = reader.ahead();
  const auto commas = static_cast<std::size_t>(std::count(ahead.begin(), ahead.end(), ','));
  out.reserve(std::min(commas, ahead.size() / 4) + 1);
  while (true) {
    reader.skip_blanks();
    if (!reader.has_room(out.size(), max_parameters) || !parse_parameter(reader, out.emplace_back())) return false;
    reader.skip_blanks();
    if (reader.accept(')')) return true;
    if (!reader.accept(',')) return reader.fail("',' or ')'");
  }
}

/// Reads `(a, b)` into `out`; its text is kept, but without the blanks that the reference refuses.
bool parse_modifier_arguments(StatementReader& reader, Modifier& out) {
  out.text += '(';
  auto kept = reader.position();
  while (true) {
    reader.skip_blanks();
    const auto start = reader.position();
    while (!reader.is_end() && !is_blank(reader.peek()) && reader.peek() != ',' && reader.peek() != ')') {
      reader.accept(reader.peek());
    }
    const auto end = reader.position();
    const auto argument = reader.text(start, end);
    if (!is_number_literal(argument) && !is_name(argument)) {
      return reader.fail_at(start, end, "syntax",
                            "found " + (argument.empty() ? std::string("no argument") : quote(argument)) +
                                ", expected a number or the name of a constant");
    }
    out.arguments.emplace_back(argument);
    const bool has_blanks = reader.skip_blanks();
    if (has_blanks && reader.peek() == ',' && out.arguments.size() > 1) {
      reader.reporter().warning("interop", reader.span(end, reader.position()),
                                "found a blank before a later ',' of the arguments, which existing peers refuse");
      out.text += reader.text(kept, end);
      kept = reader.position();
    }
    const bool is_last = reader.accept(')');
    if (!is_last && !reader.accept(',')) return reader.fail("',' or ')'");
    if (!is_last) continue;
    out.text += reader.text(kept, reader.position());
    return true;
  }
}

bool parse_modifier(StatementReader& reader, Modifier& out) {
  const auto start = reader.position();
  const auto word = reader.word();
  if (!is_name(word)) {
    if (word.empty()) return reader.fail("a modifier");
    return reader.fail_at(start, reader.position(), "syntax",
                          "found " + quote(word) + ", expected the name of a modifier");
  }
  out.name = word;
  out.text = word;
  return !reader.accept('(') || parse_modifier_arguments(reader, out);
}

bool parse_modifiers(StatementReader& reader, std::vector<Modifier>& out) {
  reader.accept('[');
  while (true) {
    reader.skip_blanks();
    if (!parse_modifier(reader, out.emplace_back())) return false;
    auto blank = reader.position();
    bool has_blank = reader.skip_blanks();
    if (reader.accept(',')) {
      blank = reader.position();
      has_blank = reader.skip_blanks();
      if (reader.peek() != ']') continue;
    }
    if (!reader.accept(']')) return reader.fail("',' or ']'");
    if (has_blank) {
      reader.reporter().warning("interop", reader.span(blank, reader.position() - 1),
                                "found a blank before ']', which existing peers refuse");
    }
    return true;
  }
}

}  // namespace

bool parse_member(StatementReader& reader, MemberDefinition& out) {
  const bool has_type = out.kind != MemberKind::event;
  const bool has_parameters =
      out.kind == MemberKind::function || out.kind == MemberKind::callback || out.kind == MemberKind::event;
  if (has_type) {
    if (!reader.expect_blank(has_parameters ? "a return type" : "a type")) return false;
    if (!parse_type(reader, out.type)) return false;
  }
  if (!reader.expect_blank("the name of the member")) return false;
  if (!reader.expect_word("the name of the member", out.name)) return false;
  if (has_parameters && !parse_parameters(reader, out.parameters)) return false;
  if (reader.is_end()) return true;
  if (!is_blank(reader.peek())) {
    return reader.fail(reader.peek() == '[' ? "a blank before the modifiers" : "the end of the statement or modifiers");
  }
  reader.skip_blanks();
  if (reader.peek() == '[' && !parse_modifiers(reader, out.modifiers)) return false;
  return reader.expect_end(out.modifiers.empty() ? "the end of the statement or modifiers"
                                                 : "the end of the statement");
}

bool parse_constant(StatementReader& reader, bool is_option, ConstantDefinition& out) {
  if (!reader.expect_blank("the type of the constant")) return false;
  const auto type_start = reader.position();
  if (!parse_type(reader, out.type)) return false;
  const auto type_end = reader.position();
  if (!reader.expect_blank("the name of the constant")) return false;
  const auto name_start = reader.position();
  const auto name = is_option ? reader.dotted_word() : reader.word();
  if (name.empty()) return reader.fail("the name of the constant");
  out.name = name;
  if (name.find('.') != std::string_view::npos) {
    for (auto& c : out.name) c = c == '.' ? '_' : c;
    const bool is_compat = reader.reporter().is_compat();
    reader.reporter().relaxed(is_compat ? "legacy-syntax" : "name-invalid", reader.span(name_start, reader.position()),
                              "found the name " + quote(name) + " with dots, expected " + quote(out.name));
  }
  if (!reader.expect_blank("the value of the constant")) return false;
  std::size_t value_start = 0;
  out.value_text = reader.rest(value_start);
  if (is_option && !out.type.name.empty()) {
    return reader.fail_at(
        type_start, type_end, "constant-invalid",
        "found " + quote(out.type.name) + ", expected a number type or string after 'option constant'");
  }
  return check_constant(reader, out, {type_start, type_end, value_start});
}

std::vector<ConstantDefinition> option_constants(const std::vector<OptionDefinition>& options) {
  std::vector<ConstantDefinition> constants;
  for (const auto& option : options) {
    constexpr std::string_view keyword = "constant";
    const std::string_view text = option.text;
    if (!text.starts_with(keyword) || text.size() == keyword.size() || !is_blank(text[keyword.size()])) continue;
    Reporter quiet(RobdefMode::compat, {});
    const LogicalLine line(LineKind::statement, text, option.line, 1);
    StatementReader reader(line, quiet, keyword.size());
    ConstantDefinition constant;
    constant.line = option.line;
    if (parse_constant(reader, true, constant)) constants.push_back(std::move(constant));
  }
  return constants;
}

}  // namespace rr
