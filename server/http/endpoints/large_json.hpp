// JSON that would keep the gateway's thread busy. Layer: server/http/endpoints.
#pragma once

#include <cstddef>

#include "server/json/json.hpp"

namespace rrgate {

/// Above it, documents are read and written by the Workers: the gateway's thread has about a millisecond for one.
inline constexpr std::size_t large_json_bytes = 64 * 1024;

/// Bytes that a document takes, about.
std::size_t held_bytes(const rr::OrderedJson& json);

}  // namespace rrgate
