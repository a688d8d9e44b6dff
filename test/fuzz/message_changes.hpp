// Messages as trees that fuzzers change: entries and elements are taken twice, left out, swapped, resized and retyped.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "core/wire/codec.hpp"

namespace rr::fuzz {

/// A number below the one that is given, which is not 0: what chooses.
using Pick = std::function<std::uint32_t(std::uint32_t below)>;

struct ElementTree {
  MessageElement element;
  std::vector<ElementTree> children = {};
};
struct EntryTree {
  MessageEntry entry;
  std::vector<ElementTree> elements = {};
};

/// Borrows from the message, and what `change()` has made from the tree.
class MessageTree {
 public:
  explicit MessageTree(const Message& message);

  /// Changes one thing.
  void change(const Pick& pick);
  /// Empty: it can't be encoded so.
  Bytes encode(StringTableMode string_table = {}) const;

 private:
  void change_header(const Pick& pick);
  void change_entries(const Pick& pick);
  void change_entry(EntryTree& tree, const Pick& pick);
  void change_elements(std::vector<ElementTree>& elements, const Pick& pick);
  void change_element(ElementTree& tree, const Pick& pick);
  std::string_view other_name(const Pick& pick);
  ByteSpan keep(Bytes bytes);

  MessageHeader header_;
  std::vector<EntryTree> entries_;
  std::vector<std::string_view> names_;  ///< of all elements and members
  std::vector<std::unique_ptr<Bytes>> kept_ = {};
};

/// Bytes of a message, with lies that no tree can tell: a number of 16 or 32 bits somewhere becomes one at a border.
void bend_number(Bytes& bytes, const Pick& pick);

/// Changes the message in data[0, size) and returns its new size, of at most `max_size` bytes. String codes of both
/// tables are understood. Returns  0: it is no message, or none was made that fits.
std::size_t mutate_message(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed);

}  // namespace rr::fuzz
