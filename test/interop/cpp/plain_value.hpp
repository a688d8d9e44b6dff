// Values as the plain JSON of results (README.md, "Values").
#pragma once

#include <nlohmann/json.hpp>

#include "core/types/value.hpp"

nlohmann::json to_plain(const rr::Value& value);

/// {"count", "first", "last", "sum"} of a numeric array.
nlohmann::json to_digest(const rr::Value& value);
