// Reads MCAP files, those that were cut included. Layer: server/record.
// Source: MCAP file format specification, https://mcap.dev/spec
#pragma once

#include <cstdint>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

#include "core/support/error.hpp"
#include "server/record/mcap.hpp"

namespace rrgate {

struct McapRecord {
  McapOpcode opcode = McapOpcode::header;
  std::uint64_t offset = 0;  ///< in the file; of records in a chunk: in the chunk's records
  rr::ByteSpan content = {};
  bool is_cut = false;  ///< the file ends within it
};

/// Takes nothing on trust: what it allocates is in the file. Errors   data_serialization_error, each with the file, the
/// record and the byte, what was found and what was expected; resource_not_found: there is no such file;
/// system_resource_error.
class McapReader {
 public:
  /// `file`  as errors name it: in `folder`, or a path where that is empty. `max_size`  what lies behind is not read.
  /// One that ends within what all begin with is cut.
  static rr::Result<McapReader> open(const std::string& file, const std::string& folder = {},
                                     std::uint64_t max_size = std::numeric_limits<std::uint64_t>::max());

  /// The next record of the data section; nullopt at its end. Records that hold neither data nor names have no content.
  /// The content is borrowed until the next call.
  rr::Result<std::optional<McapRecord>> next();
  /// The record at a place where next() has found one.
  rr::Result<McapRecord> read_at(std::uint64_t offset);
  /// Why there is no further record, where the file does not end as it should; else empty.
  const std::string& cut() const { return cut_; }
  std::uint64_t size() const { return size_; }
  const std::string& file() const { return name_; }

  /// "run.mcap: chunk at byte 123: ..."
  rr::Error error_in(const McapRecord& record, std::string_view what) const;

 private:
  explicit McapReader(std::string name) : name_(std::move(name)) {}
  rr::Result<std::optional<McapRecord>> read_record();
  std::optional<McapRecord> end_at_cut(std::string why);

  std::string name_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::uint64_t at_ = 0;
  std::string cut_;
  rr::Bytes content_;
};

// Contents of records. Errors   what is wrong, for error_in().

rr::Result<McapSchema> parse_mcap_schema(rr::ByteSpan content);
rr::Result<McapChannel> parse_mcap_channel(rr::ByteSpan content);
/// `data` is borrowed from `content`.
rr::Result<McapMessage> parse_mcap_message(rr::ByteSpan content);
rr::Result<McapMetadata> parse_mcap_metadata(rr::ByteSpan content);

/// The records within a chunk, one after the other.
class McapChunkReader {
 public:
  /// Errors also   a chunk that is compressed, or that was changed after it was written.
  static rr::Result<McapChunkReader> open(const McapRecord& chunk);
  /// nullopt at the end, or where the file was cut.
  rr::Result<std::optional<McapRecord>> next();

 private:
  McapChunkReader(rr::ByteSpan records, bool is_cut) : records_(records), is_cut_(is_cut) {}

  rr::ByteSpan records_;
  std::size_t at_ = 0;
  bool is_cut_;
};

}  // namespace rrgate
