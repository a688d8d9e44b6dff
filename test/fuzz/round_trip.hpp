// What both codec fuzzers check. Layer: tests.
#pragma once

#include <cstdint>

#include "core/wire/codec.hpp"

namespace rr::fuzz {

/// Decodes bytes as a message of `version` (the first ten bytes are mended, so that the fuzzer gets past them); when
/// that succeeds, encoding and decoding again must give the same message. Aborts when a rule is broken.
void check_round_trip(ByteSpan input, std::uint16_t version, StringTableMode string_table);

}  // namespace rr::fuzz
