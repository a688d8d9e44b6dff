#include "core/member/memory_transfer.hpp"

#include <algorithm>

#include "core/types/multidim.hpp"

namespace rr {

namespace {

std::vector<std::uint32_t> to_dims(std::span<const std::uint64_t> count, const MemberDefinition& memory) {
  std::vector<std::uint32_t> dims;
  if (!is_multidim(memory.type)) return dims;
  for (const auto size : count) dims.push_back(static_cast<std::uint32_t>(size));
  return dims;
}

Value to_value(Array numbers, std::vector<Structure> pods, std::span<const std::uint64_t> count,
               const MemberDefinition& memory, const EntityDefinition* entity) {
  auto dims = to_dims(count, memory);
  const bool has_dims = is_multidim(memory.type);
  if (!entity) return has_dims ? Value(MultiDimArray{std::move(dims), std::move(numbers)}) : Value(std::move(numbers));
  if (entity->kind == EntityKind::pod)
    return PodArray{memory.type.qualified_name, std::move(pods), std::move(dims), false, has_dims};
  return NamedArray{memory.type.qualified_name, std::move(numbers), std::move(dims), false, has_dims};
}

const EntityDefinition* entity_of(const MemberDefinition& memory, const TypeRegistry& types) {
  return memory.type.name.empty() ? nullptr : types.find_entity(memory.type.qualified_name);
}

/// The numbers of any value of a memory but one of pods.
const Array* numbers_of(const Value& value) {
  if (const auto* array = value.get_if<Array>()) return array;
  if (const auto* grid = value.get_if<MultiDimArray>()) return &grid->array;
  const auto* named = value.get_if<NamedArray>();
  return named ? &named->array : nullptr;
}

}  // namespace

MemoryParts::MemoryParts(MemoryRange range, std::uint64_t largest)
    : range_(std::move(range)), at_(range_.count.size(), 0) {
  const auto& count = range_.count;
  is_done_ = std::find(count.begin(), count.end(), std::uint64_t{0}) != count.end();
  std::uint64_t whole = 1;
  while (split_ + 1 < count.size() && count[split_] <= largest / whole)
    whole *= std::max<std::uint64_t>(1, count[split_++]);
  step_ = std::max<std::uint64_t>(1, largest / whole);
}

std::optional<MemoryRange> MemoryParts::next() {
  if (is_done_) return std::nullopt;
  const auto& count = range_.count;
  MemoryRange part{range_.position, count};
  for (std::size_t i = split_; i < count.size(); ++i) {
    part.position[i] += at_[i];
    part.count[i] = i == split_ ? std::min(step_, count[i] - at_[i]) : 1;
  }
  at_[split_] += part.count[split_];
  std::size_t carry = split_;
  while (carry < count.size() && at_[carry] == count[carry]) {
    at_[carry++] = 0;
    if (carry < count.size()) ++at_[carry];
  }
  is_done_ = carry == count.size();
  return part;
}

Value memory_slice(const Value& whole, std::uint64_t first, std::uint64_t items, std::span<const std::uint64_t> count,
                   const MemberDefinition& memory, const TypeRegistry& types) {
  const auto* entity = entity_of(memory, types);
  if (const auto* pods = whole.get_if<PodArray>()) {
    const auto begin = pods->items.begin() + static_cast<std::ptrdiff_t>(first);
    return to_value({}, {begin, begin + static_cast<std::ptrdiff_t>(items)}, count, memory, entity);
  }
  const std::uint64_t each = entity ? entity->namedarray_count : 1;
  // What is there is addressable: these fit.
  auto numbers =
      numbers_of(whole)->slice(static_cast<std::size_t>(first * each), static_cast<std::size_t>(items * each));
  return to_value(std::move(numbers), {}, count, memory, entity);
}

void MemoryCollector::add(Value part) {
  if (!only_ && numbers_.empty() && pods_.empty()) {
    only_ = std::move(part);
    return;
  }
  if (only_) append(*std::exchange(only_, std::nullopt));
  append(part);
}

void MemoryCollector::append(const Value& part) {
  if (const auto* pods = part.get_if<PodArray>()) {
    pods_.insert(pods_.end(), pods->items.begin(), pods->items.end());
  } else if (const auto* numbers = numbers_of(part)) {
    numbers_.insert(numbers_.end(), numbers->bytes().begin(), numbers->bytes().end());
  }
}

Value MemoryCollector::take(std::span<const std::uint64_t> count, const MemberDefinition& memory,
                            const TypeRegistry& types) {
  if (only_) return std::move(*only_);
  const auto* entity = entity_of(memory, types);
  const auto type = !entity                           ? memory.type.type
                    : entity->kind == EntityKind::pod ? DataType::void_t
                                                      : entity->namedarray_type;
  auto numbers = type == DataType::void_t ? Array() : Array::copy(type, numbers_);
  return to_value(std::move(numbers), std::move(pods_), count, memory, entity);
}

}  // namespace rr
