// Values as scenarios send them: JSON that carries its type (README.md, "Values").
#pragma once

#include <nlohmann/json.hpp>

#include "core/types/value.hpp"

/// Throws   std::invalid_argument, nlohmann::json::exception: not of the documented form.
rr::Value from_scenario(const nlohmann::json& tagged);
