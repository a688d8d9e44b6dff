// The records of MCAP files, as far as recordings need them. Layer: server/record.
// Source: MCAP file format specification, https://mcap.dev/spec
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "core/support/bytes.hpp"

namespace rrgate {

/// At both ends of a file.
inline constexpr std::string_view mcap_magic = "\x89MCAP0\r\n";

enum class McapOpcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0b,
  metadata = 0x0c,
  metadata_index = 0x0d,
  summary_offset = 0x0e,
  data_end = 0x0f,
};

/// Opcode and length in front of each record's content.
inline constexpr std::size_t mcap_prefix_bytes = 9;
/// What is written, and what is read: longer ones are refused, and nothing is allocated for them.
inline constexpr std::uint64_t max_mcap_message_bytes = 128u << 20;
inline constexpr std::uint64_t max_mcap_record_bytes = 256u << 20;

/// Nanoseconds since 1970-01-01T00:00:00 UTC.
using McapTime = std::uint64_t;
using McapTexts = std::map<std::string, std::string>;

struct McapSchema {
  std::uint16_t id = 0;  ///< never 0
  std::string name;      ///< of the type
  std::string encoding;  ///< "jsonschema"
  std::string data;
};

struct McapChannel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;  ///< 0: none
  std::string topic;
  std::string encoding;  ///< of its messages: "json"
  McapTexts metadata;
};

struct McapMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  McapTime log_time = 0;      ///< when it was recorded
  McapTime publish_time = 0;  ///< when it was sent
  rr::ByteSpan data = {};     ///< borrowed
};

struct McapMetadata {
  std::string name;
  McapTexts texts;
};

}  // namespace rrgate
