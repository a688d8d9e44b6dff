#include "core/member/memory.hpp"

#include <algorithm>
#include <limits>

#include "core/types/multidim.hpp"

namespace rr {

namespace {

constexpr std::uint64_t largest = std::numeric_limits<std::uint64_t>::max();
constexpr unsigned most_pods = 256;

std::string memory_subject(const MemberDefinition& memory) {
  return "memory '" + memory.name + "'";
}

std::string shape_text(std::span<const std::uint64_t> shape) {
  std::string text = "[";
  for (const auto size : shape) {
    if (text.size() > 60) return text + ",...]";
    if (text.size() > 1) text += ',';
    text += std::to_string(size);
  }
  return text + "]";
}

Result<const MessageElement*> find_element(const Message& message, const MessageEntry& entry, std::string_view name,
                                           const MemberDefinition& memory) {
  if (const auto* element = message.elements_of(entry).find(name)) return element;
  return make_error(ErrorCode::message_element_not_found,
                    memory_subject(memory) + ": element '" + std::string(name) + "' not found");
}

Result<MemoryShape> read_shape(const Message& message, const MessageEntry& entry, std::string_view name,
                               const MemberDefinition& memory) {
  const auto element = find_element(message, entry, name, memory);
  if (!element) return element.error();
  if ((*element)->type != DataType::uint64_t)
    return make_error(ErrorCode::data_type_mismatch, memory_subject(memory) + ": '" + std::string(name) + "' is " +
                                                         std::string(data_type_name((*element)->type)) +
                                                         "[], expected uint64[]");
  const bool is_plain = !is_multidim(memory.type);
  if ((*element)->count == 0 || (is_plain && (*element)->count != 1))
    return make_error(ErrorCode::invalid_argument, memory_subject(memory) + ": '" + std::string(name) + "' has " +
                                                       std::to_string((*element)->count) + " numbers, expected " +
                                                       (is_plain ? "1" : "one a dimension"));
  MemoryShape shape((*element)->count);
  for (std::size_t i = 0; i < shape.size(); ++i)
    shape[i] = load<std::uint64_t>((*element)->data.data() + i * sizeof(std::uint64_t));
  return shape;
}

void write_shape(Message& message, std::string_view name, std::span<const std::uint64_t> shape) {
  message.add(name, DataType::uint64_t, static_cast<std::uint32_t>(shape.size()),
              message.store(ByteSpan(reinterpret_cast<const std::uint8_t*>(shape.data()), shape.size_bytes())));
}

Result<> check_count(const Value& data, std::span<const std::uint64_t> count, const MemberDefinition& memory,
                     const TypeRegistry& types) {
  const auto shape = shape_of(data, memory, types);
  if (!shape) return shape.error();
  if (std::equal(shape->begin(), shape->end(), count.begin(), count.end())) return {};
  return make_error(ErrorCode::invalid_argument,
                    memory_subject(memory) + ": the data is " + shape_text(*shape) + ", expected " + shape_text(count));
}

Error mismatch(const Value& value, const MemberDefinition& memory) {
  return make_error(ErrorCode::data_type_mismatch,
                    memory_subject(memory) + ": found " + value.type_text() + ", expected " + format_type(memory.type));
}

std::uint64_t capped(std::uint64_t left, std::uint64_t right) {
  return right != 0 && left > largest / right ? largest : left * right;
}

/// About what one pod takes in a message. Pods are not recursive: verification sees to that. But they may hold one
/// another so often that nobody can count: `left`  how many are looked at.
std::uint64_t packed_size(const EntityDefinition& pod, const TypeRegistry& types, unsigned& left) {
  if (left == 0) return largest;
  --left;
  constexpr std::uint64_t element_overhead = 32;
  std::uint64_t size = element_overhead;
  for (const auto& field : pod.members) {
    const auto items = product_of(std::span<const std::int32_t>(field.type.sizes)).value_or(largest);
    std::uint64_t each = item_size(field.type.type);
    if (const auto* named = types.find_entity(field.type.qualified_name)) {
      each = named->kind == EntityKind::pod
                 ? packed_size(*named, types, left)
                 : std::uint64_t{named->namedarray_count} * item_size(named->namedarray_type);
    }
    const auto data = capped(items, each);
    const auto more = element_overhead + field.name.size();
    if (data > largest - more - size) return largest;
    size += data + more;
  }
  return size;
}

}  // namespace

// --- messages ---

void write_memory_shape(Message& message, std::span<const std::uint64_t> shape) {
  write_shape(message, "return", shape);
}

Result<MemoryShape> read_memory_shape(const Message& message, const MessageEntry& entry,
                                      const MemberDefinition& memory) {
  return read_shape(message, entry, "return", memory);
}

Result<std::uint32_t> read_memory_limit(const Message& message, const MessageEntry& entry,
                                        const MemberDefinition& memory) {
  const auto element = find_element(message, entry, "return", memory);
  if (!element) return element.error();
  if ((*element)->type != DataType::uint32_t || (*element)->count != 1)
    return make_error(ErrorCode::data_type_mismatch, memory_subject(memory) + ": MaxTransferSize is no single uint32");
  return load<std::uint32_t>((*element)->data.data());
}

void write_memory_range(Message& message, const MemoryRange& range) {
  write_shape(message, "memorypos", range.position);
  write_shape(message, "count", range.count);
}

Result<MemoryRange> read_memory_range(const Message& message, const MessageEntry& entry,
                                      const MemberDefinition& memory) {
  auto position = read_shape(message, entry, "memorypos", memory);
  if (!position) return position.error();
  auto count = read_shape(message, entry, "count", memory);
  if (!count) return count.error();
  if (position->size() != count->size())
    return make_error(ErrorCode::invalid_argument, memory_subject(memory) + ": " + std::to_string(position->size()) +
                                                       " numbers of position and " + std::to_string(count->size()) +
                                                       " of count, expected one each a dimension");
  return MemoryRange{std::move(*position), std::move(*count)};
}

Result<> write_memory_data(Message& message, const Value& data, std::span<const std::uint64_t> count,
                           const MemberDefinition& memory, const TypeRegistry& types) {
  if (auto fits = check_count(data, count, memory, types); !fits) return fits;
  return pack(message, "data", data, memory.type, types);
}

Result<Value> read_memory_data(const Message& message, const MessageEntry& entry, std::span<const std::uint64_t> count,
                               const MemberDefinition& memory, const TypeRegistry& types) {
  const auto element = find_element(message, entry, "data", memory);
  if (!element) return element.error();
  auto data = unpack(message, **element, memory.type, types);
  if (!data) return data;
  if (auto fits = check_count(*data, count, memory, types); !fits) return fits.error();
  return data;
}

// --- ranges and shapes ---

Result<> check_memory_range(const MemoryRange& range, std::span<const std::uint64_t> dimensions,
                            const MemberDefinition& memory) {
  const auto& [position, count] = range;
  if (position.size() != dimensions.size() || count.size() != dimensions.size())
    return make_error(ErrorCode::invalid_argument, memory_subject(memory) + ": position and count have " +
                                                       std::to_string(position.size()) + " and " +
                                                       std::to_string(count.size()) + " dimensions, the memory has " +
                                                       std::to_string(dimensions.size()));
  bool is_within = product_of(std::span<const std::uint64_t>(count)).has_value();
  for (std::size_t i = 0; i < dimensions.size(); ++i)
    is_within = is_within && position[i] <= dimensions[i] && count[i] <= dimensions[i] - position[i];
  if (is_within) return {};
  return make_error(ErrorCode::out_of_range, memory_subject(memory) + ": Index out of range: " + shape_text(count) +
                                                 " items at " + shape_text(position) + " of " + shape_text(dimensions));
}

Result<MemoryShape> shape_of(const Value& value, const MemberDefinition& memory, const TypeRegistry& types) {
  const bool wants_dims = is_multidim(memory.type);
  const auto* entity = memory.type.name.empty() ? nullptr : types.find_entity(memory.type.qualified_name);
  std::uint64_t items = 0;
  const std::vector<std::uint32_t>* dims = nullptr;
  if (const auto* array = value.get_if<Array>(); array && !entity && !wants_dims) {
    items = array->size();
  } else if (const auto* grid = value.get_if<MultiDimArray>(); grid && !entity && wants_dims) {
    items = grid->array.size();
    dims = &grid->dims;
  } else if (const auto* pods = value.get_if<PodArray>();
             pods && entity && entity->kind == EntityKind::pod && pods->is_multidim == wants_dims) {
    items = pods->items.size();
    dims = &pods->dims;
  } else if (const auto* named = value.get_if<NamedArray>(); named && entity && entity->namedarray_count != 0 &&
                                                             named->is_multidim == wants_dims &&
                                                             named->array.size() % entity->namedarray_count == 0) {
    items = named->array.size() / entity->namedarray_count;
    dims = &named->dims;
  } else {
    return mismatch(value, memory);
  }
  if (!wants_dims) return MemoryShape{items};
  if (product_of(std::span<const std::uint32_t>(*dims)) != items)
    return make_error(ErrorCode::invalid_argument, memory_subject(memory) + ": dims " + dims_text(*dims) +
                                                       " do not match " + std::to_string(items) + " items");
  return MemoryShape(dims->begin(), dims->end());
}

std::uint64_t memory_item_size(const MemberDefinition& memory, const TypeRegistry& types) {
  if (memory.type.name.empty()) return std::max<std::uint64_t>(1, item_size(memory.type.type));
  const auto* entity = types.find_entity(memory.type.qualified_name);
  if (!entity) return 1;
  unsigned left = most_pods;
  if (entity->kind == EntityKind::pod) return packed_size(*entity, types, left);
  return std::max<std::uint64_t>(1, std::uint64_t{entity->namedarray_count} * item_size(entity->namedarray_type));
}

}  // namespace rr
