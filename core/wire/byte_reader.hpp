// A bounded cursor over received bytes that remembers its first failure. Layer: wire. Source: messages spec section 1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "core/support/node_id.hpp"
#include "core/wire/variable_int.hpp"

namespace rr {

/// Reads little-endian fields up to a limit, the end of the structure that is being read.
///
/// After the first failure every read gives 0 or an empty view and ok() is false, so that a structure's fields can be
/// read in one go and checked once. Nothing read may be acted upon before ok() was looked at.
/// `field` names what is read, for the error text; it must be static text.
class ByteReader {
 public:
  explicit ByteReader(ByteSpan bytes) : bytes_(bytes), limit_(bytes.size()) {}

  std::size_t at() const { return at_; }
  std::size_t limit() const { return limit_; }
  std::size_t size() const { return bytes_.size(); }
  std::size_t left() const { return limit_ - at_; }
  /// `end` must lie between at() and the size of the input. After a failure there is nothing left to read.
  void set_limit(std::size_t end) {
    if (!failed_) limit_ = end;
  }

  bool ok() const { return !failed_; }
  Error take_error() { return std::move(error_); }
  /// Records a failure unless there is one already; the text becomes "<field> at byte <at>: <problem>".
  void fail(ErrorCode code, const char* field, std::size_t at, std::string_view problem);

  template <class T>
  T number(const char* field) {
    if (!require(sizeof(T), field)) return T{};
    const T value = load<T>(bytes_.data() + at_);
    at_ += sizeof(T);
    return value;
  }

  std::uint32_t uint_x(const char* field) {
    const std::size_t start = at_;
    const auto first = number<std::uint8_t>(field);
    if (first < uint_x_u16) return first;
    if (first == uint_x_u16) return number<std::uint16_t>(field);
    if (first == uint_x_u32) return number<std::uint32_t>(field);
    fail(ErrorCode::protocol_error, field, start, "a uint_x cannot start with FF");
    return 0;
  }

  std::int32_t int_x(const char* field) {
    const std::size_t start = at_;
    const auto first = number<std::int8_t>(field);
    if (first < int_x_i16) return first;
    if (first == int_x_i16) return number<std::int16_t>(field);
    if (first == int_x_i32) return number<std::int32_t>(field);
    fail(ErrorCode::protocol_error, field, start, "an int_x cannot start with 7F");
    return 0;
  }

  /// A view of the next `size` bytes.
  ByteSpan bytes(std::size_t size, const char* field) {
    if (!require(size, field)) return {};
    const auto view = bytes_.subspan(at_, size);
    at_ += size;
    return view;
  }

  std::string_view text16(const char* field) { return as_text(bytes(number<std::uint16_t>(field), field)); }
  std::string_view text_x(const char* field) { return as_text(bytes(uint_x(field), field)); }
  ByteSpan bytes_x(const char* field) { return bytes(uint_x(field), field); }

  NodeId node_id(const char* field) {
    NodeId id;
    if (const auto view = bytes(id.bytes.size(), field); !view.empty())
      std::memcpy(id.bytes.data(), view.data(), id.bytes.size());
    return id;
  }

 private:
  bool require(std::size_t size, const char* field) {
    if (size <= limit_ - at_) [[likely]]
      return true;
    fail_short(size, field);
    return false;
  }
  void fail_short(std::size_t size, const char* field);

  ByteSpan bytes_;
  std::size_t at_ = 0;
  std::size_t limit_;
  bool failed_ = false;
  Error error_;
};

}  // namespace rr
