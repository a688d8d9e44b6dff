// Messages of version 4 that say much with few bytes: a text in the string table, named by its code again and again.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/support/bytes.hpp"

namespace rr::test {

namespace detail {

template <class T>
void append_number(Bytes& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// A uint_x in its widest form.
inline void append_uint_x(Bytes& out, std::size_t value) {
  out.push_back(0xfe);
  append_number(out, static_cast<std::uint32_t>(value));
}

/// A structure behind its size.
inline void append_sized(Bytes& out, const Bytes& body) {
  append_uint_x(out, body.size() + 5);
  out.insert(out.end(), body.begin(), body.end());
}

}  // namespace detail

/// A void element of 6 bytes whose name has the code 1.
inline Bytes coded_element() {
  return {6, 0x02, 1, 0, 0, 0};
}

/// A map{string} of `count` times `value`; its own name has the code 1, too.
inline Bytes coded_map(ByteSpan value, std::size_t count) {
  Bytes body{0x02, 1, 103, 0};
  detail::append_uint_x(body, count);
  for (std::size_t i = 0; i < count; ++i) body.insert(body.end(), value.begin(), value.end());
  Bytes map;
  detail::append_sized(map, body);
  return map;
}

/// A property's value from a service: `count` times `element`, and `text` as code 1.
inline Bytes coded_message(std::string_view text, const Bytes& element, std::size_t count) {
  using namespace detail;
  Bytes entry{0, 0x58, 0x04};  // no flags, PropertyGetRes
  append_uint_x(entry, count);
  for (std::size_t i = 0; i < count; ++i) entry.insert(entry.end(), element.begin(), element.end());

  Bytes header{0x20, 1, 1};  // a string table of one text
  append_uint_x(header, text.size());
  header.insert(header.end(), text.begin(), text.end());

  const std::size_t header_size = 10 + 5 + header.size();
  Bytes out{'R', 'R', 'A', 'C'};
  append_number(out, static_cast<std::uint32_t>(header_size + 5 + entry.size()));
  append_number(out, std::uint16_t{4});
  append_uint_x(out, header_size);
  out.insert(out.end(), header.begin(), header.end());
  append_sized(out, entry);
  return out;
}

}  // namespace rr::test
