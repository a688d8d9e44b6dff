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
/// to texts that the message has so often that it gets smaller by them. First every text is counted with note(), in the
/// order of the specification; then choose() decides, and code_of() tells what has become of each.
/// Texts are borrowed from the message.
class StringCoder {
 public:
  static constexpr std::uint32_t inline_text = 0xffffffff;  ///< instead of a code: the text itself is sent
  static constexpr std::size_t max_text_size = 128;         ///< bytes; longer texts stay inline
  static constexpr std::size_t max_table_size = 1024;  ///< bytes of all local entries; what does not fit stays inline
  static constexpr std::size_t max_texts = 255;        ///< that are counted; what comes behind them stays inline

  StringCoder(bool use_standard, bool use_local) : use_standard_(use_standard), use_local_(use_local) {}

  /// Returns  what code_of() wants to know: a standard code, inline_text, or a place in the list of local texts.
  std::uint32_t note(std::string_view text);
  /// Once, behind the last note().
  void choose();
  std::uint32_t code_of(std::uint32_t noted) const {
    return noted == inline_text || noted % 2 == 0 ? noted : texts_[noted / 2].code;
  }

  /// Calls `visit(code, text)` for each entry of the local table, in the order of codes.
  template <class Visit>
  void visit_local(Visit&& visit) const {
    for (const auto& each : texts_)
      if (each.code != inline_text) visit(each.code, each.text);
  }
  std::size_t local_count() const { return local_count_; }
  /// Bytes of all local entries on the wire, without the count before them.
  std::size_t local_size() const { return local_size_; }

 private:
  struct Text {
    std::string_view text;
    std::uint32_t count = 0;
    std::uint32_t code = inline_text;
  };
  static constexpr std::size_t slot_count = 512;

  bool use_standard_;
  bool use_local_;
  std::size_t local_count_ = 0;
  std::size_t local_size_ = 0;
  boost::container::small_vector<Text, 32> texts_;
  std::array<std::uint8_t, slot_count> slots_;  ///< hash -> index + 1 in texts_; set up by the first local text
};

}  // namespace rr
