#include "core/robdef/parse/type.hpp"

#include <limits>

#include "core/robdef/model/names.hpp"

namespace rr {

namespace {

constexpr std::string_view array_forms = "an array form: [], [5], [5-], [*], [3,] or [3,4]";

bool parse_size(StatementReader& reader, std::int32_t& out) {
  const auto start = reader.position();
  std::int64_t value = 0;
  bool is_too_large = false;
  for (; is_digit(reader.peek()); reader.accept(reader.peek())) {
    value = value * 10 + (reader.peek() - '0');
    if (value > std::numeric_limits<std::int32_t>::max()) {
      is_too_large = true;
      value = std::numeric_limits<std::int32_t>::max();
    }
  }
  if (reader.position() == start) return reader.fail("a size: decimal digits");
  if (is_too_large) {
    return reader.fail_at(
        start, reader.position(), "array-size",
        "found the size " + quote(reader.text(start, reader.position())) + ", expected at most 2147483647");
  }
  out = static_cast<std::int32_t>(value);
  return true;
}

/// After the first size and a comma: `]` or further sizes.
bool parse_dimensions(StatementReader& reader, TypeDefinition& out) {
  out.array = ArrayKind::fixed_multidim;
  if (reader.accept(']')) return true;
  while (true) {
    if (!reader.has_room(out.sizes.size(), max_dimensions) || !parse_size(reader, out.sizes.emplace_back()))
      return false;
    if (reader.accept(']')) return true;
    if (!reader.accept(',')) return reader.fail("',' or ']'");
  }
}

void check_zero_sizes(StatementReader& reader, std::size_t start, TypeDefinition& out) {
  bool has_zero = false;
  for (const auto size : out.sizes) has_zero = has_zero || size == 0;
  if (!has_zero) return;
  const auto span = reader.span(start, reader.position());
  const auto found = "found the array size 0 in " + quote(reader.text(start, reader.position()));
  if (out.array == ArrayKind::max) {
    reader.reporter().relaxed("array-size", span, found + ", expected [] for any length");
    out.array = ArrayKind::variable;
    out.sizes.clear();
  } else {
    reader.reporter().relaxed("array-size", span, found + ", expected sizes of at least 1");
  }
}

bool parse_array(StatementReader& reader, TypeDefinition& out) {
  const auto start = reader.position();
  reader.accept('[');
  if (reader.accept(']')) {
    out.array = ArrayKind::variable;
    return true;
  }
  if (reader.accept('*')) {
    out.array = ArrayKind::multidim;
    return reader.accept(']') || reader.fail("']'");
  }
  if (!is_digit(reader.peek())) return reader.fail(array_forms);
  if (!parse_size(reader, out.sizes.emplace_back())) return false;
  if (reader.accept(',')) {
    if (!parse_dimensions(reader, out)) return false;
  } else {
    out.array = reader.accept('-') ? ArrayKind::max : ArrayKind::fixed;
    if (!reader.accept(']')) return reader.fail("']'");
  }
  check_zero_sizes(reader, start, out);
  return true;
}

bool parse_container(StatementReader& reader, TypeDefinition& out) {
  const auto start = reader.position();
  reader.accept('{');
  const auto word = reader.word();
  if (word == "list") out.container = ContainerKind::list;
  if (word == "int32") out.container = ContainerKind::map_int32;
  if (word == "string") out.container = ContainerKind::map_string;
  if (word == "generator") out.container = ContainerKind::generator;
  if (out.container != ContainerKind::none && reader.accept('}')) return true;
  return reader.fail_at(start, reader.position(), "syntax",
                        "found " + quote(reader.text(start, reader.position() + 1)) +
                            ", expected a container: {list}, {int32}, {string} or {generator}");
}

}  // namespace

bool parse_type(StatementReader& reader, TypeDefinition& out) {
  out = {};
  const auto start = reader.position();
  const auto base = reader.dotted_word();
  if (base.empty()) return reader.fail("a type");
  if (!is_qualified_name(base)) {
    return reader.fail_at(start, reader.position(), "syntax", "found " + quote(base) + ", expected the name of a type");
  }
  out.type = builtin_type(base);
  if (out.type == DataType::namedtype_t) out.name = base;
  if (reader.peek() == '[' && !parse_array(reader, out)) return false;
  return reader.peek() != '{' || parse_container(reader, out);
}

std::string format_type(const TypeDefinition& type) {
  std::string out = type.name.empty() ? std::string(builtin_type_word(type.type)) : type.name;
  switch (type.array) {
    case ArrayKind::none:
      break;
    case ArrayKind::variable:
      out += "[]";
      break;
    case ArrayKind::multidim:
      out += "[*]";
      break;
    case ArrayKind::fixed:
    case ArrayKind::max:
    case ArrayKind::fixed_multidim: {
      out += '[';
      for (std::size_t i = 0; i < type.sizes.size(); ++i) {
        if (i != 0) out += ',';
        out += std::to_string(type.sizes[i]);
      }
      if (type.array == ArrayKind::max) out += '-';
      if (type.array == ArrayKind::fixed_multidim && type.sizes.size() == 1) out += ',';
      out += ']';
      break;
    }
  }
  switch (type.container) {
    case ContainerKind::none:
      break;
    case ContainerKind::list:
      out += "{list}";
      break;
    case ContainerKind::map_int32:
      out += "{int32}";
      break;
    case ContainerKind::map_string:
      out += "{string}";
      break;
    case ContainerKind::generator:
      out += "{generator}";
      break;
  }
  return out;
}

}  // namespace rr
