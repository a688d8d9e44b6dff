#include "core/types/value_size.hpp"

namespace rr {

namespace {

/// Beside the Value itself.
struct Held {
  std::size_t operator()(std::monostate) const { return 0; }
  std::size_t operator()(const Scalar&) const { return 0; }
  std::size_t operator()(const std::string& text) const { return text.size(); }
  std::size_t operator()(const Array& array) const { return array.bytes().size(); }
  std::size_t operator()(const MultiDimArray& array) const { return array.array.bytes().size(); }
  std::size_t operator()(const NamedArray& array) const { return array.array.bytes().size(); }
  std::size_t operator()(const Structure& structure) const {
    std::size_t bytes = sizeof(structure) + structure.type_name.size();
    for (const auto& field : structure.fields) bytes += named(field.name.size(), field.value);
    return bytes;
  }
  std::size_t operator()(const PodArray& pods) const {
    std::size_t bytes = 0;
    for (const auto& pod : pods.items) bytes += (*this)(pod);
    return bytes;
  }
  std::size_t operator()(const List& list) const {
    std::size_t bytes = 0;
    for (const auto& item : list.items) bytes += held_bytes(item);
    return bytes;
  }
  std::size_t operator()(const MapInt32& map) const {
    std::size_t bytes = 0;
    for (const auto& [key, item] : map.items) bytes += named(sizeof(key), item);
    return bytes;
  }
  std::size_t operator()(const MapString& map) const {
    std::size_t bytes = 0;
    for (const auto& [key, item] : map.items) bytes += named(key.size(), item);
    return bytes;
  }

 private:
  static std::size_t named(std::size_t name, const Value& value) {
    return sizeof(std::string) + name + held_bytes(value);
  }
};

}  // namespace

std::size_t held_bytes(const Value& value) {
  return sizeof(Value) + std::visit(Held(), value.storage());
}

}  // namespace rr
