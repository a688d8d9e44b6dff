// What the numbers in many values come to. Layer: server/mcp.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/json/json.hpp"

namespace rrgate {

class McpSummary {
 public:
  /// Takes the first hundred places that have numbers; arrays as far as their 16th item.
  void add(const rr::OrderedJson& value);
  /// {"position.x": {"min": ..., "max": ..., "mean": ...}}; the value itself, where it is a number, is at "".
  rr::OrderedJson to_json() const;

 private:
  struct Numbers {
    double min = 0;
    double max = 0;
    double sum = 0;
    std::uint64_t count = 0;
  };
  void add(const rr::OrderedJson& value, const std::string& place);

  std::map<std::string, Numbers> places_;
};

}  // namespace rrgate
