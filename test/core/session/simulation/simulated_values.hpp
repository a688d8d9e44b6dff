// What both sides of the simulation carry, and what is asked of it. Test support.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/error.hpp"
#include "core/types/value.hpp"

namespace rr::test {

inline constexpr std::string_view arm_type = "experimental.simulation.Arm";
inline constexpr std::string_view tool_type = "experimental.simulation.Tool";
inline constexpr std::size_t memory_items = 3000;
inline constexpr int last_of_generator = 6;

/// Item `i` of the memory is `i`.
inline std::vector<double> items(std::uint64_t from, std::uint64_t count) {
  std::vector<double> numbers(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < count; ++i) numbers[i] = static_cast<double>(from + i);
  return numbers;
}

inline std::string text_of(const Result<Value>& result) {
  return result ? "a value" : result.error().message;
}

inline double number_of(const Value& value) {
  return value.to<double>().value();
}

/// Errors that a broken or closing connection explains.
inline bool is_loss(const Error& error) {
  return error.code == ErrorCode::connection_error || error.code == ErrorCode::request_timeout;
}

}  // namespace rr::test
