#include "core/session/capabilities.hpp"

#include <optional>

#include "core/support/hex.hpp"

namespace rr {

namespace {

constexpr std::uint32_t page_mask = 0xFFF00000;
constexpr std::uint32_t page_v2 = 0x02000000;
constexpr std::uint32_t page_v4 = 0x04000000;
constexpr std::uint32_t page_string_table = 0x04100000;
constexpr std::uint32_t enable = 0x1;
constexpr std::uint32_t combined = 0x2;        // pages v2, v4
constexpr std::uint32_t message_local = 0x2;   // page string table
constexpr std::uint32_t standard_table = 0x4;  // page string table

struct Words {
  std::optional<std::uint32_t> v2, v4, string_table;
};

Words sort_pages(std::span<const std::uint32_t> words) {
  Words pages;
  for (const auto word : words) {
    const auto flags = word & ~page_mask;
    switch (word & page_mask) {
      case page_v2:
        pages.v2 = flags;
        break;
      case page_v4:
        pages.v4 = flags;
        break;
      case page_string_table:
        pages.string_table = flags;
        break;
      default:
        break;
    }
  }
  return pages;
}

std::string hex(std::uint32_t word) {
  return "0x" + hex_text(word, 8);
}

}  // namespace

std::vector<std::uint32_t> format_capabilities(const Features& features) {
  std::vector<std::uint32_t> words{page_v2 | enable | (features.combined_v2 ? combined : 0)};
  if (features.v4) {
    words.push_back(page_v4 | enable | (features.combined_v4 ? combined : 0));
    if (features.string_table.is_active())
      words.push_back(page_string_table | enable | (features.string_table.local ? message_local : 0) |
                      (features.string_table.standard ? standard_table : 0));
  }
  return words;
}

Result<Features> negotiate(std::span<const std::uint32_t> words, const Features& own) {
  const auto pages = sort_pages(words);
  if (pages.v2 && !(*pages.v2 & enable))
    return protocol_error("capabilities: word " + hex(page_v2 | *pages.v2) + " disables message version 2");
  Features agreed = legacy_features;
  agreed.combined_v2 = own.combined_v2 && pages.v2 && (*pages.v2 & combined);
  if (own.v4 && pages.v4 && (*pages.v4 & enable)) {
    agreed.v4 = true;
    agreed.combined_v4 = own.combined_v4 && (*pages.v4 & combined);
    if (pages.string_table && (*pages.string_table & enable)) {
      agreed.string_table.local = own.string_table.local && (*pages.string_table & message_local);
      agreed.string_table.standard = own.string_table.standard && (*pages.string_table & standard_table);
    }
  }
  return agreed;
}

Result<Features> accept_reply(std::span<const std::uint32_t> words, const Features& offered) {
  const auto pages = sort_pages(words);
  const auto check = [](std::optional<std::uint32_t> flags, std::uint32_t page, std::uint32_t known,
                        bool was_offered) -> Result<> {
    if (!flags) return {};
    if (*flags & ~known) return protocol_error("capabilities: reply word " + hex(page | *flags) + " has unknown flags");
    if ((*flags & enable) && !was_offered)
      return protocol_error("capabilities: reply word " + hex(page | *flags) + " enables what was not offered");
    return {};
  };
  if (auto ok = check(pages.v2, page_v2, enable | combined, true); !ok) return ok.error();
  if (auto ok = check(pages.v4, page_v4, enable | combined, offered.v4); !ok) return ok.error();
  if (auto ok = check(pages.string_table, page_string_table, enable | message_local | standard_table,
                      offered.string_table.is_active());
      !ok)
    return ok.error();
  if (pages.v2 && !(*pages.v2 & enable)) return protocol_error("capabilities: the reply disables message version 2");

  Features agreed = legacy_features;
  agreed.combined_v2 = offered.combined_v2 && pages.v2 && (*pages.v2 & combined);
  agreed.v4 = pages.v4 && (*pages.v4 & enable);
  agreed.combined_v4 = agreed.v4 && offered.combined_v4 && (*pages.v4 & combined);
  if (pages.string_table && (*pages.string_table & enable)) {
    if (!agreed.v4) return protocol_error("capabilities: the reply has a string table without message version 4");
    agreed.string_table.local = offered.string_table.local && (*pages.string_table & message_local);
    agreed.string_table.standard = offered.string_table.standard && (*pages.string_table & standard_table);
  }
  return agreed;
}

}  // namespace rr
