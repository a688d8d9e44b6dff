// Writes an MCAP file. Layer: server/record. Source: MCAP file format specification, https://mcap.dev/spec
#pragma once

#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/support/error.hpp"
#include "server/record/mcap.hpp"

namespace rrgate {

/// Messages go to the file in chunks, which are not compressed: a file that was cut is readable up to where it ends.
/// After an error each further call returns that error.
/// Errors of all   system_resource_error: the file, what was done with it, and what the system says.
class McapWriter {
 public:
  /// `library`  what the file says it was written by. An existing file is replaced.
  static rr::Result<McapWriter> create(const std::string& path, std::string_view library);

  /// Returns its id. At most 65,535, as of channels; then out_of_system_resource.
  rr::Result<std::uint16_t> add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  rr::Result<std::uint16_t> add_channel(std::string_view topic, std::string_view encoding, std::uint16_t schema,
                                        const McapTexts& metadata);
  rr::Result<> add_metadata(std::string_view name, const McapTexts& texts);
  /// `message.channel`  one that was added. Errors also   out_of_range: more than max_mcap_message_bytes; the writer
  /// goes on.
  rr::Result<> write(const McapMessage& message);
  /// Writes out what waits for its chunk to be full.
  rr::Result<> flush();
  /// Ends the file with its summary. Once; without it the file is one that was cut.
  rr::Result<> close();

  /// Of the file with what waits to be written.
  std::uint64_t size() const { return offset_ + chunk_.size(); }
  std::uint64_t message_count() const { return message_count_; }
  /// That the index of what was written takes, in memory until close(), then in the file.
  std::size_t index_bytes() const { return chunk_indexes_.size(); }
  const std::string& path() const { return path_; }

 private:
  using Index = std::vector<std::pair<McapTime, std::uint64_t>>;  ///< time, offset in the chunk

  explicit McapWriter(std::string path) : path_(std::move(path)) {}
  rr::Result<> put(const rr::Bytes& bytes);
  rr::Result<> put_record(McapOpcode opcode, const rr::Bytes& content);
  rr::Bytes summary(std::uint64_t begin, std::uint64_t& offsets_begin) const;

  std::string path_;
  std::ofstream file_;
  std::uint64_t offset_ = 0;
  rr::Result<> state_ = {};
  std::vector<rr::Bytes> schemas_;             ///< contents of their records
  std::vector<rr::Bytes> channels_;            ///< the same
  std::vector<std::uint64_t> message_counts_;  ///< of each channel
  std::vector<rr::Bytes> metadata_indexes_;
  rr::Bytes chunk_indexes_;  ///< records, as the summary has them
  std::uint32_t chunk_count_ = 0;
  std::uint64_t message_count_ = 0;
  McapTime first_ = 0;
  McapTime last_ = 0;

  rr::Bytes chunk_;  ///< records that wait
  McapTime chunk_first_ = 0;
  McapTime chunk_last_ = 0;
  std::map<std::uint16_t, Index> chunk_index_;
};

}  // namespace rrgate
