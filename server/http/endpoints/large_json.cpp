#include "server/http/endpoints/large_json.hpp"

namespace rrgate {

std::size_t held_bytes(const rr::OrderedJson& json) {
  std::size_t bytes = sizeof(json);
  if (const auto* text = json.get_ptr<const std::string*>()) return bytes + text->size();
  if (json.is_binary()) return bytes + json.get_binary().size();
  if (const auto* object = json.get_ptr<const rr::OrderedJson::object_t*>())
    for (const auto& [key, value] : *object) bytes += sizeof(key) + key.size() + held_bytes(value);
  if (const auto* array = json.get_ptr<const rr::OrderedJson::array_t*>())
    for (const auto& item : *array) bytes += held_bytes(item);
  return bytes;
}

}  // namespace rrgate
