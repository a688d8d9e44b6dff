// A message as one line of text, for what tests print and compare.
#pragma once

#include <cstddef>
#include <string>

#include "core/wire/message.hpp"

namespace rr::test {

struct FormatOptions {
  std::size_t max_items = 16;   ///< items of an array, or direct children of a nested element, that are shown
  std::size_t max_text = 96;    ///< bytes of a text that are shown
  std::size_t max_size = 4096;  ///< bytes of the line after which nothing more is added but "..."
};

/// "v4 | ep 1>2000 | PropertyGetRes path=svc member=d1 req=5 {value:double=[3.5]}". Entries are separated by " | ".
/// What is cut shows as "..."; control characters and quotes of texts are escaped, other bytes pass through. Values of
/// elements named `credentials` or `password`, and all inside them, show as "***".
std::string format_message(const Message& message, const FormatOptions& options = {});

/// One element with its descendants: "packettime:structure<RobotRaconteur.TimeSpec>{seconds:int64=[1], ...}".
std::string format_element(const Message& message, const MessageElement& element, const FormatOptions& options = {});

}  // namespace rr::test
