// Everything outside of blocks. Layer: robdef. Source: service definitions spec sections 5.2, 5.3.
#include <utility>

#include <algorithm>

#include "core/robdef/model/names.hpp"
#include "core/robdef/model/version_levels.hpp"
#include "core/robdef/parse/definition_parser.hpp"
#include "core/robdef/parse/statement.hpp"

namespace rr {

namespace {

std::optional<EntityKind> entity_kind(std::string_view keyword) {
  if (keyword == "struct") return EntityKind::structure;
  if (keyword == "pod") return EntityKind::pod;
  if (keyword == "namedarray") return EntityKind::namedarray;
  if (keyword == "object") return EntityKind::object;
  return std::nullopt;
}

}  // namespace

ParseResult DefinitionParser::parse() {
  while (const auto* next = lines_.peek()) {
    switch (next->kind()) {
      case LineKind::documentation:
        documentation_.add(next->text());
        break;
      case LineKind::comment:
        documentation_.drop();
        break;
      case LineKind::blank:
        documentation_.handle_blank();
        break;
      case LineKind::statement:
        parse_top_level(lines_.take());
        continue;
    }
    lines_.take();
  }
  if (!has_service_) {
    reporter_.error("no-service", {1, 0, 0, 0}, "found no statement, expected 'service' and the name of the service");
  }
  if (!stdver_ && option_version_) {
    definition_.version = *option_version_;
    definition_.version_is_option = true;
  }
  return {std::move(definition_), reporter_.take()};
}

void DefinitionParser::parse_top_level(LogicalLine line) {
  const std::string keyword(first_word(line));
  const auto kind = entity_kind(keyword);
  if (line.is_bad()) {
    documentation_.drop();
    has_service_ = has_service_ || keyword == "service";
    if (kind || keyword == "enum") skip_block(line, keyword);
    return;
  }
  StatementReader reader(line, reporter_);
  reader.skip_blanks();
  const auto start = reader.position();
  reader.token();
  if (!has_service_ && keyword != "service") {
    has_service_ = true;
    reader.fail_at(start, reader.position(), "no-service",
                   "found " + quote(keyword) + ", expected 'service' and the name of the service first");
  }
  if (keyword == "service") return parse_service(reader);
  if (keyword == "option") {
    documentation_.drop();
    return parse_option(reader, true, definition_.options);
  }
  if (keyword == "stdver" || keyword == "import" || keyword == "using") documentation_.drop();
  if (keyword == "stdver") return parse_stdver(reader);
  if (keyword == "import") return parse_import(reader);
  if (keyword == "using") return parse_using(reader);
  if (keyword == "exception") return parse_exception(reader);
  if (keyword == "enum") return parse_enum(reader);
  if (kind) return parse_entity(reader, *kind);
  if (keyword == "constant") {
    check_order(reader, keyword, Group::declarations);
    parse_constant_statement(reader, definition_.constants);
    return;
  }
  documentation_.drop();
  reader.fail_at(start, reader.position(), "syntax",
                 "found " + quote(keyword) +
                     ", expected a statement: stdver, import, using, option, exception, constant, enum, struct, pod, "
                     "namedarray or object");
}

bool DefinitionParser::check_order(StatementReader& reader, std::string_view keyword, Group group) {
  if (group >= group_) {
    group_ = group;
    return true;
  }
  constexpr std::string_view names[] = {
      "service", "stdver", "import", "using", "exception, constant and enum", "struct, pod, namedarray and object"};
  return reader.fail_at(reader.position() - keyword.size(), reader.position(), "order",
                        "found " + quote(keyword) + " after " + std::string(names[static_cast<int>(group_)]) +
                            ", expected it before them");
}

void DefinitionParser::parse_service(StatementReader& reader) {
  constexpr std::string_view keyword = "service";
  if (!definition_.name.empty() || group_ != Group::service) {
    documentation_.drop();
    if (!definition_.name.empty()) {
      reader.fail_at(reader.position() - keyword.size(), reader.position(), "order",
                     "found a second 'service', expected one, as the first statement");
    }
    return;
  }
  has_service_ = true;
  definition_.line = reader.line().line();
  definition_.documentation = documentation_.take();
  if (!reader.expect_blank("the name of the service")) return;
  const auto start = reader.position();
  const auto name = reader.token();
  if (!is_qualified_name(name)) {
    reader.fail_at(start, reader.position(), "syntax",
                   "found " + quote(name) + ", expected the name of the service: names joined by dots");
    return;
  }
  if (!reader.expect_end()) return;
  definition_.name = name;
  reporter_.set_service(name);
}

void DefinitionParser::check_version(StatementReader& reader, std::size_t from, const Version& version) {
  if (version <= newest_known) return;
  reader.fail_at(from, reader.position(), "version-too-new",
                 "found version " + format_version(version) + ", expected at most " + format_version(newest_known));
}

void DefinitionParser::parse_stdver(StatementReader& reader) {
  constexpr std::string_view keyword = "stdver";
  const auto keyword_start = reader.position() - keyword.size();
  if (!check_order(reader, keyword, Group::version)) return;
  if (!reader.expect_blank("a version")) return;
  const auto start = reader.position();
  const auto text = reader.token();
  const auto end = reader.position();
  if (!reader.expect_end()) return;
  const auto version = parse_version(text);
  if (!version || *version < first_stdver) {
    reader.fail_at(start, end, "version-format",
                   "found " + quote(text) + ", expected a version of 0.9 or more, such as 0.10");
    return;
  }
  check_version(reader, start, *version);
  if (option_version_) {
    reader.fail_at(keyword_start, end, "version-duplicate",
                   "found 'stdver' beside 'option version', expected one of them");
    return;
  }
  if (stdver_) {
    reporter_.relaxed("version-duplicate", reader.span(keyword_start, end),
                      "found a second 'stdver', expected one; the last one counts");
  }
  stdver_ = *version;
  definition_.version = *version;
  definition_.version_line = reader.line().line();
  if (*version < first_without_options) return;
  for (const auto& span : options_) {
    reporter_.relaxed("option-removed", span,
                      "found 'option' before stdver " + format_version(*version) + ", which has no options");
  }
  options_.clear();
}

void DefinitionParser::parse_option(StatementReader& reader, bool is_top_level, std::vector<OptionDefinition>& out) {
  constexpr std::string_view keyword = "option";
  const auto keyword_span = reader.span(reader.position() - keyword.size(), reader.position());
  if (!reader.expect_blank("the text of the option")) return;
  if (!is_word_character(reader.peek())) {
    reader.fail("the text of the option, which begins with a letter, digit or '_'");
    return;
  }
  const auto start = reader.position();
  auto words = reader;
  const auto first = words.token();
  std::size_t value_start = 0;
  auto value_reader = words;
  const auto value = value_reader.rest(value_start);
  if (stdver_ && *stdver_ >= first_without_options) {
    reporter_.error("option-removed", keyword_span, "found 'option', expected none: it is gone from stdver 0.9.2 on");
    return;
  }
  options_.push_back(keyword_span);
  reporter_.warning("option-deprecated", keyword_span, "'option' is deprecated; stdver 0.9.2 and later have none");
  if (is_top_level && first == "version") parse_option_version(value_reader, value, value_start);
  if (first == "constant") {
    ConstantDefinition constant;
    if (!parse_constant(words, true, constant)) return;
  }
  std::size_t from = start;
  out.push_back({std::string(reader.rest(from)), reader.line().line()});
}

void DefinitionParser::parse_option_version(StatementReader& reader, std::string_view value, std::size_t from) {
  const auto to = from + value.size();
  if (value.empty()) {
    reporter_.relaxed("version-format", reader.span(from, to),
                      "found 'option version' without a version, expected one");
    return;
  }
  const auto version = parse_version(value);
  if (!version) {
    reader.fail_at(from, to, "version-format", "found " + quote(value) + ", expected a version, such as 0.8");
    return;
  }
  if (stdver_ || option_version_) {
    reader.fail_at(from, to, "version-duplicate", "found a second version, expected one");
    return;
  }
  check_version(reader, from, *version);
  option_version_ = *version;
  definition_.version_line = reader.line().line();
}

void DefinitionParser::parse_import(StatementReader& reader) {
  check_order(reader, "import", Group::imports);
  if (!reader.has_room(definition_.imports.size(), max_imports) || !reader.expect_blank("the name of a service"))
    return;
  const auto start = reader.position();
  const auto name = reader.token();
  if (!is_qualified_name(name)) {
    reader.fail_at(start, reader.position(), "syntax", "found " + quote(name) + ", expected the name of a service");
    return;
  }
  if (reader.expect_end()) definition_.imports.push_back({std::string(name), reader.line().line()});
}

void DefinitionParser::parse_using(StatementReader& reader) {
  check_order(reader, "using", Group::usings);
  if (!reader.has_room(definition_.usings.size(), max_imports) || !reader.expect_blank("the qualified name of a type"))
    return;
  const auto start = reader.position();
  const auto name = reader.token();
  if (!is_qualified_name(name) || split_qualified(name).service.empty()) {
    reader.fail_at(start, reader.position(), "syntax",
                   "found " + quote(name) + ", expected the qualified name of a type, such as com.example.Pose");
    return;
  }
  UsingDefinition alias{std::string(name), std::string(split_qualified(name).name), reader.line().line()};
  reader.skip_blanks();
  if (!reader.is_end()) {
    if (reader.peek() != 'a' || reader.word() != "as") {
      reader.fail("'as' and a name, or the end of the statement");
      return;
    }
    const auto blanks = reader.position();
    if (!reader.expect_blank("the name after 'as'")) return;
    if (reader.position() - blanks > 1) {
      reporter_.warning("interop", reader.span(blanks, reader.position()),
                        "found several blanks after 'as', which existing peers refuse");
    }
    if (!reader.expect_word("the name after 'as'", alias.alias) || !reader.expect_end()) return;
  }
  definition_.usings.push_back(std::move(alias));
}

void DefinitionParser::parse_constant_statement(StatementReader& reader, std::vector<ConstantDefinition>& out) {
  ConstantDefinition constant;
  constant.documentation = documentation_.take();
  constant.line = reader.line().line();
  if (parse_constant(reader, false, constant)) out.push_back(std::move(constant));
}

void DefinitionParser::parse_exception(StatementReader& reader) {
  check_order(reader, "exception", Group::declarations);
  ExceptionDefinition exception;
  exception.documentation = documentation_.take();
  exception.line = reader.line().line();
  constexpr std::string_view expected = "the name of the exception";
  if (!reader.expect_blank(expected) || !reader.expect_word(expected, exception.name) || !reader.expect_end()) return;
  definition_.exceptions.push_back(std::move(exception));
}

ParseResult parse_service_definition(std::string_view text, RobdefMode mode, std::string_view file) {
  return DefinitionParser(text, mode, file).parse();
}

bool ParseResult::ok() const {
  return std::none_of(diagnostics.begin(), diagnostics.end(),
                      [](const Diagnostic& diagnostic) { return diagnostic.severity == Severity::error; });
}

}  // namespace rr
