// Memories of a service's objects: handlers are checked against the definition, ranges against the memory. Layer:
// node/service.
#include "core/types/multidim.hpp"
#include "node/service/refusal.hpp"
#include "node/service/service.hpp"

namespace rr {

namespace detail {

void check_memory_items(std::span<const std::uint64_t> dimensions, std::uint64_t items, std::uint64_t each) {
  const auto expected = product_of(dimensions);
  if (expected && items % each == 0 && items / each == *expected) return;
  throw ServiceException("the memory has " + std::to_string(items / each) + " items, its dimensions say " +
                             (expected ? std::to_string(*expected) : "more than any memory can have"),
                         ErrorCode::invalid_state);
}

Value make_memory_value(const MemoryForm& form, Array numbers, std::span<const std::uint64_t> count) {
  std::vector<std::uint32_t> dims;
  if (form.is_multidim) dims.assign(count.begin(), count.end());  // no count is above what fits a message
  if (form.is_named) return NamedArray{form.type_name, std::move(numbers), std::move(dims), false, form.is_multidim};
  if (form.is_multidim) return MultiDimArray{std::move(dims), std::move(numbers)};
  return numbers;
}

const Array& numbers_of_memory_value(const Value& value) {
  if (const auto* grid = value.get_if<MultiDimArray>()) return grid->array;
  if (const auto* named = value.get_if<NamedArray>()) return named->array;
  return *value.get_if<Array>();
}

MemoryHandlers make_memory_handlers(std::shared_ptr<PodMemory> memory, MemoryForm form) {
  MemoryHandlers handlers;
  handlers.dimensions = [memory] { return memory->dimensions; };
  handlers.read = [memory, form](const MemoryRange& range) {
    check_memory_items(memory->dimensions, memory->items.size(), 1);
    PodArray pods;
    pods.type_name = form.type_name;
    pods.is_multidim = form.is_multidim;
    if (form.is_multidim) pods.dims.assign(range.count.begin(), range.count.end());
    for_each_run(memory->dimensions, range, [&](std::uint64_t from, std::uint64_t, std::uint64_t count) {
      const auto first = memory->items.begin() + static_cast<std::ptrdiff_t>(from);
      pods.items.insert(pods.items.end(), first, first + static_cast<std::ptrdiff_t>(count));
    });
    return Value(std::move(pods));
  };
  handlers.write = [memory](const MemoryRange& range, const Value& value) {
    check_memory_items(memory->dimensions, memory->items.size(), 1);
    const auto& items = value.get_if<PodArray>()->items;
    for_each_run(memory->dimensions, range, [&](std::uint64_t to, std::uint64_t from, std::uint64_t count) {
      std::copy_n(items.begin() + static_cast<std::ptrdiff_t>(from), count,
                  memory->items.begin() + static_cast<std::ptrdiff_t>(to));
    });
  };
  return handlers;
}

}  // namespace detail

void Object::memory(std::string_view name, MemoryHandlers handlers) {
  const MemberDefinition& member = require_member(name, MemberKind::memory);
  const std::string where = type_name() + "." + member.name;
  if (!handlers.dimensions) refuse(where + ": a memory needs a handler for its dimensions");
  if (!handlers.read && member.direction() != MemberDirection::writeonly) refuse(where + ": it has no read handler");
  if (!handlers.write && member.direction() != MemberDirection::readonly) refuse(where + ": it has no write handler");
  members_[&member].memory = std::make_shared<const MemoryHandlers>(std::move(handlers));
}

void Object::memory(std::string_view name, std::shared_ptr<PodMemory> memory) {
  this->memory(name, detail::make_memory_handlers(std::move(memory), memory_form(name, DataType::pod_t)));
}

/// `items` is the numbers' type, or pod_t.
detail::MemoryForm Object::memory_form(std::string_view name, DataType items) const {
  const MemberDefinition& member = require_member(name, MemberKind::memory);
  const auto* entity = member.type.name.empty() ? nullptr : service_.types_->find_entity(member.type.qualified_name);
  const auto expected = !entity                           ? member.type.type
                        : entity->kind == EntityKind::pod ? DataType::pod_t
                                                          : entity->namedarray_type;
  if (items != expected)
    refuse(type_name() + "." + member.name + ": is " + format_type(member.type) + ", the memory is of " +
           std::string(items == DataType::pod_t ? "pods" : data_type_name(items)));
  detail::MemoryForm form;
  form.is_multidim = is_multidim(member.type);
  if (!entity) return form;
  form.type_name = member.type.qualified_name;
  form.is_named = items != DataType::pod_t;
  if (form.is_named) form.numbers = entity->namedarray_count;
  return form;
}

namespace {

Result<Value> ask_memory(const MemoryHandlers& memory, const Called& called) {
  if (called.kind == CallKind::memory_read) return memory.read(called.range);
  memory.write(called.range, called.arguments.front());
  return Value{};
}

}  // namespace

std::optional<Result<Value>> Object::answer_memory(Called& called, const BeginLate& begin_late) {
  const auto found = members_.find(called.member);
  if (found == members_.end() || !found->second.memory) return no_handler("memory", *called.member);
  const auto memory = found->second.memory;
  const MemoryShape dimensions = memory->dimensions();
  if (called.kind == CallKind::memory_dimensions) return Value(dimensions);
  if (auto fits = check_memory_range(called.range, dimensions, *called.member); !fits) return fits.error();
  if (!memory->is_blocking) return ask_memory(*memory, called);
  auto call = begin_late();
  auto& late = *call;
  called.object = nullptr;  // the call keeps it, and lets it go on the node's thread
  late.run_blocking([memory, called = std::move(called), call = std::move(call)] {
    Result<Value> answer = Value{};
    try {
      answer = ask_memory(*memory, called);
    } catch (...) {
      answer = handler_error(std::current_exception());
    }
    call->answer(std::move(answer), memory);
  });
  return std::nullopt;
}

}  // namespace rr
