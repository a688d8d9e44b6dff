#include "test/fuzz/message_changes.hpp"

#include <algorithm>
#include <cstring>
#include <random>

namespace rr::fuzz {

namespace {

/// Where counts, sizes and ids go wrong.
constexpr std::uint32_t borders[] = {0,      1,      2,      3,       0x7f,       0x80,       0xff,       0x100,
                                     0x7fff, 0x8000, 0xffff, 0x10000, 0x7fffffff, 0x80000000, 0xffffffff, 0xfffffff0};
constexpr std::size_t most_elements = 20'000;  ///< so that doubling ends

std::uint32_t border(const Pick& pick) {
  return borders[pick(static_cast<std::uint32_t>(std::size(borders)))];
}

std::vector<ElementTree> trees_of(const Message& message, const ElementRange& range,
                                  std::vector<std::string_view>& names) {
  std::vector<ElementTree> out;
  for (const auto& element : range) {
    names.push_back(element.name);
    out.push_back({element, trees_of(message, message.children_of(element), names)});
  }
  return out;
}

std::size_t count_of(const std::vector<ElementTree>& trees) {
  std::size_t out = trees.size();
  for (const auto& tree : trees) out += count_of(tree.children);
  return out;
}

/// In pre-order, with the counts and ends that the tree has.
void append(const std::vector<ElementTree>& trees, std::vector<MessageElement>& out) {
  for (const auto& tree : trees) {
    const auto at = out.size();
    out.push_back(tree.element);
    if (is_nested(tree.element.type)) {
      append(tree.children, out);
      out[at].count = static_cast<std::uint32_t>(tree.children.size());
      out[at].data = {};
    }
    out[at].end = static_cast<std::uint32_t>(out.size());
  }
}

}  // namespace

MessageTree::MessageTree(const Message& message) : header_(message.header) {
  for (const auto& entry : message.entries) {
    names_.push_back(entry.member_name);
    entries_.push_back({entry, trees_of(message, message.elements_of(entry), names_)});
  }
  if (names_.empty()) names_.push_back("value");
}

ByteSpan MessageTree::keep(Bytes bytes) {
  return *kept_.emplace_back(std::make_unique<Bytes>(std::move(bytes)));
}

std::string_view MessageTree::other_name(const Pick& pick) {
  if (pick(4) != 0) return names_[pick(static_cast<std::uint32_t>(names_.size()))];
  auto name = names_[pick(static_cast<std::uint32_t>(names_.size()))];
  if (pick(2) != 0) return name.substr(0, name.size() / 2);
  Bytes longer(pick(300), static_cast<std::uint8_t>('a' + pick(2) * 200));
  longer.insert(longer.begin(), name.begin(), name.end());
  return as_text(keep(std::move(longer)));
}

void MessageTree::change(const Pick& pick) {
  const auto what = pick(16);
  if (what == 0) return change_header(pick);
  if (what < 4 || entries_.empty()) return change_entries(pick);
  auto& entry = entries_[pick(static_cast<std::uint32_t>(entries_.size()))];
  if (what < 7) return change_entry(entry, pick);
  // Down to somewhere.
  auto* elements = &entry.elements;
  while (!elements->empty() && pick(3) != 0) {
    auto& tree = (*elements)[pick(static_cast<std::uint32_t>(elements->size()))];
    if (!is_nested(tree.element.type)) break;
    elements = &tree.children;
  }
  if (elements->empty() || what < 11) return change_elements(*elements, pick);
  change_element((*elements)[pick(static_cast<std::uint32_t>(elements->size()))], pick);
}

void MessageTree::change_header(const Pick& pick) {
  switch (pick(8)) {
    case 0:
      header_.version = header_.version == 2 ? 4 : 2;
      break;
    case 1:
      header_.sender_endpoint = border(pick);
      break;
    case 2:
      header_.receiver_endpoint = border(pick);
      break;
    case 3:
      header_.sender_node_id.bytes[pick(16)] ^= 1;
      break;
    case 4:
      header_.receiver_node_id.bytes[pick(16)] ^= 1;
      break;
    case 5:
      header_.sender_node_name = other_name(pick);
      break;
    case 6:
      header_.message_res_id = static_cast<std::uint16_t>(border(pick));
      break;
    default:
      header_.priority = static_cast<std::uint16_t>(border(pick));
      header_.is_unreliable = pick(2) != 0;
  }
}

void MessageTree::change_entries(const Pick& pick) {
  const auto count = static_cast<std::uint32_t>(entries_.size());
  if (count == 0) {
    entries_.push_back({});
    return;
  }
  const auto at = pick(count);
  switch (pick(3)) {
    case 0:
      if (count < 200) entries_.insert(entries_.begin() + pick(count + 1), EntryTree(entries_[at]));
      break;
    case 1:
      entries_.erase(entries_.begin() + at);
      break;
    default:
      std::swap(entries_[at], entries_[pick(count)]);
  }
}

void MessageTree::change_entry(EntryTree& tree, const Pick& pick) {
  auto& entry = tree.entry;
  switch (pick(6)) {
    case 0:
      entry.type = static_cast<EntryType>(pick(4) == 0 ? border(pick) : 100 + pick(2) * 1000 + pick(512));
      break;
    case 1:
      entry.request_id = pick(2) != 0 ? border(pick) : entry.request_id + 1;
      break;
    case 2:
      entry.error = static_cast<ErrorCode>(pick(2) != 0 ? pick(64) : border(pick));
      break;
    case 3:
      entry.member_name = other_name(pick);
      break;
    case 4:
      entry.service_path = other_name(pick);
      break;
    default:
      entry.metadata = other_name(pick);
  }
}

void MessageTree::change_elements(std::vector<ElementTree>& elements, const Pick& pick) {
  const auto count = static_cast<std::uint32_t>(elements.size());
  if (count == 0) {
    const std::uint32_t number = border(pick);
    Bytes bytes(4);
    std::memcpy(bytes.data(), &number, 4);
    elements.push_back(
        {{.type = DataType::int32_t, .name = other_name(pick), .count = 1, .data = keep(std::move(bytes))}});
    return;
  }
  const auto at = pick(count);
  switch (pick(5)) {
    case 0:
      elements.insert(elements.begin() + pick(count + 1), ElementTree(elements[at]));
      break;
    case 1:
      elements.erase(elements.begin() + at);
      break;
    case 2:
      std::swap(elements[at], elements[pick(count)]);
      break;
    case 3:  // one becomes its own parent
      elements[at].children = {ElementTree(elements[at])};
      elements[at].element.type = static_cast<DataType>(101 + pick(12));
      break;
    default: {  // all of them twice
      if (count_of(elements) > most_elements) break;
      const auto copies = elements;
      elements.insert(elements.end(), copies.begin(), copies.end());
    }
  }
}

void MessageTree::change_element(ElementTree& tree, const Pick& pick) {
  auto& element = tree.element;
  switch (pick(6)) {
    case 0:
      element.name = other_name(pick);
      break;
    case 1:
      element.type_name = other_name(pick);
      break;
    case 2:
      element.key_kind = static_cast<KeyKind>(pick(3));
      element.number = static_cast<std::int32_t>(border(pick));
      break;
    case 3: {  // another type for the same bytes
      if (is_nested(element.type)) {
        element.type = static_cast<DataType>(101 + pick(12));
        break;
      }
      element.type = static_cast<DataType>(pick(15));
      const auto size = std::max<std::size_t>(1, item_size(element.type));
      element.count = element.type == DataType::void_t ? 0 : static_cast<std::uint32_t>(element.data.size() / size);
      element.data = element.data.first(element.count * size);
      break;
    }
    case 4: {  // another count of items
      if (is_nested(element.type) || element.type == DataType::void_t) break;
      const auto size = item_size(element.type);
      const auto count = pick(3) == 0 ? pick(2) * 1000 : pick(2) != 0 ? element.count / 2 : element.count + 1;
      Bytes bytes(element.data.begin(), element.data.end());
      bytes.resize(count * size, 0xff);
      element.count = count;
      element.data = keep(std::move(bytes));
      break;
    }
    default: {
      if (element.data.empty()) break;
      Bytes bytes(element.data.begin(), element.data.end());
      if (pick(2) != 0)
        bytes[pick(static_cast<std::uint32_t>(bytes.size()))] ^= static_cast<std::uint8_t>(1u << pick(8));
      else
        bend_number(bytes, pick);
      element.data = keep(std::move(bytes));
    }
  }
}

Bytes MessageTree::encode(StringTableMode string_table) const {
  Message message;
  message.header = header_;
  for (const auto& tree : entries_) {
    auto entry = tree.entry;
    entry.first_element = static_cast<std::uint32_t>(message.elements.size());
    append(tree.elements, message.elements);
    entry.end_element = static_cast<std::uint32_t>(message.elements.size());
    entry.element_count = static_cast<std::uint32_t>(tree.elements.size());
    message.entries.push_back(entry);
  }
  EncodedMessage encoded;
  if (!rr::encode(message, {.string_table = string_table}, encoded)) return {};
  return encoded.to_bytes();
}

void bend_number(Bytes& bytes, const Pick& pick) {
  const std::size_t size = pick(2) != 0 ? 4 : 2;
  if (bytes.size() < size) return;
  const auto number = border(pick);
  std::memcpy(bytes.data() + pick(static_cast<std::uint32_t>(bytes.size() - size + 1)), &number, size);
}

std::size_t mutate_message(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  if (size < 16) return 0;
  Bytes before(data, data + size);
  const auto told = static_cast<std::uint32_t>(size);
  std::memcpy(before.data(), "RRAC", 4);
  std::memcpy(before.data() + 4, &told, sizeof(told));
  constexpr StringTableMode all_codes{.local = true, .standard = true};
  Message message;
  if (!decode(before, {.string_table = all_codes}, message)) return 0;
  std::minstd_rand random(seed);
  const Pick pick = [&random](std::uint32_t below) { return static_cast<std::uint32_t>(random()) % below; };
  MessageTree tree(message);
  for (auto changes = 1 + pick(3); changes > 0; --changes) tree.change(pick);
  auto after = tree.encode(pick(2) != 0 ? all_codes : StringTableMode{});
  if (after.empty() || after.size() > max_size) return 0;
  if (pick(4) == 0) bend_number(after, pick);
  std::copy(after.begin(), after.end(), data);
  return after.size();
}

}  // namespace rr::fuzz
