#include "server/record/mcap_reader.hpp"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "core/support/hex.hpp"
#include "core/wire/byte_reader.hpp"

namespace rrgate {

namespace {

rr::Error malformed(std::string what) {
  return rr::make_error(rr::ErrorCode::data_serialization_error, std::move(what));
}

std::string_view opcode_name(McapOpcode opcode) {
  switch (opcode) {
    case McapOpcode::header:
      return "header";
    case McapOpcode::schema:
      return "schema";
    case McapOpcode::channel:
      return "channel";
    case McapOpcode::message:
      return "message";
    case McapOpcode::chunk:
      return "chunk";
    case McapOpcode::metadata:
      return "metadata";
    default:
      return "record";
  }
}

std::string hex(std::string_view bytes) {
  std::string out;
  for (const char byte : bytes) out += (out.empty() ? "" : " ") + rr::hex_text(static_cast<unsigned char>(byte), 2);
  return out.empty() ? "nothing" : out;
}

bool has_content(McapOpcode opcode) {
  return opcode_name(opcode) != "record";
}

std::string read_text(rr::ByteReader& in, const char* field) {
  return std::string(rr::as_text(in.bytes(in.number<std::uint32_t>(field), field)));
}

McapTexts read_texts(rr::ByteReader& in, const char* field) {
  McapTexts out;
  const auto size = in.number<std::uint32_t>(field);
  if (size > in.left()) {
    in.fail(rr::ErrorCode::data_serialization_error, field, in.at(),
            "has " + std::to_string(size) + " bytes, " + std::to_string(in.left()) + " are left");
    return out;
  }
  const auto end = in.at() + size;
  while (in.ok() && in.at() < end) {
    auto key = read_text(in, field);
    out[std::move(key)] = read_text(in, field);
  }
  return out;
}

template <class T>
rr::Result<T> checked(rr::ByteReader& in, T value) {
  if (!in.ok()) return malformed(in.take_error().message);
  return value;
}

}  // namespace

rr::Result<McapReader> McapReader::open(const std::string& file, const std::string& folder, std::uint64_t max_size) {
  McapReader out(file);
  errno = 0;
  out.file_.open(std::filesystem::path(folder) / file, std::ios::binary | std::ios::ate);
  const auto end = out.file_ ? static_cast<std::int64_t>(out.file_.tellg()) : -1;
  std::string magic(mcap_magic.size(), '\0');
  out.file_.seekg(0);
  out.file_.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (end < 0 || (!out.file_ && !out.file_.eof())) {
    const int why = errno;
    return rr::make_error(why == ENOENT ? rr::ErrorCode::resource_not_found : rr::ErrorCode::system_resource_error,
                          file + ": can't be read: " + std::generic_category().message(why));
  }
  magic.resize(static_cast<std::size_t>(out.file_.gcount()));
  if (!mcap_magic.starts_with(magic))
    return malformed(file + ": is no MCAP file: begins with " + hex(magic) + ", expected " + hex(mcap_magic));
  out.size_ = std::min(static_cast<std::uint64_t>(end), max_size);
  out.at_ = std::min<std::uint64_t>(magic.size(), out.size_);
  return out;
}

rr::Error McapReader::error_in(const McapRecord& record, std::string_view what) const {
  return malformed(name_ + ": " + std::string(opcode_name(record.opcode)) + " at byte " +
                   std::to_string(record.offset) + ": " + std::string(what));
}

std::optional<McapRecord> McapReader::end_at_cut(std::string why) {
  cut_ = std::move(why);
  at_ = size_;
  return std::nullopt;
}

rr::Result<std::optional<McapRecord>> McapReader::next() {
  return read_record();
}

rr::Result<McapRecord> McapReader::read_at(std::uint64_t offset) {
  at_ = offset;
  auto record = read_record();
  if (!record) return record.error();
  if (!*record) return malformed(name_ + ": no record at byte " + std::to_string(offset) + " any more");
  return **record;
}

rr::Result<std::optional<McapRecord>> McapReader::read_record() {
  const auto left = size_ - at_;
  if (left < mcap_prefix_bytes)
    return end_at_cut("ends at byte " + std::to_string(size_) + " without the end of its data");
  std::uint8_t prefix[mcap_prefix_bytes];
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(at_));
  file_.read(reinterpret_cast<char*>(prefix), sizeof(prefix));
  McapRecord record{static_cast<McapOpcode>(prefix[0]), at_};
  const auto length = rr::load<std::uint64_t>(prefix + 1);
  if (!file_) return error_in(record, "can't be read");
  if (record.opcode == McapOpcode::data_end || record.opcode == McapOpcode::footer) {
    at_ = size_;
    return std::optional<McapRecord>();
  }
  record.is_cut = length > left - mcap_prefix_bytes;
  if (record.is_cut)
    cut_ = "ends at byte " + std::to_string(size_) + ", within a " + std::string(opcode_name(record.opcode)) + " of " +
           std::to_string(length) + " bytes that begins at byte " + std::to_string(at_);
  if (record.is_cut && record.opcode != McapOpcode::chunk) return end_at_cut(cut_);
  const auto there = std::min(length, left - mcap_prefix_bytes);
  at_ += mcap_prefix_bytes + there;
  if (!has_content(record.opcode)) return std::optional(record);
  if (there > max_mcap_record_bytes)
    return error_in(record, "has " + std::to_string(length) + " bytes, expected " +
                                std::to_string(max_mcap_record_bytes) + " at most");
  content_.resize(there);
  file_.read(reinterpret_cast<char*>(content_.data()), static_cast<std::streamsize>(there));
  if (!file_) return error_in(record, "can't be read");
  record.content = content_;
  return std::optional(record);
}

rr::Result<McapSchema> parse_mcap_schema(rr::ByteSpan content) {
  rr::ByteReader in(content);
  McapSchema out;
  out.id = in.number<std::uint16_t>("id");
  out.name = read_text(in, "name");
  out.encoding = read_text(in, "encoding");
  out.data = read_text(in, "data");
  return checked(in, std::move(out));
}

rr::Result<McapChannel> parse_mcap_channel(rr::ByteSpan content) {
  rr::ByteReader in(content);
  McapChannel out;
  out.id = in.number<std::uint16_t>("id");
  out.schema = in.number<std::uint16_t>("schema_id");
  out.topic = read_text(in, "topic");
  out.encoding = read_text(in, "message_encoding");
  out.metadata = read_texts(in, "metadata");
  return checked(in, std::move(out));
}

rr::Result<McapMessage> parse_mcap_message(rr::ByteSpan content) {
  rr::ByteReader in(content);
  McapMessage out;
  out.channel = in.number<std::uint16_t>("channel_id");
  out.sequence = in.number<std::uint32_t>("sequence");
  out.log_time = in.number<std::uint64_t>("log_time");
  out.publish_time = in.number<std::uint64_t>("publish_time");
  out.data = in.bytes(in.left(), "data");
  return checked(in, out);
}

rr::Result<McapMetadata> parse_mcap_metadata(rr::ByteSpan content) {
  rr::ByteReader in(content);
  McapMetadata out;
  out.name = read_text(in, "name");
  out.texts = read_texts(in, "metadata");
  return checked(in, std::move(out));
}

rr::Result<McapChunkReader> McapChunkReader::open(const McapRecord& chunk) {
  rr::ByteReader in(chunk.content);
  in.number<std::uint64_t>("message_start_time");
  in.number<std::uint64_t>("message_end_time");
  in.number<std::uint64_t>("uncompressed_size");
  const auto crc = in.number<std::uint32_t>("uncompressed_crc");
  const auto compression = read_text(in, "compression");
  const auto size = in.number<std::uint64_t>("records");
  if (!in.ok()) {
    if (chunk.is_cut) return McapChunkReader({}, true);
    return malformed(in.take_error().message);
  }
  if (!compression.empty())
    return malformed("is compressed by " + rr::quote(compression) +
                     ", expected none; \"mcap compress --compression none\" makes such a file");
  if (!chunk.is_cut && size != in.left())
    return malformed("records: " + std::to_string(size) + " bytes, expected " + std::to_string(in.left()));
  const auto records = in.bytes(in.left(), "records");
  if (chunk.is_cut || crc == 0) return McapChunkReader(records, chunk.is_cut);
  const auto found = static_cast<std::uint32_t>(crc32_z(0, records.data(), records.size()));
  if (found != crc)
    return malformed("was changed: its CRC is " + std::to_string(found) + ", expected " + std::to_string(crc));
  return McapChunkReader(records, false);
}

rr::Result<std::optional<McapRecord>> McapChunkReader::next() {
  const auto left = records_.size() - at_;
  const auto is_whole = left >= mcap_prefix_bytes;
  const auto length = is_whole ? rr::load<std::uint64_t>(records_.data() + at_ + 1) : 0;
  if (left == 0 || (is_cut_ && (!is_whole || length > left - mcap_prefix_bytes))) return std::optional<McapRecord>();
  if (!is_whole || length > left - mcap_prefix_bytes)
    return malformed("record at byte " + std::to_string(at_) + " of it: has " +
                     (is_whole ? std::to_string(length) : "no whole prefix") + ", expected at most " +
                     std::to_string(left) + " bytes");
  McapRecord out{static_cast<McapOpcode>(records_[at_]), at_};
  out.content = records_.subspan(at_ + mcap_prefix_bytes, length);
  at_ += mcap_prefix_bytes + length;
  return std::optional(out);
}

}  // namespace rrgate
