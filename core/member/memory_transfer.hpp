// One read or write of a client's memory, cut into requests below the transfer limit. Layer: member.
// Source: sessions spec section 2.14.
#pragma once

#include <optional>
#include <string>

#include "core/member/memory.hpp"

namespace rr {

/// The parts of a range in order, none larger than a number of items: leading dimensions whole, the first that does not
/// fit in pieces, one slice at a time of those behind it. So each part lies in one piece in the range.
class MemoryParts {
 public:
  /// `largest` at least 1. The product of the counts fits 64 bits.
  MemoryParts(MemoryRange range, std::uint64_t largest);
  /// The next part; none after the last, and none at all of an empty range.
  std::optional<MemoryRange> next();

 private:
  MemoryRange range_;
  std::size_t split_ = 0;   ///< the dimension that is cut
  std::uint64_t step_ = 1;  ///< its items in one part
  MemoryShape at_;
  bool is_done_ = false;
};

/// Items [first, first + items) of a value of this memory, in the shape `count`, whose product is `items`.
Value memory_slice(const Value& whole, std::uint64_t first, std::uint64_t items, std::span<const std::uint64_t> count,
                   const MemberDefinition& memory, const TypeRegistry& types);

/// Puts parts together, in their order. Grows with what has come, whatever was asked for.
class MemoryCollector {
 public:
  /// `part` is of the memory's type.
  void add(Value part);
  /// All items, in the shape `count`; counts are below 2^32.
  Value take(std::span<const std::uint64_t> count, const MemberDefinition& memory, const TypeRegistry& types);

 private:
  std::optional<Value> only_;  ///< the first part, which is all of it mostly
  Bytes numbers_;
  std::vector<Structure> pods_;

  void append(const Value& part);
};

/// What a client session keeps of a transfer between two requests.
struct MemoryTransfer {
  /// What the next reply is about; replaced: the object is another one now, and that reply is the last.
  enum class Stage : std::uint8_t { dimensions, limit, data, replaced };

  bool is_write = false;
  Stage stage = Stage::dimensions;
  std::string path;
  MemoryRange range;
  Value data = {};                        ///< write: all of it
  std::optional<MemoryParts> parts = {};  ///< from stage data on
  MemoryRange part = {};                  ///< under way
  std::uint64_t items_done = 0;
  MemoryCollector collected = {};
};

}  // namespace rr
