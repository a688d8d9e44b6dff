// Memories of a service: handlers, or containers that the service reads and writes itself. Layer: node/service.
//
//   auto samples = std::make_shared<rr::NumberMemory<double>>();
//   samples->items.resize(100'000);
//   samples->dimensions = {100'000};
//   service->memory("samples", samples);
//
// Ranges are checked before a handler or container sees them. Items lie column-major: the first index runs fastest.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/member/memory.hpp"

namespace rr {

/// A memory that is anything: a file, a device, a computation.
struct MemoryHandlers {
  /// One number a dimension; the length of a plain array.
  std::function<MemoryShape()> dimensions;
  /// The items of a range: Array, MultiDimArray, PodArray or NamedArray, as the memory's type says, with dims as the
  /// counts. Not for writeonly memories.
  std::function<Value(const MemoryRange& range)> read = {};
  /// `items` as read() returns them. Not for readonly memories.
  std::function<void(const MemoryRange& range, const Value& items)> write = {};
  /// `read` and `write` block, and run on the node's pool: rr::blocking(handlers).
  bool is_blocking = false;
};

/// Numbers of a plain or multi-dimensional array, or of named arrays, one after another. The service may change both
/// members at any time between requests; while they do not fit each other requests fail.
template <Number T>
requires(!std::is_same_v<T, bool>) struct NumberMemory {
  MemoryShape dimensions = {0};
  std::vector<T> items = {};
};

/// The same for pods; their type_name may be empty.
struct PodMemory {
  MemoryShape dimensions = {0};
  std::vector<Structure> items = {};
};

namespace detail {

/// How a memory's items become values.
struct MemoryForm {
  std::string type_name;      ///< named arrays and pods: qualified
  std::uint64_t numbers = 1;  ///< in one item
  bool is_multidim = false;
  bool is_named = false;
};

/// Throws   ServiceException invalid_state: `items` are not as many as `dimensions` say.
void check_memory_items(std::span<const std::uint64_t> dimensions, std::uint64_t items, std::uint64_t each);
Value make_memory_value(const MemoryForm& form, Array numbers, std::span<const std::uint64_t> count);
const Array& numbers_of_memory_value(const Value& value);
MemoryHandlers make_memory_handlers(std::shared_ptr<PodMemory> memory, MemoryForm form);

template <Number T>
MemoryHandlers make_memory_handlers(std::shared_ptr<NumberMemory<T>> memory, MemoryForm form) {
  MemoryHandlers handlers;
  handlers.dimensions = [memory] { return memory->dimensions; };
  handlers.read = [memory, form](const MemoryRange& range) {
    check_memory_items(memory->dimensions, memory->items.size(), form.numbers);
    std::vector<T> items;
    for_each_run(memory->dimensions, range, [&](std::uint64_t from, std::uint64_t, std::uint64_t count) {
      const auto* first = memory->items.data() + from * form.numbers;
      items.insert(items.end(), first, first + count * form.numbers);
    });
    return make_memory_value(form, Array::take(std::move(items)), range.count);
  };
  handlers.write = [memory, form](const MemoryRange& range, const Value& value) {
    check_memory_items(memory->dimensions, memory->items.size(), form.numbers);
    const auto items = numbers_of_memory_value(value).items<T>();
    for_each_run(memory->dimensions, range, [&](std::uint64_t to, std::uint64_t from, std::uint64_t count) {
      std::copy_n(items.data() + from * form.numbers, count * form.numbers, memory->items.data() + to * form.numbers);
    });
  };
  return handlers;
}

}  // namespace detail

}  // namespace rr
