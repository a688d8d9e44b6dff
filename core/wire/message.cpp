#include "core/wire/message.hpp"

#include <algorithm>

namespace rr {

namespace {
constexpr std::size_t block_size = 4096;
}  // namespace

MessageEntry& Message::begin_entry(EntryType type, std::string_view service_path, std::string_view member_name,
                                   std::uint32_t request_id) {
  open_.clear();
  auto& entry = entries.emplace_back();
  entry.type = type;
  entry.service_path = service_path;
  entry.member_name = member_name;
  entry.request_id = request_id;
  entry.first_element = entry.end_element = static_cast<std::uint32_t>(elements.size());
  return entry;
}

MessageElement& Message::append(const MessageElement& element) {
  if (open_.empty())
    ++entries.back().element_count;
  else
    ++elements[open_.back()].count;
  elements.push_back(element);
  const auto end = static_cast<std::uint32_t>(elements.size());
  elements.back().end = end;
  for (const auto index : open_) elements[index].end = end;
  entries.back().end_element = end;
  return elements.back();
}

MessageElement& Message::add(std::string_view name, DataType type, std::uint32_t count, ByteSpan data) {
  MessageElement element;
  element.name = name;
  element.type = type;
  element.count = count;
  element.data = data;
  return append(element);
}

MessageElement& Message::add_numbered(std::int32_t number, DataType type, std::uint32_t count, ByteSpan data) {
  MessageElement element;
  element.key_kind = KeyKind::number;
  element.number = number;
  element.type = type;
  element.count = count;
  element.data = data;
  return append(element);
}

MessageElement& Message::add_text(std::string_view name, std::string_view text) {
  return add(name, DataType::string_t, static_cast<std::uint32_t>(text.size()), as_bytes(text));
}

MessageElement& Message::begin_nested(std::string_view name, DataType type, std::string_view type_name) {
  MessageElement element;
  element.name = name;
  element.type = type;
  element.type_name = type_name;
  auto& added = append(element);
  open_.push_back(static_cast<std::uint32_t>(elements.size() - 1));
  return added;
}

MessageElement& Message::begin_nested_numbered(std::int32_t number, DataType type, std::string_view type_name) {
  MessageElement element;
  element.key_kind = KeyKind::number;
  element.number = number;
  element.type = type;
  element.type_name = type_name;
  auto& added = append(element);
  open_.push_back(static_cast<std::uint32_t>(elements.size() - 1));
  return added;
}

void Message::end_nested() {
  open_.pop_back();
}

ByteSpan Message::store(ByteSpan bytes) {
  if (bytes.empty()) return {};
  std::uint8_t* to = nullptr;
  if (bytes.size() > block_size / 4) {
    // An owner, not a block: an encoded message that references the bytes keeps them after clear().
    std::shared_ptr<std::uint8_t> large(new std::uint8_t[bytes.size()], std::default_delete<std::uint8_t[]>());
    to = large.get();
    owners_.push_back(std::move(large));
  } else {
    if (block_index_ < blocks_.size() && block_used_ + bytes.size() > block_size) {
      ++block_index_;
      block_used_ = 0;
    }
    if (block_index_ == blocks_.size()) blocks_.emplace_back(new std::uint8_t[block_size]);
    to = blocks_[block_index_].get() + block_used_;
    block_used_ += bytes.size();
  }
  std::copy(bytes.begin(), bytes.end(), to);
  return {to, bytes.size()};
}

void Message::clear() {
  header = {};
  clear_kept(entries);
  clear_kept(elements);
  clear_kept(open_);
  if (blocks_.size() > max_kept_bytes / block_size) blocks_.resize(max_kept_bytes / block_size);
  block_index_ = 0;
  block_used_ = 0;
  clear_kept(owners_);
}

}  // namespace rr
