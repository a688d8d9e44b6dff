// Memories of generated services: typed items that clients read and write in parts. Layer: node/service.
#pragma once

#include <memory>
#include <vector>

#include "core/types/multidim.hpp"
#include "node/service/memory.hpp"
#include "node/values/typed_value.hpp"

namespace rr {

/// Items column-major: the first index runs fastest. The service may change both members at any time between requests;
/// while they do not fit each other requests fail with InvalidState.
template <class T>
struct MemoryBuffer {
  MemoryShape dimensions = {0};
  std::vector<T> items = {};
};

namespace detail {

template <class T>
void check_buffer(const MemoryBuffer<T>& buffer) {
  const auto expected = product_of(std::span<const std::uint64_t>(buffer.dimensions));
  if (expected && *expected == buffer.items.size()) return;
  throw Exception(make_error(ErrorCode::invalid_state, "the memory has " + std::to_string(buffer.items.size()) +
                                                           " items, which is not what its dimensions say"));
}

template <class T>
MemoryHandlers make_buffer_handlers(std::shared_ptr<MemoryBuffer<T>> buffer, ArrayForm form) {
  const auto at = [](auto& items, std::uint64_t index) { return items.begin() + static_cast<std::ptrdiff_t>(index); };
  MemoryHandlers handlers;
  handlers.dimensions = [buffer] { return buffer->dimensions; };
  handlers.read = [buffer, form, at](const MemoryRange& range) {
    check_buffer(*buffer);
    std::vector<T> items;
    for_each_run(buffer->dimensions, range, [&](std::uint64_t from, std::uint64_t, std::uint64_t count) {
      items.insert(items.end(), at(buffer->items, from), at(buffer->items, from + count));
    });
    std::vector<std::uint32_t> dims;
    if (form == ArrayForm::multidim) dims.assign(range.count.begin(), range.count.end());
    return pack_items(std::move(items), form, std::move(dims));
  };
  handlers.write = [buffer, at](const MemoryRange& range, const Value& value) {
    check_buffer(*buffer);
    std::vector<std::uint32_t> dims;
    const auto items = unpack_items<T>(value, dims);  // exactly as many as the range: the session has checked
    for_each_run(buffer->dimensions, range, [&](std::uint64_t to, std::uint64_t from, std::uint64_t count) {
      std::copy(at(items, from), at(items, from + count), at(buffer->items, to));
    });
  };
  return handlers;
}

}  // namespace detail

}  // namespace rr
