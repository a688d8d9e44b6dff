// String codes of version 4: the standard table, and the local table that one message carries in its header.
// Layer: wire. Source: messages spec section 4.
#pragma once

#include <array>
#include <boost/container/small_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace rr {

/// Text of a standard code; nothing for codes that the table does not list (odd, in the gap, past the end).
std::optional<std::string_view> standard_text(std::uint32_t code);

/// Code of a text in the standard table, the lowest one where a text stands twice.
std::optional<std::uint32_t> standard_code(std::string_view text);

/// Texts of a received message's local table. Duplicate codes: the first one counts.
/// Texts are borrowed from the message.
class LocalTexts {
 public:
  void add(std::uint32_t code, std::string_view text) { rows_.push_back({code, text}); }
  /// Call once between the last add() and the first find().
  void sort();
  std::optional<std::string_view> find(std::uint32_t code) const;

 private:
  struct Row {
    std::uint32_t code;
    std::string_view text;
  };
  boost::container::small_vector<Row, 32> rows_;
};

/// Gives codes to the texts of one message to be sent: standard codes where the table has the text, else 1, 3, 5, ...
/// Texts are borrowed from the message.
class StringCoder {
 public:
  static constexpr std::size_t max_text_size = 128;    ///< bytes; longer texts stay inline
  static constexpr std::size_t max_table_size = 1024;  ///< bytes of all local entries; what does not fit stays inline

  StringCoder(bool use_standard, bool use_local) : use_standard_(use_standard), use_local_(use_local) {}

  /// The code to send instead of the text; nothing when it has to stay inline.
  std::optional<std::uint32_t> code_for(std::string_view text);

  /// Local texts in code order: text i has code 2 * i + 1.
  std::size_t local_count() const { return local_.size(); }
  std::string_view local_text(std::size_t index) const { return local_[index]; }
  /// Bytes of all local entries on the wire, without the count before them.
  std::size_t local_size() const { return local_size_; }

 private:
  // 1024 bytes hold fewer than 342 entries of at least 3 bytes each (and one empty text of 2).
  static constexpr std::size_t slot_count = 1024;

  bool use_standard_;
  bool use_local_;
  std::size_t local_size_ = 0;
  boost::container::small_vector<std::string_view, 32> local_;
  std::array<std::uint16_t, slot_count> slots_;  ///< hash -> index + 1 in local_; set up by the first local text
};

}  // namespace rr
