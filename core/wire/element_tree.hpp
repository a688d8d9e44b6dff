// The part of decoding that both versions share: elements in elements, without recursion. Layer: wire.
// Source: messages spec sections 6, 7 and 14.
#pragma once

#include <algorithm>
#include <boost/container/small_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/wire/byte_reader.hpp"
#include "core/wire/codec.hpp"

namespace rr {

/// Whether an ElementType may stand on the wire.
constexpr bool is_wire_type(DataType type) {
  return type == DataType::void_t || item_size(type) != 0 || is_nested(type);
}

/// Checks a structure's size field that was read at `start` and narrows the reader to that structure.
inline void enter_structure(ByteReader& in, std::size_t start, std::uint32_t size, const char* field) {
  if (!in.ok()) return;
  if (size < in.at() - start)
    return in.fail(ErrorCode::protocol_error, field, start, std::to_string(size) + " is less than its own field");
  if (size > in.limit() - start)
    return in.fail(
        ErrorCode::protocol_error, field, start,
        std::to_string(size) + " bytes, but only " + std::to_string(in.limit() - start) + " are left in what holds it");
  in.set_limit(start + size);
}

/// Rule 13: so many structures must fit into what is left, before anything is done for their sake.
inline void check_count(ByteReader& in, std::size_t at, std::uint32_t count, std::size_t min_size, const char* field) {
  if (in.ok() && std::uint64_t{count} * min_size > in.left())
    in.fail(ErrorCode::protocol_error, field, at,
            std::to_string(count) + " cannot fit into the " + std::to_string(in.left()) + " bytes left");
}

/// Nothing may follow the last entry of a message. Returns   what has failed in it, if anything has.
inline Result<> end_entries(ByteReader& in, std::uint32_t entry_count) {
  if (in.ok() && in.left() != 0)
    in.fail(ErrorCode::protocol_error, "EntryCount", in.at(),
            std::to_string(in.left()) + " bytes left behind the last of " + std::to_string(entry_count) + " entries");
  if (!in.ok()) return in.take_error();
  return {};
}

/// Rules 12 and 14: takes the data of a leaf, which must fill the element exactly.
inline void read_leaf_data(ByteReader& in, std::size_t count_at, MessageElement& element) {
  const std::size_t left = in.left();
  if (element.type == DataType::void_t) {
    if (element.count != 0 || left != 0)
      in.fail(ErrorCode::protocol_error, "DataCount", count_at,
              "void element " + quote(element.name) + " has count " + std::to_string(element.count) + " and " +
                  std::to_string(left) + " data bytes, expected none");
  } else if (std::uint64_t{element.count} * item_size(element.type) != left) {
    in.fail(ErrorCode::data_serialization_error, "DataCount", count_at,
            std::to_string(element.count) + " items of " + std::string(data_type_name(element.type)) + " in element " +
                quote(element.name) + ", but " + std::to_string(left) + " data bytes");
  } else {
    element.data = in.bytes(left, "element data");
  }
}

/// Room for one element, and for twice as many where `more` can still come.
inline void make_room(std::vector<MessageElement>& elements, std::size_t more) {
  if (elements.size() < elements.capacity()) return;
  elements.reserve(std::min(2 * elements.size(), elements.size() + more) + 1);
}

/// Decodes `count` elements and all their descendants, which must fill the reader up to its limit.
/// `Format::read_element(in, element)` reads one element up to and without its DataCount and narrows the reader to it;
/// `Format::read_count(in)` reads a DataCount; `Format::min_element_size` is the smallest element of the version.
template <class Format>
void decode_elements(ByteReader& in, Format& format, std::uint32_t count, const DecodeOptions& options,
                     Message& message) {
  struct Level {
    std::uint32_t parent;     // index in message.elements; not used for the outermost level, which is the entry
    std::uint32_t remaining;  // children still to come
    std::size_t end;
  };
  boost::container::small_vector<Level, 16> levels;
  levels.push_back({0, count, in.limit()});

  while (in.ok()) {
    auto& level = levels.back();
    in.set_limit(level.end);
    if (level.remaining == 0) {
      if (in.left() != 0)
        return in.fail(ErrorCode::protocol_error, "structure end", in.at(),
                       std::to_string(in.left()) + " bytes left behind the last element");
      const auto parent = level.parent;
      levels.pop_back();
      if (levels.empty()) return;
      message.elements[parent].end = static_cast<std::uint32_t>(message.elements.size());
      continue;
    }
    --level.remaining;

    const std::size_t start = in.at();
    if (levels.size() > options.max_depth)
      return in.fail(ErrorCode::protocol_error, "ElementSize", start,
                     "nested deeper than " + std::to_string(options.max_depth) + " elements");
    if (message.elements.size() >= options.max_elements())
      return in.fail(ErrorCode::protocol_error, "ElementSize", start,
                     "more than " + std::to_string(options.max_elements()) + " elements in one message");
    MessageElement element;
    format.read_element(in, element);
    const std::size_t count_at = in.at();
    element.count = format.read_count(in);
    if (!in.ok()) return;

    const auto index = static_cast<std::uint32_t>(message.elements.size());
    element.end = index + 1;
    if (is_nested(element.type)) {
      check_count(in, count_at, element.count, Format::min_element_size, "DataCount");
      levels.push_back({index, element.count, in.limit()});
    } else {
      read_leaf_data(in, count_at, element);
    }
    if (!in.ok()) return;
    make_room(message.elements, (in.size() - in.at()) / Format::min_element_size);
    message.elements.push_back(element);
  }
}

/// Rule 15, checked as soon as the type was read at `at`.
inline void check_wire_type(ByteReader& in, std::size_t at, DataType type) {
  if (in.ok() && !is_wire_type(type))
    in.fail(ErrorCode::data_type_error, "ElementType", at,
            std::to_string(static_cast<std::uint16_t>(type)) + " is not a type that travels in messages");
}

}  // namespace rr
