// One more for as long as this lives. Layer: node/transport.
#pragma once

#include <cstddef>

namespace rr {

class CountGuard {
 public:
  explicit CountGuard(std::size_t& count) : count_(count) { ++count_; }
  CountGuard(const CountGuard&) = delete;
  CountGuard& operator=(const CountGuard&) = delete;
  ~CountGuard() { --count_; }

 private:
  std::size_t& count_;
};

}  // namespace rr
