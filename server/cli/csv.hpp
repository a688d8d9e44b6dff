// Cells of comma-separated values. Layer: server/cli. Source: RFC 4180.
#pragma once

#include <string>

#include "server/json/json.hpp"

namespace rrgate {

/// A number, a word or quoted text; nothing for null.
std::string csv_cell(const rr::Json& value);

}  // namespace rrgate
