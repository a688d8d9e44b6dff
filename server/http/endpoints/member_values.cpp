#include "server/http/endpoints/member_values.hpp"

#include <algorithm>

#include "core/member/memory.hpp"
#include "core/types/multidim.hpp"

namespace rrgate {

namespace {

std::string shape_text(const Shape& shape) {
  std::string out;
  for (const auto items : shape) out += (out.empty() ? "" : " x ") + std::to_string(items);
  return out;
}

}  // namespace

std::string plain_documentation(std::string_view documentation) {
  std::string out;
  bool begins_line = true;
  for (const char c : documentation) {
    if (!begins_line || c != ' ') out += c;
    begins_line = c == '\n';
  }
  return out;
}

rr::OrderedJson describe_object(const Target& target) {
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "path") = target.path();
  rr::add_key(out, "type") = target.type->qualified_name;
  if (!target.type->documentation.empty())
    rr::add_key(out, "documentation") = plain_documentation(target.type->documentation);
  auto& members = rr::add_key(out, "members") = rr::OrderedJson::array();
  for (const auto& member : target.type->members) {
    auto& item = members.emplace_back(rr::OrderedJson::object());
    rr::add_key(item, "name") = member.name;
    rr::add_key(item, "kind") = std::string(member_kind_name(member.kind));
    rr::add_key(item, "type") = format_type(member.type);
    if (member.kind == rr::MemberKind::function || member.kind == rr::MemberKind::event ||
        member.kind == rr::MemberKind::callback) {
      auto& parameters = rr::add_key(item, "parameters") = rr::OrderedJson::array();
      for (const auto& parameter : member.parameters)
        parameters.push_back({{"name", parameter.name}, {"type", format_type(parameter.type)}});
    }
    if (member.direction() != rr::MemberDirection::both)
      rr::add_key(item, "direction") = member.direction() == rr::MemberDirection::readonly ? "readonly" : "writeonly";
    if (!member.documentation.empty()) rr::add_key(item, "documentation") = plain_documentation(member.documentation);
  }
  return out;
}

rr::Result<rr::OrderedJson> sample_to_json(const Sample& sample, const rr::MemberDefinition& member,
                                           const rr::TypeRegistry& types, const rr::JsonForm& form) {
  if (member.kind == rr::MemberKind::event) return arguments_to_json(sample.values, member, types, form);
  return rr::value_to_json(sample.values.at(0), member.type, types, form, member.name);
}

std::string_view state_name(const rr::Error* error) {
  if (!error) return "connected";
  return error->code == rr::ErrorCode::invalid_state ? "closed" : "connection_lost";
}

rr::OrderedJson to_json(const Target& target, const rr::Value& value, const rr::JsonForm& form) {
  auto json = rr::value_to_json(value, target.member->type, target.types(), form, target.member->name);
  if (!json) refuse(rr::ErrorCode::protocol_error, json.error().message);
  return std::move(*json);
}

std::size_t item_bytes_of(const Target& target) {
  if (const auto size = rr::item_size(target.member->type.type)) return size;
  const auto* entity = target.types().find_entity(target.member->type.qualified_name);
  return entity ? entity->namedarray_count * rr::item_size(entity->namedarray_type) : 0;
}

rr::awaitable<Shape> memory_shape(const Target& target) {
  const auto value = co_await target.ask(rr::CallKind::memory_dimensions);
  const auto items = value_or_throw(value.to_items<std::uint64_t>());
  co_return Shape(items.begin(), items.end());
}

rr::awaitable<rr::Value> read_items(const Target& target, const Shape& shape, const std::optional<Shape>& offset,
                                    const std::optional<Shape>& count) {
  rr::MemoryShape at = offset.value_or(Shape(shape.size(), 0));
  rr::MemoryShape counts;
  if (count) {
    counts = *count;
  } else {
    for (std::size_t i = 0; i < shape.size(); ++i) counts.push_back(shape[i] - std::min(at[i], shape[i]));
  }
  const auto wanted = rr::product_of(std::span<const std::uint64_t>(counts));
  if (!wanted || *wanted > max_memory_bytes / rr::memory_item_size(*target.member, target.types()))
    refuse(rr::ErrorCode::buffer_limit_violation,
           "that are more than " + std::to_string(max_memory_bytes) + " bytes; ask for parts with offset and count");
  auto part = target.request(rr::CallKind::memory_read);
  part.range.position = std::move(at);
  part.range.count = std::move(counts);
  co_return co_await target.client->ask(std::move(part));
}

rr::awaitable<void> write_items(const Target& target, const Shape& shape, const std::optional<Shape>& offset,
                                const std::optional<Shape>& count, rr::Value items) {
  if (count) {
    const auto given = value_or_throw(rr::shape_of(items, *target.member, target.types()));
    if (given != *count)
      refuse(rr::ErrorCode::invalid_argument, "the value has " + shape_text(given) + " items, and count is " +
                                                  shape_text(*count) + "; it can be left out");
  }
  auto part = target.request(rr::CallKind::memory_write);
  part.range.position = offset.value_or(Shape(shape.size(), 0));
  part.arguments.push_back(std::move(items));
  co_await target.client->ask(std::move(part));
}

}  // namespace rrgate
