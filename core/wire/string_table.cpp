#include "core/wire/string_table.hpp"

#include <algorithm>

#include "core/support/sort.hpp"
#include "core/wire/variable_int.hpp"

namespace rr {

namespace {

// Codes 0, 4, ... 308, then 512, 516, ... 648.
constexpr std::string_view standard_texts[] = {
    "", "array", "attributes", "AuthenticateUser", "capabilities", "capabilities2", "clientversion", "confirmcodes",
    "Continue", "count", "CreateConnection", "credentials",
    // 48
    "data", "DimCount", "Dimensions", "dims", "errorname", "errorparam", "errorstring", "errorsubname", "extraimports",
    "false", "GetRemoteNodeID", "index",
    // 96
    "Length", "LogoutUser", "MaxTransferSize", "memorypos", "messageversion", "MonitorContinueEnter", "MonitorEnter",
    "MonitorExit", "mutualauth", "nanoseconds", "nodeid", "nodeid",
    // 144
    "nodename", "nolock", "nolockread", "null", "objectimplements", "objecttype", "OK", "packet", "packetnumber",
    "packettime", "parameter", "password",
    // 192
    "pause", "perclient", "readonly", "ReleaseClientObjectLock", "ReleaseObjectLock", "requestack",
    "RequestClientObjectLock", "RequestObjectLock", "resume", "return", "returnservicedefs", "robotraconteur",
    // 240
    "RobotRaconteur", "RobotRaconteur.TimeSpec", "seconds", "seqno", "service", "servicedef", "servicedefs",
    "ServiceIndex", "servicename", "servicepath", "ServiceType", "stringtable",
    // 288
    "timeout", "timespec", "timestamp", "true", "unreliable", "urgent",
    // 512
    "username", "value", "writeonly", "Attributes", "ConnectionURL", "GetDetectedNodes", "GetLocalNodeServices",
    "GetRoutedNodes", "LocalNodeServicesChanged", "Name",
    // 552
    "NodeID", "NodeInfo", "NodeName", "RobotRaconteurServiceIndex", "RobotRaconteurServiceIndex.NodeInfo",
    "RobotRaconteurServiceIndex.ServiceIndex", "RobotRaconteurServiceIndex.ServiceInfo", "RootObjectImplements",
    "RootObjectType", "ServiceIndex", "ServiceIndexConnectionURL", "ServiceInfo",
    // 600
    "node", "level", "component", "componentname", "componentobjectid", "endpoint", "member", "message", "time",
    "sourcefile", "sourceline", "threadid", "fiberid"};

constexpr std::uint32_t last_low_code = 308;
constexpr std::uint32_t first_high_code = 512;
constexpr std::uint32_t first_high_index = last_low_code / 4 + 1;
constexpr std::uint32_t last_code = 648;
static_assert(std::size(standard_texts) == first_high_index + (last_code - first_high_code) / 4 + 1);

constexpr std::uint32_t code_at(std::uint32_t index) {
  return index < first_high_index ? index * 4 : first_high_code + (index - first_high_index) * 4;
}

// FNV-1a, 32 bits.
constexpr std::uint32_t text_hash(std::string_view text) {
  std::uint32_t hash = 2166136261u;
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 16777619u;
  return hash ^ hash >> 16;
}

/// Open addressing over the standard texts, made at compile time: index + 1, 0 = free.
constexpr auto standard_slots = [] {
  std::array<std::uint8_t, 512> slots{};
  for (std::uint32_t index = 0; index < std::size(standard_texts); ++index) {
    std::size_t slot = text_hash(standard_texts[index]) % slots.size();
    while (slots[slot] != 0 && standard_texts[slots[slot] - 1] != standard_texts[index])
      slot = (slot + 1) % slots.size();
    if (slots[slot] == 0) slots[slot] = static_cast<std::uint8_t>(index + 1);
  }
  return slots;
}();

std::optional<std::uint32_t> find_standard(std::string_view text, std::uint32_t hash) {
  for (std::size_t slot = hash % standard_slots.size(); standard_slots[slot] != 0;
       slot = (slot + 1) % standard_slots.size()) {
    const std::uint32_t index = standard_slots[slot] - 1u;
    if (standard_texts[index] == text) return code_at(index);
  }
  return {};
}

}  // namespace

std::optional<std::string_view> standard_text(std::uint32_t code) {
  if (code % 4 != 0 || code > last_code) return {};
  if (code <= last_low_code) return standard_texts[code / 4];
  if (code < first_high_code) return {};
  return standard_texts[first_high_index + (code - first_high_code) / 4];
}

std::optional<std::uint32_t> standard_code(std::string_view text) {
  return find_standard(text, text_hash(text));
}

void LocalTexts::sort() {
  // Equal codes stay in wire order, which is address order: no stable_sort, it would allocate. An empty text has the
  // address behind its length byte like any other.
  rr::sort(rows_, [](const Row& a, const Row& b) {
    return a.code != b.code ? a.code < b.code : a.text.data() < b.text.data();
  });
}

std::optional<std::string_view> LocalTexts::find(std::uint32_t code) const {
  const auto row = std::lower_bound(rows_.begin(), rows_.end(), code,
                                    [](const Row& candidate, std::uint32_t wanted) { return candidate.code < wanted; });
  if (row == rows_.end() || row->code != code) return {};
  return row->text;
}

std::uint32_t StringCoder::note(std::string_view text) {
  if (text.size() > max_text_size) return inline_text;
  const std::uint32_t hash = text_hash(text);
  if (use_standard_)
    if (const auto code = find_standard(text, hash)) return *code;
  if (!use_local_) return inline_text;

  if (texts_.empty()) slots_.fill(0);
  std::size_t slot = hash % slot_count;
  for (; slots_[slot] != 0; slot = (slot + 1) % slot_count) {
    const std::uint32_t index = slots_[slot] - 1u;
    if (texts_[index].text != text) continue;
    ++texts_[index].count;
    return index * 2 + 1;
  }
  if (texts_.size() == max_texts) return inline_text;
  texts_.push_back({text, 1, inline_text});
  slots_[slot] = static_cast<std::uint8_t>(texts_.size());
  return static_cast<std::uint32_t>(texts_.size() * 2 - 1);
}

void StringCoder::choose() {
  std::size_t saved = 0;
  for (auto& each : texts_) {
    if (each.count < 2) continue;
    const auto code = static_cast<std::uint32_t>(local_count_ * 2 + 1);
    const std::size_t inline_size = uint_x_size(static_cast<std::uint32_t>(each.text.size())) + each.text.size();
    const std::size_t entry_size = uint_x_size(code) + inline_size;
    const std::size_t without = each.count * inline_size;
    const std::size_t with = entry_size + each.count * uint_x_size(code);
    if (with >= without || local_size_ + entry_size > max_table_size) continue;
    each.code = code;
    ++local_count_;
    local_size_ += entry_size;
    saved += without - with;
  }
  // The table's own count has to be earned, too.
  if (saved > uint_x_size(static_cast<std::uint32_t>(local_count_))) return;
  for (auto& each : texts_) each.code = inline_text;
  local_count_ = local_size_ = 0;
}

}  // namespace rr
