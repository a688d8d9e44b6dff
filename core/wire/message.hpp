// A message as a flat, borrowed tree: what the codecs read and write. Layer: wire.
// Source: messages spec sections 3, 5, 6.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "core/support/node_id.hpp"
#include "core/wire/data_type.hpp"
#include "core/wire/entry_type.hpp"

namespace rr {

struct MessageHeader {
  std::uint16_t version = 4;  ///< 2 or 4
  NodeId sender_node_id;
  NodeId receiver_node_id;
  std::string_view sender_node_name;
  std::string_view receiver_node_name;
  std::uint32_t sender_endpoint = 0;
  std::uint32_t receiver_endpoint = 0;
  std::string_view metadata;
  std::uint16_t message_id = 0;
  std::uint16_t message_res_id = 0;
  std::optional<std::uint16_t> priority = {};  ///< v4 only
  bool is_unreliable = false;                  ///< v4 only
  bool has_routing = true;                     ///< v4: node ids and names are on the wire
  bool has_endpoints = true;                   ///< v4: endpoints are on the wire
  ByteSpan extended = {};                      ///< v4 only
};

/// An element's key: a text, a number (v4 numbered form; decimal text in v2), or neither.
enum class KeyKind : std::uint8_t { name, number, none };

struct MessageElement {
  KeyKind key_kind = KeyKind::name;
  DataType type = DataType::void_t;
  std::int32_t number = 0;
  std::string_view name = {};
  std::string_view type_name = {};
  std::string_view metadata = {};
  ByteSpan extended = {};   ///< v4 only
  std::uint32_t count = 0;  ///< DataCount: items, or number of direct children for nested types
  std::uint32_t end = 0;    ///< index one past this element's last descendant in Message::elements
  ByteSpan data = {};       ///< raw little-endian items of types 1..14 (count * item_size bytes), any alignment

  std::string_view text() const { return as_text(data); }
};

struct MessageEntry {
  EntryType type = EntryType::null;
  ErrorCode error = ErrorCode::none;
  std::uint32_t request_id = 0;
  std::string_view service_path = {};
  std::string_view member_name = {};
  std::string_view metadata = {};
  ByteSpan extended = {};           ///< v4 only
  std::uint32_t first_element = 0;  ///< index of the first element in Message::elements
  std::uint32_t end_element = 0;    ///< one past the last descendant
  std::uint32_t element_count = 0;  ///< direct children
};

class Message;

/// Range over siblings: skips descendants by MessageElement::end.
class ElementRange {
 public:
  class iterator {
   public:
    using value_type = MessageElement;
    using difference_type = std::ptrdiff_t;
    iterator() = default;
    iterator(const MessageElement* base, std::uint32_t index) : base_(base), index_(index) {}
    const MessageElement& operator*() const { return base_[index_]; }
    const MessageElement* operator->() const { return base_ + index_; }
    iterator& operator++() {
      index_ = base_[index_].end;
      return *this;
    }
    iterator operator++(int) {
      auto before = *this;
      ++*this;
      return before;
    }
    bool operator==(const iterator& other) const { return index_ == other.index_; }

   private:
    const MessageElement* base_ = nullptr;
    std::uint32_t index_ = 0;
  };

  ElementRange(const MessageElement* base, std::uint32_t first, std::uint32_t end, std::uint32_t count)
      : base_(base), first_(first), end_(end), count_(count) {}
  iterator begin() const { return {base_, first_}; }
  iterator end() const { return {base_, end_}; }
  std::uint32_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  /// First element of this name, or nullptr.
  const MessageElement* find(std::string_view name) const {
    for (const auto& element : *this)
      if (element.key_kind == KeyKind::name && element.name == name) return &element;
    return nullptr;
  }

 private:
  const MessageElement* base_;
  std::uint32_t first_;
  std::uint32_t end_;
  std::uint32_t count_;
};

/// One message. Everything in it is borrowed: from the received bytes after decode(), from the caller, from static
/// text or from store() while it is built. Reuse one object: clear() keeps the memory of small messages
/// (max_kept_bytes), so that a steady stream of them allocates nothing.
///
/// Elements lie in pre-order in one vector; `end` skips a subtree.
class Message {
 public:
  MessageHeader header;
  std::vector<MessageEntry> entries;
  std::vector<MessageElement> elements;

  ElementRange elements_of(const MessageEntry& entry) const {
    return {elements.data(), entry.first_element, entry.end_element, entry.element_count};
  }
  ElementRange children_of(const MessageElement& parent) const {
    const auto index = static_cast<std::uint32_t>(&parent - elements.data());
    return {elements.data(), index + 1, parent.end, is_nested(parent.type) ? parent.count : 0};
  }

  // --- building: begin_entry, then add / begin_nested ... end_nested in order ---

  MessageEntry& begin_entry(EntryType type, std::string_view service_path, std::string_view member_name,
                            std::uint32_t request_id = 0);
  /// Adds a leaf (type 0..14) to the innermost open nested element or the last entry.
  MessageElement& add(std::string_view name, DataType type, std::uint32_t count, ByteSpan data);
  MessageElement& add_numbered(std::int32_t number, DataType type, std::uint32_t count, ByteSpan data);
  MessageElement& add_text(std::string_view name, std::string_view text);
  /// Adds one number whose bytes are stored in the message.
  template <class T>
  MessageElement& add_scalar(std::string_view name, DataType type, T value) {
    return add(name, type, 1, store(ByteSpan(reinterpret_cast<const std::uint8_t*>(&value), sizeof(T))));
  }
  /// Opens a nested element; its children follow until end_nested(). `count` is kept up to date.
  MessageElement& begin_nested(std::string_view name, DataType type, std::string_view type_name = {});
  MessageElement& begin_nested_numbered(std::int32_t number, DataType type, std::string_view type_name = {});
  void end_nested();
  /// How many nested elements are open.
  std::size_t open_depth() const { return open_.size(); }

  /// Copies bytes into the message's own storage; valid until clear().
  ByteSpan store(ByteSpan bytes);
  std::string_view store(std::string_view text) { return as_text(store(as_bytes(text))); }
  /// Keeps the owner of borrowed payload alive until clear(), and through encoding until the bytes are sent.
  void keep_alive(std::shared_ptr<const void> owner) { owners_.push_back(std::move(owner)); }
  const std::vector<std::shared_ptr<const void>>& owners() const { return owners_; }

  void clear();

 private:
  MessageElement& append(const MessageElement& element);

  std::vector<std::uint32_t> open_;  ///< indices of open nested elements
  std::vector<std::unique_ptr<std::uint8_t[]>> blocks_;
  std::size_t block_index_ = 0;
  std::size_t block_used_ = 0;
  std::vector<std::shared_ptr<const void>> owners_;
};

}  // namespace rr
