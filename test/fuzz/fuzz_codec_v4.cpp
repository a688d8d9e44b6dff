// Version 4: decode, encode, decode again, with every string table that can be agreed on.
#include "test/fuzz/memory_bound.hpp"
#include "test/fuzz/round_trip.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  for (const bool local : {false, true})
    for (const bool standard : {false, true})
      rr::fuzz::check_round_trip({data, size}, 4, {.local = local, .standard = standard});
  return 0;
}
