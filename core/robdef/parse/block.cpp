// Enums, structs, pods, namedarrays and objects, up to their `end`. Layer: robdef.
// Source: service definitions spec sections 5.1, 5.3, 5.8, 5.11.
#include <optional>
#include <utility>

#include "core/robdef/model/names.hpp"
#include "core/robdef/model/version_levels.hpp"
#include "core/robdef/parse/definition_parser.hpp"
#include "core/robdef/parse/statement.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

std::optional<MemberKind> member_kind(std::string_view keyword) {
  for (const auto kind :
       {MemberKind::field, MemberKind::property, MemberKind::function, MemberKind::event, MemberKind::objref,
        MemberKind::pipe, MemberKind::callback, MemberKind::wire, MemberKind::memory}) {
    if (member_kind_name(kind) == keyword) return kind;
  }
  return std::nullopt;
}

}  // namespace

std::string_view first_word(const LogicalLine& line) {
  const auto text = trim(line.text());
  return text.substr(0, std::min(text.find_first_of(" \t"), text.size()));
}

void DefinitionParser::parse_enum(StatementReader& reader) {
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

void DefinitionParser::parse_entity(StatementReader& reader, EntityKind kind) {
  const std::string keyword(trim(reader.text(0, reader.position())));
  check_order(reader, keyword, Group::entities);
  EntityDefinition entity;
  entity.kind = kind;
  entity.documentation = documentation_.take();
  entity.line = reader.line().line();
  const auto expected = "the name of the " + keyword;
  const bool is_good =
      reader.expect_blank(expected) && reader.expect_word(expected, entity.name) && reader.expect_end();
  parse_block(reader.line(), keyword, is_good, [&](LogicalLine line) { parse_body_line(std::move(line), entity); });
  definition_.entities.push_back(std::move(entity));
}

template <class Handle>
void DefinitionParser::parse_block(const LogicalLine& header, std::string_view keyword, bool is_header_good,
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
      const auto rest = trim(trim(next->text()).substr(word.size()));
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

void DefinitionParser::skip_block(const LogicalLine& header, std::string_view keyword) {
  parse_block(header, keyword, false, [](LogicalLine) {});
}

void DefinitionParser::parse_end(const LogicalLine& line, std::string_view keyword) {
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
                   "found " + quote(word) + " after 'end', expected nothing: from stdver 0.9.2 on it stands alone");
  } else if (word != keyword) {
    reader.fail_at(start, reader.position(), "end-word",
                   "found " + quote(word) + " after 'end', expected nothing or " + quote(keyword));
  } else {
    reader.expect_end();
  }
}

void DefinitionParser::parse_implements(StatementReader& reader, EntityDefinition& entity) {
  documentation_.drop();
  if (!reader.expect_blank("the name of an object type")) return;
  const auto start = reader.position();
  const auto name = reader.token();
  if (!is_qualified_name(name)) {
    reader.fail_at(start, reader.position(), "syntax",
                   "found " + quote(name) + ", expected the name of an object type");
    return;
  }
  if (reader.expect_end()) entity.implements.push_back({std::string(name), {}, reader.line().line()});
}

void DefinitionParser::parse_body_line(LogicalLine line, EntityDefinition& entity) {
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
  const bool is_implements = keyword == "implements" && is_object;
  if ((keyword == "constant" || is_implements) && !entity.members.empty()) {
    reader.fail_at(start, reader.position(), "order",
                   "found " + quote(keyword) + " after a member, expected it before the first one");
  }
  if (is_implements) return parse_implements(reader, entity);
  if (keyword == "constant") return parse_constant_statement(reader, entity.constants);
  if (!kind || (*kind == MemberKind::field) == is_object) {
    documentation_.drop();
    reader.fail_at(start, reader.position(), "syntax",
                   "found " + quote(keyword) +
                       (is_object ? ", expected a member: property, function, event, objref, pipe, callback, wire, "
                                    "memory; or implements, constant, option, end"
                                  : ", expected field, constant, option or end"));
    return;
  }
  MemberDefinition member;
  member.kind = *kind;
  member.documentation = documentation_.take();
  member.line = line.line();
  if (reader.has_room(entity.members.size(), max_members) && parse_member(reader, member))
    entity.members.push_back(std::move(member));
}

/// Parameter lists that run on without '\', as in the 2016 paper: joins the lines; strict reports them.
bool DefinitionParser::join_wrapped_parameters(LogicalLine& line) {
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
      constexpr std::string_view message =
          "the parameters run on in the next line, expected '\\' at the end of this one";
      const auto span = line.span(open, end);
      reporter_.relaxed(reporter_.is_compat() ? "legacy-syntax" : "syntax", span, std::string(message));
    }
    is_wrapped = true;
    line.join(more);
    if (more.text().find(')') != std::string_view::npos) break;
  }
  return is_wrapped;
}

}  // namespace rr
