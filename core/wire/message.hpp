// A message as a flat, borrowed tree: what the codecs read and write. Layer: wire.
// Source: messages spec sections 3, 5, 6, 7.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "core/support/node_id.hpp"

namespace rr {

/// ElementType on the wire, and the type words of service definitions.
enum class DataType : std::uint16_t {
  void_t = 0,
  double_t = 1,
  single_t = 2,
  int8_t = 3,
  uint8_t = 4,
  int16_t = 5,
  uint16_t = 6,
  int32_t = 7,
  uint32_t = 8,
  int64_t = 9,
  uint64_t = 10,
  string_t = 11,
  cdouble_t = 12,
  csingle_t = 13,
  bool_t = 14,
  structure_t = 101,
  map_int32_t = 102,   ///< "vector" on the wire
  map_string_t = 103,  ///< "dictionary" on the wire
  object_t = 104,
  varvalue_t = 105,
  varobject_t = 106,
  list_t = 108,
  pod_t = 109,
  pod_array_t = 110,
  pod_multidimarray_t = 111,
  enum_t = 112,
  namedtype_t = 113,
  namedarray_t = 114,
  namedarray_array_t = 115,
  namedarray_multidimarray_t = 116,
  multidimarray_t = 117,
};

/// Bytes of one item of types 1..14 (string: 1); 0 for every other type.
constexpr std::size_t item_size(DataType type) {
  constexpr std::uint8_t sizes[] = {0, 8, 4, 1, 1, 2, 2, 4, 4, 8, 8, 1, 16, 8, 1};
  const auto index = static_cast<std::uint16_t>(type);
  return index < sizeof(sizes) ? sizes[index] : 0;
}

/// Whether elements of this type hold elements (101, 102, 103, 108..111, 115..117).
constexpr bool is_nested(DataType type) {
  switch (type) {
    case DataType::structure_t:
    case DataType::map_int32_t:
    case DataType::map_string_t:
    case DataType::list_t:
    case DataType::pod_t:
    case DataType::pod_array_t:
    case DataType::pod_multidimarray_t:
    case DataType::namedarray_array_t:
    case DataType::namedarray_multidimarray_t:
    case DataType::multidimarray_t:
      return true;
    default:
      return false;
  }
}

/// Numeric in the sense of service definitions: 1..10 and 12..14 (complex and bool included).
constexpr bool is_numeric(DataType type) {
  return item_size(type) != 0 && type != DataType::string_t;
}

/// "double", "int32", "structure", "vector", ... ; "type 99" style names are never returned: unknown gives "unknown".
std::string_view data_type_name(DataType type);

enum class EntryType : std::uint16_t {
  null = 0,
  stream_op = 1,
  stream_op_ret = 2,
  stream_check_capability = 3,
  stream_check_capability_ret = 4,
  get_service_desc = 101,
  get_service_desc_ret = 102,
  object_type_name = 103,
  object_type_name_ret = 104,
  service_closed = 105,
  service_closed_ret = 106,
  connect_client = 107,
  connect_client_ret = 108,
  disconnect_client = 109,
  disconnect_client_ret = 110,
  connection_test = 111,
  connection_test_ret = 112,
  get_node_info = 113,
  get_node_info_ret = 114,
  reconnect_client = 115,
  reconnect_client_ret = 116,
  node_check_capability = 117,
  node_check_capability_ret = 118,
  get_service_attributes = 119,
  get_service_attributes_ret = 120,
  connect_client_combined = 121,
  connect_client_combined_ret = 122,
  endpoint_check_capability = 501,
  endpoint_check_capability_ret = 502,
  service_check_capability_req = 1101,
  service_check_capability_ret = 1102,
  client_keep_alive_req = 1105,
  client_keep_alive_ret = 1106,
  client_session_op_req = 1107,
  client_session_op_ret = 1108,
  service_path_released_req = 1109,
  service_path_released_ret = 1110,
  property_get_req = 1111,
  property_get_res = 1112,
  property_set_req = 1113,
  property_set_res = 1114,
  function_call_req = 1121,
  function_call_res = 1122,
  generator_next_req = 1123,
  generator_next_res = 1124,
  event_req = 1131,
  event_res = 1132,
  pipe_packet = 1141,
  pipe_packet_ret = 1142,
  pipe_connect_req = 1143,
  pipe_connect_ret = 1144,
  pipe_disconnect_req = 1145,
  pipe_disconnect_ret = 1146,
  pipe_closed = 1147,
  pipe_closed_ret = 1148,
  callback_call_req = 1151,
  callback_call_ret = 1152,
  wire_packet = 1161,
  wire_packet_ret = 1162,
  wire_connect_req = 1163,
  wire_connect_ret = 1164,
  wire_disconnect_req = 1165,
  wire_disconnect_ret = 1166,
  wire_closed = 1167,
  wire_closed_ret = 1168,
  memory_read = 1171,
  memory_read_ret = 1172,
  memory_write = 1173,
  memory_write_ret = 1174,
  memory_get_param = 1175,
  memory_get_param_ret = 1176,
  wire_peek_in_value_req = 1181,
  wire_peek_in_value_ret = 1182,
  wire_peek_out_value_req = 1183,
  wire_peek_out_value_ret = 1184,
  wire_poke_out_value_req = 1185,
  wire_poke_out_value_ret = 1186,
};

/// "PropertyGetReq", ... ; "unknown" for values that no table lists.
std::string_view entry_type_name(EntryType type);

/// Even types answer the odd type before them.
constexpr EntryType reply_type(EntryType request) {
  return static_cast<EntryType>(static_cast<std::uint16_t>(request) + 1);
}

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
