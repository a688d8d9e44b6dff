// Memories: what their messages say, and which part of a memory a request means. Layer: member.
// Source: sessions spec section 2.14.
//
// A range is a position and a count, one number a dimension: {0} and {64} in a plain array, {0, 2} and {4, 1} in a
// multi-dimensional one. Items lie column-major: the first index runs fastest.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/types/pack.hpp"

namespace rr {

/// One number a dimension.
using MemoryShape = std::vector<std::uint64_t>;

struct MemoryRange {
  MemoryShape position;
  MemoryShape count;
};

/// What MemoryGetParam may ask for.
namespace memory_parameter {
inline constexpr std::string_view length = "Length";          ///< plain arrays: uint64[1]
inline constexpr std::string_view dimensions = "Dimensions";  ///< multi-dimensional: uint64[n]
inline constexpr std::string_view dim_count = "DimCount";     ///< multi-dimensional: uint64[1]
inline constexpr std::string_view limit = "MaxTransferSize";  ///< uint32[1], bytes
}  // namespace memory_parameter

/// Adds / reads `return` of a shape. Errors: message_element_not_found, data_type_mismatch; invalid_argument: a plain
/// array with other than one dimension, or none at all.
void write_memory_shape(Message& message, std::span<const std::uint64_t> shape);
Result<MemoryShape> read_memory_shape(const Message& message, const MessageEntry& entry,
                                      const MemberDefinition& memory);
Result<std::uint32_t> read_memory_limit(const Message& message, const MessageEntry& entry,
                                        const MemberDefinition& memory);

/// Adds / reads `memorypos` and `count`.
/// Errors   as read_memory_shape(); invalid_argument: differently many dimensions; out_of_range: a count or an end that
///          no memory can have.
void write_memory_range(Message& message, const MemoryRange& range);
Result<MemoryRange> read_memory_range(const Message& message, const MessageEntry& entry,
                                      const MemberDefinition& memory);

/// Adds / reads `data`; it is exactly `count` items.
/// Errors   those of pack() and unpack(); invalid_argument: another count, or other dims.
Result<> write_memory_data(Message& message, const Value& data, std::span<const std::uint64_t> count,
                           const MemberDefinition& memory, const TypeRegistry& types);
Result<Value> read_memory_data(const Message& message, const MessageEntry& entry, std::span<const std::uint64_t> count,
                               const MemberDefinition& memory, const TypeRegistry& types);

/// Errors   invalid_argument: another number of dimensions than the memory has; out_of_range: not within it, or a
///          product that fits no number.
Result<> check_memory_range(const MemoryRange& range, std::span<const std::uint64_t> dimensions,
                            const MemberDefinition& memory);

/// The shape of a value as it is in a memory: dims, or how many items.
/// Errors   data_type_mismatch: not a value of this memory; invalid_argument: dims that are not those of its items.
Result<MemoryShape> shape_of(const Value& value, const MemberDefinition& memory, const TypeRegistry& types);

/// Bytes of one item: exactly for numbers and named arrays, about as many as the message takes for pods.
std::uint64_t memory_item_size(const MemberDefinition& memory, const TypeRegistry& types);

/// Walks a range of a memory as runs of items that lie side by side: copy(first item in the memory, first item in the
/// range, items). `range` is within `dimensions`.
template <class Copy>
void for_each_run(std::span<const std::uint64_t> dimensions, const MemoryRange& range, Copy&& copy) {
  const auto& [position, count] = range;
  for (const auto size : count)
    if (size == 0) return;
  // Dimensions that are taken whole make the run longer; the first that is not ends it.
  std::size_t inner = 0;
  std::uint64_t run = 1;
  bool is_whole = true;
  for (; inner < count.size() && is_whole; ++inner) {
    is_whole = count[inner] == dimensions[inner];
    run *= count[inner];
  }
  MemoryShape at(count.size(), 0);
  for (std::uint64_t done = 0;; done += run) {
    std::uint64_t first = 0;
    std::uint64_t stride = 1;
    for (std::size_t i = 0; i < count.size(); stride *= dimensions[i++]) first += (position[i] + at[i]) * stride;
    copy(first, done, run);
    std::size_t next = inner;
    while (next < count.size() && ++at[next] == count[next]) at[next++] = 0;
    if (next == count.size()) return;
  }
}

}  // namespace rr
