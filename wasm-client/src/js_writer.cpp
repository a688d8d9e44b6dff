#include "wasm-client/src/js_writer.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

/// Of ts/js_values.ts.
extern "C" __attribute__((import_module("js"), import_name("build"))) rr::JsHandle rr_js_build(const void* at);

namespace rr {

namespace {

/// Names that JavaScript has decoded, by number. They are never forgotten, so that there is a bound: names beyond it
/// are decoded each time.
class KnownNames {
 public:
  static constexpr std::uint16_t none = 0xffff;
  struct Found {
    std::uint16_t number;
    bool is_new;
  };

  Found find(std::string_view name) {
    // Most names come behind the one that they came behind before.
    if (last_ != none && names_[names_[last_].next].text == name) return {last_ = names_[last_].next, false};
    const auto found = look_up(name);
    if (last_ != none && found.number != none) names_[last_].next = found.number;
    last_ = found.number;
    return found;
  }

 private:
  static constexpr std::size_t limit = 1024;
  static constexpr std::size_t longest = 64;
  struct Name {
    std::string text;
    std::uint16_t next = 0;
  };

  Found look_up(std::string_view name) {
    if (name.size() > longest) return {none, false};
    std::uint32_t hash = 2166136261;  // FNV-1a
    for (const char c : name) hash = (hash ^ static_cast<std::uint8_t>(c)) * 16777619;
    for (std::size_t at = hash % slots_.size();; at = (at + 1) % slots_.size()) {
      if (slots_[at] == 0) {
        if (names_.size() == limit) return {none, false};
        names_.push_back({std::string(name)});
        slots_[at] = static_cast<std::uint16_t>(names_.size());
        return {static_cast<std::uint16_t>(names_.size() - 1), true};
      }
      const auto number = static_cast<std::uint16_t>(slots_[at] - 1);
      if (names_[number].text == name) return {number, false};
    }
  }

  std::vector<Name> names_;
  std::array<std::uint16_t, 2 * limit> slots_{};  ///< 1 + number; at most half of them are taken
  std::uint16_t last_ = none;
};

/// An instance of the module has one page.
KnownNames known_names;

/// What is written. It grows to the largest value, and is given back where that was a large one.
class Written {
 public:
  template <class T>
  [[gnu::always_inline]] void put(T value) {
    put(&value, sizeof(value));
  }
  [[gnu::always_inline]] void put(const void* from, std::size_t size) {
    if (size > bytes_.size() - size_) [[unlikely]]
      grow(size);
    std::memcpy(bytes_.data() + size_, from, size);
    size_ += size;
  }

  /// What was written, until something is written again: nothing of it stays, also if who reads it throws.
  const std::uint8_t* take() {
    size_ = 0;
    return bytes_.data();
  }
  void give_back() {
    if (bytes_.size() > kept) bytes_ = Bytes();
  }

 private:
  static constexpr std::size_t kept = 64 * 1024;

  [[gnu::noinline]] void grow(std::size_t size) { bytes_.resize(std::max(2 * bytes_.size(), size_ + size + 512)); }

  Bytes bytes_;
  std::size_t size_ = 0;
};

Written written;

void put_address(ByteSpan bytes) {
  written.put(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(bytes.data())));
  written.put(static_cast<std::uint32_t>(bytes.size()));
}

void put_text(std::string_view text) {
  written.put(static_cast<std::uint32_t>(text.size()));
  written.put(text.data(), text.size());
}

// In place of the number of a name, as in ts/js_reader.ts.
constexpr std::uint16_t new_name = 0x8000;    ///< with a number: a text follows, which has this number from now on
constexpr std::uint16_t other_name = 0xffff;  ///< a text follows

template <class Code>
void put_name(Code code, std::string_view name) {
  const auto [number, is_new] = known_names.find(name);
  written.put(code);
  written.put(number == KnownNames::none ? other_name
                                         : static_cast<std::uint16_t>(is_new ? new_name | number : number));
  if (is_new || number == KnownNames::none) put_text(name);
}

}  // namespace

enum class JsWriter::Code : std::uint8_t {
  end,
  null,
  yes,
  no,
  number,
  int64,
  uint64,
  text,
  name,
  items,
  booleans,
  parts,
  value,
  object,
  array,
  map,
  mark,
};

void JsWriter::null() {
  written.put(Code::null);
}
void JsWriter::boolean(bool value) {
  written.put(value ? Code::yes : Code::no);
}
void JsWriter::number(double value) {
  written.put(Code::number);
  written.put(value);
}
void JsWriter::bigint(const std::uint8_t* bytes, bool is_unsigned) {
  written.put(is_unsigned ? Code::uint64 : Code::int64);
  written.put(bytes, 8);
}
void JsWriter::text(std::string_view text) {
  written.put(Code::text);
  put_text(text);
}
void JsWriter::name(std::string_view text) {
  put_name(Code::name, text);
}
void JsWriter::items(DataType type, ByteSpan bytes) {
  written.put(Code::items);
  written.put(static_cast<std::uint8_t>(type));
  put_address(bytes);
}
void JsWriter::booleans(ByteSpan bytes) {
  written.put(Code::booleans);
  put_address(bytes);
}
void JsWriter::parts(DataType type, ByteSpan bytes, int part) {
  written.put(Code::parts);
  const auto part_type = type == DataType::cdouble_t ? DataType::double_t : DataType::single_t;
  written.put(static_cast<std::uint8_t>(part_type));
  written.put(static_cast<std::uint8_t>(part));
  put_address(bytes);
}
void JsWriter::value(const JsValue& js) {
  written.put(Code::value);
  written.put(js.handle());
}

void JsWriter::begin_object() {
  written.put(Code::object);
  ++open_;
}
void JsWriter::begin_array() {
  written.put(Code::array);
  ++open_;
}
void JsWriter::begin_map() {
  written.put(Code::map);
  ++open_;
}
void JsWriter::end() {
  written.put(Code::end);
  --open_;
}
JsWriter& JsWriter::key(std::string_view name) {
  this->name(name);
  return *this;
}
void JsWriter::mark(std::string_view type) {
  put_name(Code::mark, type);
}

JsValue JsWriter::build() {
  while (open_ > 0) end();
  JsValue built(rr_js_build(written.take()));
  written.give_back();
  return built;
}

JsValue make_js_text(std::string_view text) {
  JsWriter js;
  js.text(text);
  return js.build();
}

}  // namespace rr
