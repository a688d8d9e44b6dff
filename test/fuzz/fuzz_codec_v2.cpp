// Version 2: decode, encode, decode again.
#include "test/fuzz/memory_bound.hpp"
#include "test/fuzz/round_trip.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  rr::fuzz::check_round_trip({data, size}, 2, {});
  return 0;
}
