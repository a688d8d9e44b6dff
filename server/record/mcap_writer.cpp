#include "server/record/mcap_writer.hpp"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <system_error>

namespace rrgate {

namespace {

constexpr std::size_t full_chunk_bytes = 1u << 20;

template <class T>
void put_number(rr::Bytes& out, T number) {
  const auto at = out.size();
  out.resize(at + sizeof(T));
  std::memcpy(out.data() + at, &number, sizeof(T));
}

void put_bytes(rr::Bytes& out, rr::ByteSpan bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void put_text(rr::Bytes& out, std::string_view text) {
  put_number(out, static_cast<std::uint32_t>(text.size()));
  put_bytes(out, rr::as_bytes(text));
}

/// What has its length in bytes in front.
template <class Put>
void put_sized(rr::Bytes& out, Put&& put) {
  const auto at = out.size();
  put_number(out, std::uint32_t{0});
  put();
  const auto size = static_cast<std::uint32_t>(out.size() - at - sizeof(std::uint32_t));
  std::memcpy(out.data() + at, &size, sizeof(size));
}

void put_texts(rr::Bytes& out, const McapTexts& texts) {
  put_sized(out, [&] {
    for (const auto& [key, text] : texts) {
      put_text(out, key);
      put_text(out, text);
    }
  });
}

void put_prefix(rr::Bytes& out, McapOpcode opcode, std::uint64_t content) {
  out.push_back(static_cast<std::uint8_t>(opcode));
  put_number(out, content);
}

std::uint32_t add_to_crc(std::uint32_t crc, rr::ByteSpan bytes) {
  return static_cast<std::uint32_t>(crc32_z(crc, bytes.data(), bytes.size()));
}

rr::Error too_many(std::string_view what, const std::string& path) {
  return rr::make_error(rr::ErrorCode::out_of_system_resource,
                        path + ": more than 65535 " + std::string(what) + " in one file");
}

}  // namespace

rr::Result<McapWriter> McapWriter::create(const std::string& path, std::string_view library) {
  McapWriter out(path);
  out.file_.open(path, std::ios::binary | std::ios::trunc);
  if (!out.file_)
    return rr::make_error(rr::ErrorCode::system_resource_error,
                          path + ": can't be written: " + std::generic_category().message(errno));
  const auto magic = rr::as_bytes(mcap_magic);
  rr::Bytes header;
  put_text(header, "");
  put_text(header, library);
  if (auto put = out.put(rr::Bytes(magic.begin(), magic.end())); !put) return put.error();
  if (auto put = out.put_record(McapOpcode::header, header); !put) return put.error();
  return out;
}

rr::Result<> McapWriter::put(const rr::Bytes& bytes) {
  if (!state_) return state_;
  errno = 0;
  file_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (file_.flush()) {
    offset_ += bytes.size();
    return {};
  }
  const auto why = errno != 0 ? std::generic_category().message(errno) : "the system does not say why";
  state_ = rr::make_error(rr::ErrorCode::system_resource_error,
                          path_ + ": writing at byte " + std::to_string(offset_) + " failed: " + why);
  return state_;
}

rr::Result<> McapWriter::put_record(McapOpcode opcode, const rr::Bytes& content) {
  rr::Bytes record;
  record.reserve(mcap_prefix_bytes + content.size());
  put_prefix(record, opcode, content.size());
  put_bytes(record, content);
  return put(record);
}

rr::Result<std::uint16_t> McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                                 std::string_view data) {
  if (schemas_.size() >= std::numeric_limits<std::uint16_t>::max()) return too_many("schemas", path_);
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  auto& content = schemas_.emplace_back();
  put_number(content, id);
  put_text(content, name);
  put_text(content, encoding);
  put_text(content, data);
  if (auto done = put_record(McapOpcode::schema, content); !done) return done.error();
  return id;
}

rr::Result<std::uint16_t> McapWriter::add_channel(std::string_view topic, std::string_view encoding,
                                                  std::uint16_t schema, const McapTexts& metadata) {
  if (channels_.size() >= std::numeric_limits<std::uint16_t>::max()) return too_many("channels", path_);
  const auto id = static_cast<std::uint16_t>(channels_.size());
  auto& content = channels_.emplace_back();
  message_counts_.push_back(0);
  put_number(content, id);
  put_number(content, schema);
  put_text(content, topic);
  put_text(content, encoding);
  put_texts(content, metadata);
  if (auto done = put_record(McapOpcode::channel, content); !done) return done.error();
  return id;
}

rr::Result<> McapWriter::add_metadata(std::string_view name, const McapTexts& texts) {
  rr::Bytes content;
  put_text(content, name);
  put_texts(content, texts);
  auto& index = metadata_indexes_.emplace_back();
  put_number(index, offset_);
  put_number(index, static_cast<std::uint64_t>(mcap_prefix_bytes + content.size()));
  put_text(index, name);
  return put_record(McapOpcode::metadata, content);
}

rr::Result<> McapWriter::write(const McapMessage& message) {
  if (!state_) return state_;
  if (message.data.size() > max_mcap_message_bytes)
    return rr::make_error(rr::ErrorCode::out_of_range, path_ + ": a message of " + std::to_string(message.data.size()) +
                                                           " bytes; at most " + std::to_string(max_mcap_message_bytes) +
                                                           " are recorded");
  const bool is_first_of_chunk = chunk_.empty();
  chunk_index_[message.channel].emplace_back(message.log_time, chunk_.size());
  put_prefix(chunk_, McapOpcode::message, 22 + message.data.size());
  put_number(chunk_, message.channel);
  put_number(chunk_, message.sequence);
  put_number(chunk_, message.log_time);
  put_number(chunk_, message.publish_time);
  put_bytes(chunk_, message.data);
  chunk_first_ = is_first_of_chunk ? message.log_time : std::min(chunk_first_, message.log_time);
  chunk_last_ = is_first_of_chunk ? message.log_time : std::max(chunk_last_, message.log_time);
  first_ = message_count_ == 0 ? message.log_time : std::min(first_, message.log_time);
  last_ = std::max(last_, message.log_time);
  ++message_count_;
  ++message_counts_.at(message.channel);
  return chunk_.size() < full_chunk_bytes ? rr::Result<>() : flush();
}

rr::Result<> McapWriter::flush() {
  if (chunk_.empty()) return state_;
  const auto begin = offset_;
  const std::uint64_t records_size = chunk_.size();
  rr::Bytes out;
  out.reserve(chunk_.size() + 64);
  put_prefix(out, McapOpcode::chunk, 8 + 8 + 8 + 4 + 4 + 8 + chunk_.size());
  put_number(out, chunk_first_);
  put_number(out, chunk_last_);
  put_number(out, records_size);
  put_number(out, add_to_crc(0, chunk_));
  put_text(out, "");  // not compressed
  put_number(out, records_size);
  put_bytes(out, chunk_);
  const std::uint64_t length = out.size();
  rr::Bytes index;
  put_number(index, chunk_first_);
  put_number(index, chunk_last_);
  put_number(index, begin);
  put_number(index, length);
  put_sized(index, [&] {
    for (const auto& [channel, places] : chunk_index_) {
      put_number(index, channel);
      put_number(index, static_cast<std::uint64_t>(begin + out.size()));
      put_prefix(out, McapOpcode::message_index, 2 + 4 + 16 * places.size());
      put_number(out, channel);
      put_sized(out, [&out, items = &places] {
        for (const auto& [time, offset] : *items) {
          put_number(out, time);
          put_number(out, offset);
        }
      });
    }
  });
  put_number(index, static_cast<std::uint64_t>(out.size() - length));
  put_text(index, "");
  put_number(index, records_size);
  put_number(index, records_size);
  put_prefix(chunk_indexes_, McapOpcode::chunk_index, index.size());
  put_bytes(chunk_indexes_, index);
  ++chunk_count_;
  rr::clear_kept(chunk_);
  chunk_index_.clear();
  return put(out);
}

/// The summary section and the summary offset section. `begin`  where it stands in the file.
rr::Bytes McapWriter::summary(std::uint64_t begin, std::uint64_t& offsets_begin) const {
  rr::Bytes out;
  rr::Bytes offsets;
  const auto end_group = [&](McapOpcode opcode, std::uint64_t start) {
    if (begin + out.size() == start) return;
    put_prefix(offsets, McapOpcode::summary_offset, 1 + 8 + 8);
    offsets.push_back(static_cast<std::uint8_t>(opcode));
    put_number(offsets, start);
    put_number(offsets, begin + out.size() - start);
  };
  const auto add_group = [&](McapOpcode opcode, const std::vector<rr::Bytes>& contents) {
    const auto start = begin + out.size();
    for (const auto& content : contents) {
      put_prefix(out, opcode, content.size());
      put_bytes(out, content);
    }
    end_group(opcode, start);
  };
  rr::Bytes statistics;
  put_number(statistics, message_count_);
  put_number(statistics, static_cast<std::uint16_t>(schemas_.size()));
  put_number(statistics, static_cast<std::uint32_t>(channels_.size()));
  put_number(statistics, std::uint32_t{0});  // attachments
  put_number(statistics, static_cast<std::uint32_t>(metadata_indexes_.size()));
  put_number(statistics, chunk_count_);
  put_number(statistics, first_);
  put_number(statistics, last_);
  put_sized(statistics, [&] {
    for (std::size_t i = 0; i < message_counts_.size(); ++i) {
      put_number(statistics, static_cast<std::uint16_t>(i));
      put_number(statistics, message_counts_[i]);
    }
  });
  add_group(McapOpcode::schema, schemas_);
  add_group(McapOpcode::channel, channels_);
  const auto chunks_begin = begin + out.size();
  put_bytes(out, chunk_indexes_);
  end_group(McapOpcode::chunk_index, chunks_begin);
  add_group(McapOpcode::metadata_index, metadata_indexes_);
  add_group(McapOpcode::statistics, {statistics});
  offsets_begin = begin + out.size();
  put_bytes(out, offsets);
  return out;
}

rr::Result<> McapWriter::close() {
  if (auto flushed = flush(); !flushed) return flushed;
  rr::Bytes data_end;
  put_number(data_end, std::uint32_t{0});  // no checksum of the whole: the chunks have theirs
  if (auto put = put_record(McapOpcode::data_end, data_end); !put) return put;
  const auto begin = offset_;
  std::uint64_t offsets_begin = 0;
  auto out = summary(begin, offsets_begin);
  put_prefix(out, McapOpcode::footer, 8 + 8 + 4);
  put_number(out, begin);
  put_number(out, offsets_begin);
  put_number(out, add_to_crc(0, out));
  put_bytes(out, rr::as_bytes(mcap_magic));
  auto done = put(out);
  file_.close();
  return done;
}

}  // namespace rrgate
