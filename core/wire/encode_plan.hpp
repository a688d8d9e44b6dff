// The size pass that both versions share: checks the tree of a message and adds up its bytes. Layer: wire.
// Source: messages spec sections 8 and 11.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/wire/codec.hpp"
#include "core/wire/element_tree.hpp"
#include "core/wire/gather_writer.hpp"
#include "core/wire/message.hpp"

namespace rr {

inline constexpr std::uint64_t max_structure_size = 0xffffffff;
inline constexpr std::size_t max_entry_count = 65535;

inline Error element_error(ErrorCode code, const Message& message, std::size_t index, const std::string& problem) {
  const auto& element = message.elements[index];
  const auto key = element.key_kind == KeyKind::number ? "#" + std::to_string(element.number) : quote(element.name);
  return make_error(code, "encode: element " + key + " (index " + std::to_string(index) + "): " + problem);
}

/// What the codec of a version has to say about one item:
///   const char* refuse(const MessageElement&)               why the version cannot carry it, nullptr when it can
///   std::uint64_t size(const MessageElement&, const EncodePlan::Item&, std::uint64_t body)
/// and the same two for MessageEntry. `body` is the data or the elements inside.
template <class Format>
class SizePass {
 public:
  SizePass(const Message& message, EncodePlan& plan, Format& format)
      : message_(message), plan_(plan), format_(format) {}

  /// Fills in the sizes of the plan, whose vectors must have the lengths of the message's.
  Result<> run() {
    // Children stand behind their parents, so going backwards finds every child's size already known.
    for (std::size_t index = message_.elements.size(); index-- > 0;)
      if (auto sized = size_element(index); !sized) return sized;
    std::size_t first = 0;
    for (std::size_t index = 0; index < message_.entries.size(); ++index) {
      if (auto sized = size_entry(index, first); !sized) return sized;
      first = message_.entries[index].end_element;
    }
    if (first != message_.elements.size()) return protocol_error("encode: elements behind the last entry");
    return {};
  }

  std::uint64_t entries_size() const { return entries_size_; }  ///< bytes of all entries
  std::size_t gathered_size() const { return gathered_size_; }  ///< bytes of payloads that are referenced

 private:
  Result<> size_element(std::size_t index) {
    const auto& element = message_.elements[index];
    if (!is_wire_type(element.type))
      return element_error(
          ErrorCode::data_type_error, message_, index,
          "type " + std::to_string(static_cast<std::uint16_t>(element.type)) + " does not travel in messages");
    if (const char* reason = format_.refuse(element))
      return element_error(ErrorCode::protocol_error, message_, index, reason);
    std::uint64_t body = element.data.size();
    if (is_nested(element.type)) {
      if (element.end <= index || element.end > message_.elements.size() ||
          !add_children(index + 1, element.end, element.count, body) || !element.data.empty())
        return element_error(ErrorCode::protocol_error, message_, index, "its children do not match its count");
    } else if (element.end != index + 1 ||
               std::uint64_t{element.count} * item_size(element.type) != element.data.size() ||
               (element.type == DataType::void_t && element.count != 0)) {
      return element_error(ErrorCode::data_serialization_error, message_, index,
                           std::to_string(element.count) + " items of " + std::string(data_type_name(element.type)) +
                               " but " + std::to_string(element.data.size()) + " data bytes");
    }
    const auto size = format_.size(element, plan_.elements[index], body);
    if (size > max_structure_size)
      return element_error(ErrorCode::protocol_error, message_, index, "larger than 4294967295 bytes");
    plan_.elements[index].size = static_cast<std::uint32_t>(size);
    if (GatherWriter::is_gathered(element.data)) gathered_size_ += element.data.size();
    return {};
  }

  Result<> size_entry(std::size_t index, std::size_t first) {
    const auto& entry = message_.entries[index];
    const auto fail = [index](const char* problem) {
      return protocol_error("encode: entry " + std::to_string(index) + ": " + problem);
    };
    if (const char* reason = format_.refuse(entry)) return fail(reason);
    std::uint64_t body = 0;
    if (entry.first_element != first || entry.end_element < first || entry.end_element > message_.elements.size() ||
        !add_children(first, entry.end_element, entry.element_count, body))
      return fail("its elements do not match its element count");
    const auto size = format_.size(entry, plan_.entries[index], body);
    if (size > max_structure_size) return fail("larger than 4294967295 bytes");
    plan_.entries[index].size = static_cast<std::uint32_t>(size);
    entries_size_ += size;
    return {};
  }

  /// Adds the sizes of the siblings in [index, end); false when they are not `count` whole subtrees.
  bool add_children(std::size_t index, std::size_t end, std::uint32_t count, std::uint64_t& body) const {
    std::uint32_t found = 0;
    for (; index < end; index = message_.elements[index].end, ++found) body += plan_.elements[index].size;
    return index == end && found == count;
  }

  const Message& message_;
  EncodePlan& plan_;
  Format& format_;
  std::uint64_t entries_size_ = 0;
  std::size_t gathered_size_ = 0;
};

/// The last check before writing: section 11's bounds of a whole message. Returns its size.
inline Result<std::size_t> check_message_size(std::uint64_t size, const EncodeOptions& options) {
  if (size > options.max_message_size || size > max_structure_size)
    return make_error(
        ErrorCode::buffer_limit_violation,
        "encode: message has " + std::to_string(size) + " bytes, limit " + std::to_string(options.max_message_size));
  return static_cast<std::size_t>(size);
}

}  // namespace rr
