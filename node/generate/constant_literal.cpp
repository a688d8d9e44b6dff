#include "node/generate/constant_literal.hpp"

#include <algorithm>
#include <charconv>
#include <functional>
#include <limits>
#include <set>

#include "core/robdef/model/names.hpp"
#include "core/robdef/parse/statement.hpp"
#include "core/support/hex.hpp"
#include "node/generate/source_writer.hpp"

namespace rrgate {

namespace {

const rr::ConstantDefinition* find_constant(std::span<const rr::ConstantDefinition> scope, std::string_view name) {
  const auto found = std::find_if(scope.begin(), scope.end(), [&](const auto& item) { return item.name == name; });
  return found == scope.end() ? nullptr : &*found;
}

std::vector<rr::ConstantDefinition> in_order(const std::vector<rr::ConstantDefinition>& given,
                                             const std::vector<rr::OptionDefinition>& options) {
  auto all = given;
  for (auto& item : rr::option_constants(options)) all.push_back(std::move(item));
  std::vector<rr::ConstantDefinition> order;
  std::set<std::string> seen;
  const std::function<void(const rr::ConstantDefinition&)> visit = [&](const rr::ConstantDefinition& item) {
    if (!seen.insert(item.name).second) return;
    const auto value = value_of(item);
    if (const auto* fields = std::get_if<std::vector<rr::ConstantField>>(&value.data))
      for (const auto& field : *fields)
        if (const auto* target = find_constant(all, field.constant)) visit(*target);
    order.push_back(item);
  };
  for (const auto& item : all) visit(item);
  return order;
}

template <class Number>
std::string shortest(Number value) {
  char text[64];
  const auto end = std::to_chars(text, text + sizeof(text), value).ptr;
  return {text, end};
}

/// Struct constants may share others again and again: what is written out is bounded.
std::string typescript_value(const rr::ConstantDefinition& item, std::span<const rr::ConstantDefinition> scope,
                             int& budget) {
  if (--budget < 0) return "undefined";
  const auto value = value_of(item);
  std::vector<std::string> items;
  const bool is_wide = item.type.type == rr::DataType::int64_t || item.type.type == rr::DataType::uint64_t;
  if (const auto* text = std::get_if<std::string>(&value.data)) return string_literal(*text, false);
  if (const auto* numbers = std::get_if<std::vector<std::int64_t>>(&value.data))
    for (const auto number : *numbers) items.push_back(std::to_string(number) + (is_wide ? "n" : ""));
  if (const auto* numbers = std::get_if<std::vector<std::uint64_t>>(&value.data))
    for (const auto number : *numbers) items.push_back(std::to_string(number) + (is_wide ? "n" : ""));
  if (const auto* numbers = std::get_if<std::vector<double>>(&value.data))
    for (const auto number : *numbers) items.push_back(float_literal(number));
  if (const auto* fields = std::get_if<std::vector<rr::ConstantField>>(&value.data)) {
    for (const auto& field : *fields)
      if (const auto* target = find_constant(scope, field.constant))
        items.push_back(field.name + ": " + typescript_value(*target, scope, budget));
    return "Object.freeze({ " + joined(items) + " })";
  }
  return value.is_array ? "Object.freeze([" + joined(items) + "])" : joined(items);
}

}  // namespace

std::vector<rr::ConstantDefinition> all_constants(const rr::ServiceDefinition& definition) {
  return in_order(definition.constants, definition.options);
}

std::vector<rr::ConstantDefinition> all_constants(const rr::EntityDefinition& entity) {
  return in_order(entity.constants, entity.options);
}

rr::ConstantValue value_of(const rr::ConstantDefinition& item) {
  const auto value = rr::parse_constant_value(item.type, item.value_text, rr::RobdefMode::compat);
  return value ? *value : rr::ConstantValue{};
}

std::string float_literal(double value) {
  return shortest(value);
}

std::string float_literal(float value) {
  return shortest(value);
}

std::string string_literal(std::string_view text, bool for_cpp) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (c == '\n') {
      out += "\\n";
    } else if (c == '\t') {
      out += "\\t";
    } else if (byte >= 0x20 && byte != 0x7f) {
      out += c;
    } else if (for_cpp) {
      out += {'\\', static_cast<char>('0' + byte / 64), static_cast<char>('0' + byte / 8 % 8),
              static_cast<char>('0' + byte % 8)};
    } else {
      out += "\\x" + rr::hex_text(byte, 2);
    }
  }
  return out + '"';
}

std::string typescript_constant(const rr::ConstantDefinition& item, std::span<const rr::ConstantDefinition> scope) {
  int budget = 1000;
  return typescript_value(item, scope, budget);
}

std::string cpp_constant(const rr::ConstantDefinition& item, std::string_view name) {
  const auto value = value_of(item);
  if (const auto* text = std::get_if<std::string>(&value.data))
    return "std::string_view " + std::string(name) + "{" + string_literal(*text, true) + ", " +
           std::to_string(text->size()) + "}";
  std::vector<std::string> items;
  if (const auto* numbers = std::get_if<std::vector<std::int64_t>>(&value.data))
    for (const auto number : *numbers)
      items.push_back(number == std::numeric_limits<std::int64_t>::min() ? "-9223372036854775807 - 1"
                                                                         : std::to_string(number));
  if (const auto* numbers = std::get_if<std::vector<std::uint64_t>>(&value.data))
    for (const auto number : *numbers) items.push_back(std::to_string(number) + "u");
  const bool is_single = item.type.type == rr::DataType::single_t;
  if (const auto* numbers = std::get_if<std::vector<double>>(&value.data))
    for (const auto number : *numbers) {
      auto text = is_single ? float_literal(static_cast<float>(number)) : float_literal(number);
      if (text.find_first_of(".e") == std::string::npos) text += ".0";
      items.push_back(text + (is_single ? "f" : ""));
    }
  const std::string type = is_single ? "float"
                           : item.type.type == rr::DataType::double_t
                               ? "double"
                               : "std::" + std::string(data_type_name(item.type.type)) + "_t";
  if (!value.is_array) return type + ' ' + std::string(name) + " = " + joined(items);
  return "std::array<" + type + ", " + std::to_string(items.size()) + "> " + std::string(name) + "{" + joined(items) +
         "}";
}

}  // namespace rrgate
