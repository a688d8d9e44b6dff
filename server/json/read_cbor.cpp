// Reads CBOR. Layer: json. Source: RFC 8949.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "core/support/utf8.hpp"
#include "server/json/json_builder.hpp"

namespace rr {

namespace {

enum class CborType : std::uint8_t { natural, negative, bytes, text, array, map, tag, simple };

constexpr std::uint8_t open_ended = 31;

/// The first byte of an item and the number in or behind it: a value, a length, a tag.
struct CborHead {
  CborType type;
  std::uint8_t detail;
  std::uint64_t number;
};

/// Whether there is a head at `at`, which is then behind it.
bool read_cbor_head(ByteSpan bytes, std::size_t& at, CborHead& head) {
  if (at == bytes.size()) return false;
  const auto first = bytes[at++];
  head = {static_cast<CborType>(first >> 5), static_cast<std::uint8_t>(first & 31), 0};
  if (head.detail < 24) {
    head.number = head.detail;
    return true;
  }
  if (head.detail == open_ended) return true;
  if (head.detail > 27) return false;
  const std::size_t size = std::size_t{1} << (head.detail - 24);
  if (size > bytes.size() - at) return false;
  for (std::size_t i = 0; i < size; ++i) head.number = head.number << 8 | bytes[at++];
  return true;
}

double half_precision(std::uint64_t bits) {
  const int exponent = static_cast<int>(bits >> 10 & 31);
  const auto mantissa = static_cast<double>(bits & 1023);
  double value = 0;
  if (exponent == 0)
    value = std::ldexp(mantissa, -24);
  else if (exponent < 31)
    value = std::ldexp(mantissa + 1024, exponent - 25);
  else
    value = mantissa == 0 ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
  return (bits & 0x8000) != 0 ? -value : value;
}

/// Items in items lie on a list, not on the stack: no input makes the reader recurse.
class CborReader {
 public:
  explicit CborReader(ByteSpan bytes) : bytes_(bytes) {}

  Result<Json> read();

 private:
  static constexpr std::uint8_t break_byte = 0xff;

  struct Level {
    bool is_map;
    bool is_open_ended;
    std::uint64_t remaining;  ///< items of an array, pairs of a map
  };

  bool read_document();
  bool read_item();
  bool read_key();
  bool read_simple(const CborHead& head);
  bool read_tagged(std::uint64_t tag);
  bool begin(const CborHead& head, Json container);
  bool is_at_end(Level& level);
  bool take_break();
  bool read_head(CborHead& head);
  /// The content of a text or of bytes, in one piece or in many; those lie in no others.
  template <class Out>
  bool read_string(const CborHead& head, Out& out);
  template <class Out>
  bool read_piece(const CborHead& head, Out& out);
  bool read_text(const CborHead& head, std::string& out);
  bool read_bytes(const CborHead& head, std::optional<std::uint64_t> tag);
  bool fail_here(const char* why = "is no CBOR") {
    return builder_.fail(std::string(why) + " at byte " + std::to_string(item_at_));
  }

  ByteSpan bytes_;
  std::size_t at_ = 0;
  std::size_t item_at_ = 0;  ///< where the last head began
  JsonBuilder builder_;
  std::vector<Level> levels_;
};

Result<Json> CborReader::read() {
  if (!read_document()) return unreadable_document("CBOR", builder_.why());
  return {boost::system::in_place_value, builder_.take()};
}

bool CborReader::read_document() {
  if (!read_item()) return false;
  while (!levels_.empty()) {
    auto& level = levels_.back();
    if (is_at_end(level)) {
      levels_.pop_back();
      builder_.end();
      continue;
    }
    if (level.is_map && !read_key()) return false;
    if (!read_item()) return false;
  }
  item_at_ = at_;
  return at_ == bytes_.size() || fail_here();
}

bool CborReader::read_item() {
  CborHead head;
  if (!read_head(head)) return false;
  switch (head.type) {
    case CborType::natural:
      return head.detail != open_ended ? builder_.add_value(head.number) : fail_here();
    case CborType::negative:
      if (head.detail == open_ended) return fail_here();
      // -1 - number; beyond 64 bits it becomes a double, as in JSON.
      if (head.number > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
        return builder_.add_value(-1.0 - static_cast<double>(head.number));
      return builder_.add_value(-1 - static_cast<std::int64_t>(head.number));
    case CborType::bytes:
      return read_bytes(head, {});
    case CborType::text: {
      std::string text;
      return read_text(head, text) && builder_.add_value(std::move(text));
    }
    case CborType::array:
      return begin(head, Json::array());
    case CborType::map:
      return begin(head, Json::object());
    case CborType::tag:
      return head.detail != open_ended ? read_tagged(head.number) : fail_here();
    case CborType::simple:
      return read_simple(head);
  }
  return fail_here();
}

bool CborReader::read_key() {
  CborHead head;
  std::string key;
  if (!read_head(head)) return false;
  if (head.type != CborType::text) return fail_here("has a key that is no text");
  return read_text(head, key) && builder_.set_key(std::move(key));
}

bool CborReader::read_simple(const CborHead& head) {
  switch (head.detail) {
    case 20:
    case 21:
      return builder_.add_value(head.detail == 21);
    case 22:
      return builder_.add_value(nullptr);
    case 23:
      return fail_here("has undefined, which is no value,");
    case 25:
      return builder_.add_value(half_precision(head.number));
    case 26:
      return builder_.add_value(static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(head.number))));
    case 27:
      return builder_.add_value(std::bit_cast<double>(head.number));
    default:
      return fail_here();
  }
}

bool CborReader::read_tagged(std::uint64_t tag) {
  CborHead head;
  if (!read_head(head)) return false;
  if (head.type == CborType::bytes) return read_bytes(head, tag);
  return builder_.fail("has the tag " + std::to_string(tag) + " before what is no bytes (byte " +
                       std::to_string(item_at_) + ")");
}

bool CborReader::begin(const CborHead& head, Json container) {
  levels_.push_back({head.type == CborType::map, head.detail == open_ended, head.number});
  return builder_.begin(std::move(container));
}

bool CborReader::is_at_end(Level& level) {
  if (level.is_open_ended) return take_break();
  if (level.remaining == 0) return true;
  --level.remaining;
  return false;
}

bool CborReader::take_break() {
  if (at_ == bytes_.size() || bytes_[at_] != break_byte) return false;
  ++at_;
  return true;
}

bool CborReader::read_head(CborHead& head) {
  item_at_ = at_;
  return read_cbor_head(bytes_, at_, head) || fail_here();
}

template <class Out>
bool CborReader::read_string(const CborHead& head, Out& out) {
  if (head.detail != open_ended) return read_piece(head, out);
  CborHead piece;
  while (!take_break())
    if (!read_head(piece) || piece.type != head.type || !read_piece(piece, out)) return fail_here();
  return true;
}

template <class Out>
bool CborReader::read_piece(const CborHead& head, Out& out) {
  if (head.detail == open_ended || head.number > bytes_.size() - at_) return fail_here();
  const auto piece = bytes_.subspan(at_, static_cast<std::size_t>(head.number));
  out.insert(out.end(), piece.begin(), piece.end());
  at_ += piece.size();
  return true;
}

bool CborReader::read_text(const CborHead& head, std::string& out) {
  const auto begin = item_at_;
  if (!read_string(head, out)) return false;
  return is_utf8(out) || builder_.fail("has a text that is not UTF-8 at byte " + std::to_string(begin));
}

bool CborReader::read_bytes(const CborHead& head, std::optional<std::uint64_t> tag) {
  Bytes bytes;
  if (!read_string(head, bytes)) return false;
  return builder_.add_value(tag ? Json::binary(std::move(bytes), *tag) : Json::binary(std::move(bytes)));
}

}  // namespace

std::size_t memory_of_cbor(ByteSpan bytes) {
  std::size_t held = heap::document;
  CborHead head;
  for (std::size_t at = 0; read_cbor_head(bytes, at, head);) {
    held += heap::item;
    if (head.type == CborType::array) held += heap::array;
    if (head.type == CborType::map) held += heap::object;
    if (head.type != CborType::text && head.type != CborType::bytes) continue;
    // A key takes a pair's place, which has room for its value too.
    held += std::max(heap::text, heap::pair - heap::item);
    if (head.detail == open_ended) continue;
    if (head.number > bytes.size() - at) break;
    held += heap::byte * static_cast<std::size_t>(head.number);
    at += static_cast<std::size_t>(head.number);
  }
  return held;
}

Result<Json> read_cbor(ByteSpan bytes) {
  return CborReader(bytes).read();
}

}  // namespace rr
