// What is wrong with a configuration, and what its options are. Layer: server/config.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace rrgate {

/// One mistake. `path` is a JSON pointer ("/devices/2/url"), empty for the file as a whole.
struct Finding {
  std::string path;
  std::string text;  ///< what was found and what was expected

  bool operator==(const Finding&) const = default;
};

/// "gateway.json: /devices/2/url: scheme ..."
std::string format_finding(const std::string& file, const Finding& finding);

/// One option as the parser knows it. Items of an array have the path "<array>/*".
struct OptionInfo {
  std::string path;
  std::string type;  ///< "object", "array", "string", "integer"
  bool is_required = false;
  std::optional<std::int64_t> minimum = {};
  std::optional<std::int64_t> maximum = {};
  std::vector<std::string> choices = {};
  std::string default_value = {};  ///< as JSON; empty where there is none

  bool operator==(const OptionInfo&) const = default;
};

}  // namespace rrgate
