// Files of rings of recordings.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "server/record/mcap_writer.hpp"
#include "server/record/recording_writer.hpp"

namespace rrgate::test {

enum class RingFile {
  with_message,
  without_message,
  without_end,  ///< and without a message: of a gateway that was killed
};

/// Returns `path`.
inline std::string write_ring_file(const std::string& path, const std::string& ring,
                                   RingFile kind = RingFile::with_message) {
  auto writer = McapWriter::create(path, "rrgate").value();
  if (!ring.empty()) REQUIRE(writer.add_metadata(recorded_ring_name, {{"of", ring}}).has_value());
  const auto schema = writer.add_schema("schema", "jsonschema", "{}").value();
  const auto channel = writer.add_channel("/Arm/state", "json", schema, {}).value();
  const std::string text = R"({"value": 1})";
  if (kind == RingFile::with_message) REQUIRE(writer.write({channel, 0, 1, 1, rr::as_bytes(text)}).has_value());
  if (kind != RingFile::without_end) REQUIRE(writer.close().has_value());
  return path;
}

}  // namespace rrgate::test
