#include "server/upstream/device_definitions.hpp"

#include <algorithm>

namespace rrgate {

bool DeviceDefinitions::find(const std::vector<std::string>& texts, rr::TypeRegistry& types) {
  std::vector<std::string_view> sorted(texts.begin(), texts.end());
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  const auto kept = kept_.find(sorted);
  if (kept == kept_.end()) return false;
  types.share(kept->second);
  return true;
}

void DeviceDefinitions::keep(const rr::TypeRegistry& types) {
  std::vector<std::string_view> sorted;
  std::size_t bytes = 0;
  for (const auto& definition : types.definitions()) {
    sorted.emplace_back(definition->text);
    bytes += definition->text.size();
  }
  std::sort(sorted.begin(), sorted.end());
  if (kept_.contains(sorted) || bytes > max_bytes) return;
  if (bytes_ + bytes > max_bytes) {
    kept_.clear();
    bytes_ = 0;
  }
  kept_.emplace(std::move(sorted), types);
  bytes_ += bytes;
}

}  // namespace rrgate
