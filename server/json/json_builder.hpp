// A document put together from what a reader of JSON or CBOR meets. Layer: json.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/json/json.hpp"

namespace rr {

/// Puts a document together from what a parser meets; refuses keys that are there already.
class JsonBuilder {  // NOLINT(bugprone-exception-escape): of nlohmann, whose destructor allocates
 public:
  static constexpr std::size_t max_depth = 64;

  bool begin(Json container) {
    if (open_.size() >= max_depth) return fail("is nested deeper than " + std::to_string(max_depth) + " levels");
    auto* added = add(std::move(container));
    if (added) open_.push_back(added);
    return added;
  }
  bool end() {
    open_.pop_back();
    return true;
  }
  bool set_key(std::string key) {
    if (open_.back()->contains(key)) return fail("has the key " + rr::quote(key) + " twice");
    key_ = std::move(key);
    return true;
  }
  bool add_value(Json value) { return add(std::move(value)); }
  bool add_number(double number) { return std::isfinite(number) ? add_value(number) : fail("has a number too large"); }
  bool fail(std::string why) {
    why_ = std::move(why);
    return false;
  }

  const std::string& why() const { return why_; }
  Json take() { return std::move(root_); }

 private:
  Json* add(Json value) {
    if (open_.empty()) return &(root_ = std::move(value));
    auto& parent = *open_.back();
    if (!parent.is_array()) return &(parent[key_] = std::move(value));
    parent.push_back(std::move(value));
    return &parent.back();
  }

  Json root_;
  std::vector<Json*> open_;  ///< a container stays where it is while it is open: nothing is added beside it
  std::string key_;
  std::string why_;
};

/// Bytes of the heap that parts of a document take at most, on 64-bit machines.
namespace heap {
inline constexpr std::size_t item = 3 * sizeof(Json);  ///< an array has room for twice as many when it has just grown
inline constexpr std::size_t array = sizeof(Json::array_t) + 32;  ///< and its first item's place
inline constexpr std::size_t object = sizeof(Json::object_t) + 8;
inline constexpr std::size_t pair = 40 + sizeof(std::pair<std::string, Json>);  ///< a node of the map
inline constexpr std::size_t text = sizeof(std::string) + 8;                    ///< of any length, beside its bytes
inline constexpr std::size_t byte = 3;                                          ///< of a text that comes in pieces
inline constexpr std::size_t document = 512;                                    ///< its root, the levels that are open
}  // namespace heap

inline Error unreadable_document(std::string_view kind, std::string why) {
  return make_error(ErrorCode::data_serialization_error, std::string(kind) + " " + std::move(why));
}

}  // namespace rr
