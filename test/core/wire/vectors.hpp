// The golden messages and malformed messages, ready for use.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/wire/codec.hpp"
#include "test/support/golden.hpp"

namespace rr::test {

/// One case of messages/messages.json, recorded from Robot Raconteur 1.2.8.
struct MessageVector {
  std::string name;
  StringTableMode string_table;
  nlohmann::json tree;
  Bytes bytes;
};

/// One case of messages/malformed.json.
struct MalformedVector {
  std::string name;
  StringTableMode string_table;
  bool accepted;
  ErrorCode error;  ///< none when accepted
  Bytes bytes;
};

const std::vector<MessageVector>& message_vectors();
const MessageVector& message_vector(const std::string& name);
const std::vector<MalformedVector>& malformed_vectors();

}  // namespace rr::test
