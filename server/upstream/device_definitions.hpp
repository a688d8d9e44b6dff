// What the devices of a gateway define, read once for all that define the same. Layer: server/upstream.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/read_definitions.hpp"

namespace rrgate {

/// Where many devices are equal, they share what was read of one: a gateway looks at each of thousands again and again,
/// and has a registry for each that it shares.
class DeviceDefinitions final : public rr::ReadDefinitions {
 public:
  /// Of the texts of all that is kept. What was read takes up to forty times as much where nothing else has it; when
  /// there is more, all is forgotten, and what devices have stays theirs.
  static constexpr std::size_t max_bytes = 1024 * 1024;

  bool find(const std::vector<std::string>& texts, rr::TypeRegistry& types) override;
  void keep(const rr::TypeRegistry& types) override;

 private:
  /// By their texts, sorted, which stand in the definitions.
  std::map<std::vector<std::string_view>, rr::TypeRegistry> kept_;
  std::size_t bytes_ = 0;
};

}  // namespace rrgate
