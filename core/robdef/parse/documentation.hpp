// Collects `##` lines until a statement takes them. Layer: robdef. Source: service definitions spec section 5.1.
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace rr {

class Documentation {
 public:
  /// Text after a gap replaces what stood before the gap.
  void add(std::string_view line) {
    if (has_gap_) drop();
    if (!is_empty_) text_ += '\n';
    is_empty_ = false;
    text_ += line;
  }
  void handle_blank() { has_gap_ = !is_empty_; }
  void drop() { take(); }
  std::string take() {
    is_empty_ = true;
    has_gap_ = false;
    return std::exchange(text_, {});
  }

 private:
  std::string text_ = {};
  bool is_empty_ = true;
  bool has_gap_ = false;
};

}  // namespace rr
