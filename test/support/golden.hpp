// Golden data of the tests: files below test/golden, and bytes written as hex.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/support/bytes.hpp"

namespace rr::test {

/// Path of a file below test/golden, e.g. "messages/messages.json".
std::string golden_path(const std::string& name);

/// Whole file. Throws std::runtime_error naming the path when it cannot be read.
std::string read_golden(const std::string& name);
nlohmann::json read_golden_json(const std::string& name);

/// Hex digits of either case; blanks and line breaks are skipped. Throws std::invalid_argument for anything else.
Bytes from_hex(std::string_view hex);
std::string to_hex(ByteSpan bytes);

}  // namespace rr::test
