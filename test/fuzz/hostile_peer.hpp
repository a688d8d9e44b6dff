// What hostile peers of sessions have in common: an input is a row of choices, of which messages are made.
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "core/wire/codec.hpp"

namespace rr::test {

inline void require(bool holds, const char* rule) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", rule);
  std::abort();
}

/// The input as a row of choices; zeros behind its end.
class Choices {
 public:
  Choices(const std::uint8_t* data, std::size_t size) : left_(data, size) {}
  bool empty() const { return left_.empty(); }
  std::uint8_t byte() {
    if (left_.empty()) return 0;
    const auto first = left_.front();
    left_ = left_.subspan(1);
    return first;
  }
  ByteSpan bytes(std::size_t most) {
    const auto taken = left_.first(std::min(most, left_.size()));
    left_ = left_.subspan(taken.size());
    return taken;
  }
  std::string_view text(std::size_t most) { return as_text(bytes(most)); }
  /// One of `words`, or what the input says instead.
  template <std::size_t size>
  std::string_view word(const std::string_view (&words)[size]) {
    const auto chosen = byte();
    return chosen < 0xf0 ? words[chosen % size] : text(chosen & 0x0f);
  }

 private:
  ByteSpan left_;
};

inline constexpr std::string_view paths[] = {"arm",          "arm.tool",     "arm.tools[a]",
                                             "arm.slots[1]", "arm.anything", "arm.tools[none]"};
inline constexpr std::string_view members[] = {"speed",
                                               "pose",
                                               "add",
                                               "stop",
                                               "count",
                                               "scale",
                                               "sink",
                                               "bumped",
                                               "torque",
                                               "state",
                                               "samples",
                                               "data",
                                               "grid",
                                               "log",
                                               "poses",
                                               "orders",
                                               "quick",
                                               "ask",
                                               "notice",
                                               "name",
                                               "notes",
                                               "archive",
                                               "status",
                                               "MonitorEnter",
                                               "MonitorContinueEnter",
                                               "MonitorExit",
                                               "RequestObjectLock",
                                               "RequestClientObjectLock",
                                               "ReleaseObjectLock",
                                               "AuthenticateUser",
                                               "LogoutUser",
                                               "Length",
                                               "Dimensions",
                                               "DimCount",
                                               "MaxTransferSize"};
inline constexpr std::string_view elements[] = {
    "value",      "left",   "a",         "b",       "index",        "packettime",    "packet",   "memorypos",
    "count",      "data",   "parameter", "timeout", "servicename",  "clientversion", "username", "credentials",
    "unreliable", "return", "1",         "2",       "packetnumber", "requestack"};

inline void add_elements(Message& message, Choices& choices, std::size_t count, std::size_t depth = 0) {
  for (; count > 0; --count) {
    const auto name = choices.word(elements);
    switch (choices.byte() % 8) {
      case 0:
        message.add_scalar(name, DataType::double_t, 1.5);
        break;
      case 1:
        message.add_scalar(name, DataType::int32_t, static_cast<std::int32_t>(choices.byte()) - 2);
        break;
      case 2:
        message.add_scalar(name, DataType::uint32_t, static_cast<std::uint32_t>(choices.byte()));
        break;
      case 3:
        message.add_scalar(name, DataType::uint64_t, static_cast<std::uint64_t>(choices.byte()));
        break;
      case 4:
        message.add_text(name, choices.text(choices.byte() % 16));
        break;
      default:
        if (depth > 3) break;
        message.begin_nested(name, static_cast<DataType>(101 + choices.byte() % 12),
                             choices.byte() % 2 ? "experimental.loopback.Pose" : "");
        add_elements(message, choices, choices.byte() % 4, depth + 1);
        message.end_nested();
    }
  }
}

/// The message as its bytes, of which the input may bend some. Empty: it can't be encoded.
inline Bytes bent_bytes(const Message& message, Choices& choices) {
  EncodedMessage encoded;
  Bytes bytes;
  if (!encode(message, {}, encoded)) return bytes;
  for (const auto slice : encoded.slices()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  for (auto bends = choices.byte(); bends >= 0xf0; bends = choices.byte())
    bytes[(choices.byte() * 256u + choices.byte()) % bytes.size()] = choices.byte();
  return bytes;
}

}  // namespace rr::test
