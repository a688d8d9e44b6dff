// From text to ServiceDefinition: the order of statements, blocks, documentation, versions, recovery. Layer: robdef.
// Source: service definitions spec sections 5.1, 5.2, 5.3, 5.8, 5.11.
#include "core/robdef/parser.hpp"

#include <optional>
#include <utility>

#include "core/robdef/documentation.hpp"
#include "core/robdef/lexer.hpp"
#include "core/robdef/names.hpp"
#include "core/robdef/parse_type.hpp"

namespace rr {

namespace {

constexpr Version first_stdver{0, 9, 0, 0};
constexpr Version first_without_options{0, 9, 2, 0};
constexpr Version newest_known{1, 2, 8, 0};

/// Statements outside of blocks stand in this order.
enum class Group : std::uint8_t { service, version, imports, usings, declarations, entities };

std::optional<EntityKind> entity_kind(std::string_view keyword) {
  if (keyword == "struct") return EntityKind::structure;
  if (keyword == "pod") return EntityKind::pod;
  if (keyword == "namedarray") return EntityKind::namedarray;
  if (keyword == "object") return EntityKind::object;
  return std::nullopt;
}

std::optional<MemberKind> member_kind(std::string_view keyword) {
  for (const auto kind : {MemberKind::field, MemberKind::property, MemberKind::function, MemberKind::event,
                          MemberKind::objref, MemberKind::pipe, MemberKind::callback, MemberKind::wire,
                          MemberKind::memory}) {
    if (member_kind_name(kind) == keyword) return kind;
  }
  return std::nullopt;
}

std::string_view first_word(const LogicalLine& line) {
  const auto text = trim_blanks(line.text());
  return text.substr(0, std::min(text.find_first_of(" \t"), text.size()));
}

class Parser {
 public:
  Parser(std::string_view text, RobdefMode mode, std::string_view file) : reporter_(mode, file), lines_(text, reporter_) {
    definition_.text = text;
    definition_.file = file;
  }

  ParseResult parse();

 private:
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
  void parse_body_line(LogicalLine line, EntityDefinition& entity);
  void check_version(StatementReader& reader, std::size_t from, const Version& version);

  /// Calls `handle(LogicalLine)` for each statement up to the end of the block.
  template <class Handle>
  void parse_block(const LogicalLine& header, std::string_view keyword, bool is_header_good, const Handle& handle);
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

ParseResult Parser::parse() {
  while (const auto* next = lines_.peek()) {
    switch (next->kind()) {
      case LineKind::documentation: documentation_.add(next->text()); break;
      case LineKind::comment: documentation_.drop(); break;
      case LineKind::blank: documentation_.handle_blank(); break;
      case LineKind::statement: parse_top_level(lines_.take()); continue;
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

void Parser::parse_top_level(LogicalLine line) {
  const std::string keyword(first_word(line));
  const auto kind = entity_kind(keyword);
  if (line.is_bad()) {
    documentation_.drop();
    has_service_ = has_service_ || keyword == "service";
    if (kind || keyword == "enum") parse_block(line, keyword, false, [](LogicalLine) {});
    return;
  }
  StatementReader reader(line, reporter_);
  reader.skip_blanks();
  const auto start = reader.position();
  reader.token();
  if (!has_service_ && keyword != "service") {
    has_service_ = true;
    reader.fail_at(start, reader.position(), "no-service",
                   "found " + quoted(keyword) + ", expected 'service' and the name of the service first");
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
    ConstantDefinition constant;
    constant.documentation = documentation_.take();
    constant.line = line.line();
    if (parse_constant(reader, false, constant)) definition_.constants.push_back(std::move(constant));
    return;
  }
  documentation_.drop();
  reader.fail_at(start, reader.position(), "syntax",
                 "found " + quoted(keyword) +
                     ", expected a statement: stdver, import, using, option, exception, constant, enum, struct, pod, "
                     "namedarray or object");
}

bool Parser::check_order(StatementReader& reader, std::string_view keyword, Group group) {
  if (group >= group_) {
    group_ = group;
    return true;
  }
  constexpr std::string_view names[] = {"service", "stdver", "import", "using", "exception, constant and enum",
                                        "struct, pod, namedarray and object"};
  return reader.fail_at(reader.position() - keyword.size(), reader.position(), "order",
                        "found " + quoted(keyword) + " after " + std::string(names[static_cast<int>(group_)]) +
                            ", expected it before them");
}

void Parser::parse_service(StatementReader& reader) {
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
                   "found " + quoted(name) + ", expected the name of the service: names joined by dots");
    return;
  }
  if (!reader.expect_end()) return;
  definition_.name = name;
  reporter_.set_service(name);
}

void Parser::check_version(StatementReader& reader, std::size_t from, const Version& version) {
  if (version <= newest_known) return;
  reader.fail_at(from, reader.position(), "version-too-new",
                 "found version " + format_version(version) + ", expected at most " + format_version(newest_known));
}

void Parser::parse_stdver(StatementReader& reader) {
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
                   "found " + quoted(text) + ", expected a version of 0.9 or more, such as 0.10");
    return;
  }
  check_version(reader, start, *version);
  if (option_version_) {
    reader.fail_at(keyword_start, end, "version-duplicate", "found 'stdver' beside 'option version', expected one of them");
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

void Parser::parse_option(StatementReader& reader, bool is_top_level, std::vector<OptionDefinition>& out) {
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
    reporter_.error("option-removed", keyword_span,
                    "found 'option', expected none: it is gone from stdver 0.9.2 on");
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

void Parser::parse_option_version(StatementReader& reader, std::string_view value, std::size_t from) {
  const auto to = from + value.size();
  if (value.empty()) {
    reporter_.relaxed("version-format", reader.span(from, to), "found 'option version' without a version, expected one");
    return;
  }
  const auto version = parse_version(value);
  if (!version) {
    reader.fail_at(from, to, "version-format", "found " + quoted(value) + ", expected a version, such as 0.8");
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

void Parser::parse_import(StatementReader& reader) {
  check_order(reader, "import", Group::imports);
  if (!reader.expect_blank("the name of a service")) return;
  const auto start = reader.position();
  const auto name = reader.token();
  if (!is_qualified_name(name)) {
    reader.fail_at(start, reader.position(), "syntax", "found " + quoted(name) + ", expected the name of a service");
    return;
  }
  if (reader.expect_end()) definition_.imports.push_back({std::string(name), reader.line().line()});
}

void Parser::parse_using(StatementReader& reader) {
  check_order(reader, "using", Group::usings);
  if (!reader.expect_blank("the qualified name of a type")) return;
  const auto start = reader.position();
  const auto name = reader.token();
  if (!is_qualified_name(name) || split_qualified(name).service.empty()) {
    reader.fail_at(start, reader.position(), "syntax",
                   "found " + quoted(name) + ", expected the qualified name of a type, such as com.example.Pose");
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

void Parser::parse_exception(StatementReader& reader) {
  check_order(reader, "exception", Group::declarations);
  ExceptionDefinition exception;
  exception.documentation = documentation_.take();
  exception.line = reader.line().line();
  constexpr std::string_view expected = "the name of the exception";
  if (!reader.expect_blank(expected) || !reader.expect_word(expected, exception.name) || !reader.expect_end()) return;
  definition_.exceptions.push_back(std::move(exception));
}

void Parser::parse_enum(StatementReader& reader) {
  check_order(reader, "enum", Group::declarations);
  EnumDefinition enumeration;
  enumeration.documentation = documentation_.take();
  enumeration.line = reader.line().line();
  constexpr std::string_view expected = "the name of the enum";
  const bool is_good =
      reader.expect_blank(expected) && reader.expect_word(expected, enumeration.name) && reader.expect_end();
  EnumReader values(enumeration);
  parse_block(reader.line(), "enum", is_good, [&](LogicalLine line) {
    auto documentation = documentation_.take();
    if (line.is_bad()) return;
    StatementReader item(line, reporter_);
    values.read_line(item, std::move(documentation));
  });
  definition_.enums.push_back(std::move(enumeration));
}

void Parser::parse_entity(StatementReader& reader, EntityKind kind) {
  const std::string keyword(trim_blanks(reader.text(0, reader.position())));
  check_order(reader, keyword, Group::entities);
  EntityDefinition entity;
  entity.kind = kind;
  entity.documentation = documentation_.take();
  entity.line = reader.line().line();
  const auto expected = "the name of the " + keyword;
  const bool is_good = reader.expect_blank(expected) && reader.expect_word(expected, entity.name) && reader.expect_end();
  parse_block(reader.line(), keyword, is_good,
              [&](LogicalLine line) { parse_body_line(std::move(line), entity); });
  definition_.entities.push_back(std::move(entity));
}

template <class Handle>
void Parser::parse_block(const LogicalLine& header, std::string_view keyword, bool is_header_good,
                         const Handle& handle) {
  while (const auto* next = lines_.peek()) {
    const auto kind = next->kind();
    if (kind == LineKind::statement) {
      const auto word = first_word(*next);
      if (word == "end") {
        const auto line = lines_.take();
        documentation_.drop();
        if (!line.is_bad()) parse_end(line, is_header_good ? keyword : std::string_view());
        return;
      }
      // In an enum the reserved words may also be what someone tried as the name of a value.
      const auto rest = trim_blanks(trim_blanks(next->text()).substr(word.size()));
      const bool is_header = is_top_level_keyword(word) && (keyword != "enum" || (!rest.empty() && is_letter(rest[0])));
      if (is_header) break;
      auto line = lines_.take();
      if (is_header_good) handle(std::move(line));
      continue;
    }
    if (kind == LineKind::documentation) {
      documentation_.add(next->text());
      if (next->text().ends_with('\\')) {
        const auto size = next->text().size();
        reporter_.warning("interop", next->span(size - 1, size),
                          "found '\\' at the end of documentation; existing peers lose the line after it");
      }
    } else {
      documentation_.handle_blank();
    }
    lines_.take();
  }
  documentation_.drop();
  if (!is_header_good) return;
  reporter_.error("unclosed-block", header.span(header.text().find_first_not_of(" \t"), header.text().size()),
                  "found no 'end' for this " + std::string(keyword) + ", expected one");
}

void Parser::parse_end(const LogicalLine& line, std::string_view keyword) {
  StatementReader reader(line, reporter_);
  reader.skip_blanks();
  reader.token();
  reader.skip_blanks();
  if (reader.is_end() || keyword.empty()) return;
  const auto start = reader.position();
  const auto word = reader.token();
  const bool may_have_word = !stdver_ || *stdver_ < first_without_options;
  if (!may_have_word) {
    reader.fail_at(start, reader.position(), "end-word",
                   "found " + quoted(word) + " after 'end', expected nothing: from stdver 0.9.2 on it stands alone");
  } else if (word != keyword) {
    reader.fail_at(start, reader.position(), "end-word",
                   "found " + quoted(word) + " after 'end', expected nothing or " + quoted(keyword));
  } else {
    reader.expect_end();
  }
}

void Parser::parse_body_line(LogicalLine line, EntityDefinition& entity) {
  const std::string keyword(first_word(line));
  const auto kind = member_kind(keyword);
  const bool is_object = entity.kind == EntityKind::object;
  if (line.is_bad()) return documentation_.drop();
  const bool is_wrapped = is_object && join_wrapped_parameters(line);
  if (line.is_bad() || (is_wrapped && !reporter_.is_compat())) return documentation_.drop();
  StatementReader reader(line, reporter_);
  reader.skip_blanks();
  const auto start = reader.position();
  reader.token();
  if (keyword == "option") {
    documentation_.drop();
    return parse_option(reader, false, entity.options);
  }
  const auto check_before_members = [&] {
    if (entity.members.empty()) return;
    reader.fail_at(start, reader.position(), "order",
                   "found " + quoted(keyword) + " after a member, expected it before the first one");
  };
  if (keyword == "constant") {
    check_before_members();
    ConstantDefinition constant;
    constant.documentation = documentation_.take();
    constant.line = line.line();
    if (parse_constant(reader, false, constant)) entity.constants.push_back(std::move(constant));
    return;
  }
  if (keyword == "implements" && is_object) {
    documentation_.drop();
    check_before_members();
    if (!reader.expect_blank("the name of an object type")) return;
    const auto name_start = reader.position();
    const auto name = reader.token();
    if (!is_qualified_name(name)) {
      reader.fail_at(name_start, reader.position(), "syntax",
                     "found " + quoted(name) + ", expected the name of an object type");
      return;
    }
    if (reader.expect_end()) entity.implements.push_back({std::string(name), {}, line.line()});
    return;
  }
  if (!kind || (*kind == MemberKind::field) == is_object) {
    documentation_.drop();
    // `event` is followed by its name, which the keyword's token may run into: "event(".
    reader.fail_at(start, reader.position(), "syntax",
                   "found " + quoted(keyword) +
                       (is_object ? ", expected a member: property, function, event, objref, pipe, callback, wire, "
                                    "memory; or implements, constant, option, end"
                                  : ", expected field, constant, option or end"));
    return;
  }
  MemberDefinition member;
  member.kind = *kind;
  member.documentation = documentation_.take();
  member.line = line.line();
  if (parse_member(reader, member)) entity.members.push_back(std::move(member));
}

/// Parameter lists that run on without '\', as in the 2016 paper: joins the lines; strict reports them.
bool Parser::join_wrapped_parameters(LogicalLine& line) {
  const auto keyword = first_word(line);
  if (keyword != "function" && keyword != "event" && keyword != "callback") return false;
  const auto open = line.text().find('(');
  if (open == std::string_view::npos || line.text().find(')', open) != std::string_view::npos) return false;
  const auto end = line.text().size();
  bool is_wrapped = false;
  while (const auto* next = lines_.peek()) {
    if (next->kind() != LineKind::statement || is_statement_keyword(first_word(*next))) break;
    const auto more = lines_.take();
    if (!is_wrapped) {
      constexpr std::string_view message = "the parameters run on in the next line, expected '\\' at the end of this one";
      const auto span = line.span(open, end);
      reporter_.relaxed(reporter_.is_compat() ? "legacy-syntax" : "syntax", span, std::string(message));
    }
    is_wrapped = true;
    line.join(more);
    if (more.text().find(')') != std::string_view::npos) break;
  }
  return is_wrapped;
}

}  // namespace

ParseResult parse_service_definition(std::string_view text, RobdefMode mode, std::string_view file) {
  return Parser(text, mode, file).parse();
}

}  // namespace rr
