// How libFuzzer changes inputs that are messages: as trees mostly, and as bytes like all other inputs.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "test/fuzz/message_changes.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  if (seed % 3 != 0 && size > 0 && data[0] == 'R')
    if (const auto changed = rr::fuzz::mutate_message(data, size, max_size, seed)) return changed;
  return LLVMFuzzerMutate(data, size, max_size);
}
