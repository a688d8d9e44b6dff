// The JSON trees of the golden messages as Message: built from them, and compared with them.
#pragma once

#include <deque>
#include <nlohmann/json.hpp>
#include <string>

#include "core/wire/message.hpp"

namespace rr::test {

/// Builds the message that a tree describes. Texts and data live in the message.
void build_message(const nlohmann::json& tree, Message& message);

/// Empty when the message is what the tree says, else the first difference ("entries[0].elements[1].count: ...").
std::string compare_message(const Message& message, const nlohmann::json& tree);

/// Empty when both hold the same (texts and data by content), else the first difference.
std::string compare_messages(const Message& a, const Message& b);

/// Little-endian items for a value of the tree: number, bool, "NaN", [re, im], decimal string of 64-bit integers.
Bytes value_bytes(const nlohmann::json& element);

}  // namespace rr::test
