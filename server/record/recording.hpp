// A recording that is read: what it holds, and its messages. Layer: server/record.
#pragma once

#include <functional>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "core/robdef/model/service_definition.hpp"
#include "server/record/mcap_reader.hpp"
#include "server/record/recording_writer.hpp"

namespace rrgate {

struct RecordedMember {
  std::uint16_t channel = 0;
  std::string topic;
  std::string service;  ///< the label
  std::string object;   ///< service path
  std::string member;
  rr::MemberKind kind = rr::MemberKind::wire;
  std::string type;  ///< empty for events
  std::uint64_t message_count = 0;
};

/// Messages that are read together.
struct RecordedChunk {
  std::uint64_t offset = 0;
  McapTime first = 0;
  McapTime last = 0;
  std::uint64_t message_count = 0;
  std::map<std::uint16_t, std::uint64_t> message_counts;  ///< by channel
  std::size_t bytes = 0;
};

class Recording {
 public:
  /// Reads all of the file once. `file`, `folder`  see McapReader. `unwanted`  asked at each record.
  /// Errors   those of McapReader; data_serialization_error: it is no recording of rrgate; operation_cancelled.
  static rr::Result<Recording> open(const std::string& file, const std::stop_token& unwanted = {},
                                    const std::string& folder = {});

  const std::vector<RecordedService>& services() const { return services_; }
  const std::map<std::uint16_t, RecordedMember>& members() const { return members_; }
  const std::vector<RecordedChunk>& chunks() const { return chunks_; }
  std::uint64_t message_count() const { return message_count_; }
  McapTime begin() const { return begin_; }
  McapTime end() const { return end_; }
  /// See McapReader.
  const std::string& cut() const { return reader_.cut(); }
  /// The file, as open() was told it.
  const std::string& name() const { return reader_.file(); }
  std::uint64_t size() const { return reader_.size(); }
  /// Bytes that are held for it, about, also while a chunk is read.
  std::size_t memory() const;

  struct Messages {
    rr::Bytes bytes;  ///< what the messages borrow
    std::vector<McapMessage> messages;
  };
  /// In the order of the file. Errors   as open(), where the file has changed since.
  rr::Result<Messages> read(const RecordedChunk& chunk);
  /// Calls `take` with each message of a member, in the order of the file; borrowed for the call. Errors   as read();
  /// the first that `take` returns, which ends it.
  rr::Result<> for_each(const RecordedMember& member, const std::function<rr::Result<>(const McapMessage&)>& take);
  /// The document of a message. Errors   data_serialization_error: what it is, and why.
  rr::Result<rr::Json> read_document(const McapMessage& message) const;

 private:
  explicit Recording(McapReader reader) : reader_(std::move(reader)) {}
  rr::Result<> take(const McapRecord& record);
  rr::Result<> take_channel(const McapRecord& record);
  rr::Result<> take_service(const McapRecord& record);
  rr::Result<> take_chunk(const McapRecord& record);

  McapReader reader_;
  std::vector<RecordedService> services_;
  std::map<std::uint16_t, RecordedMember> members_;
  std::vector<RecordedChunk> chunks_;
  std::uint64_t message_count_ = 0;
  McapTime begin_ = 0;
  McapTime end_ = 0;
};

/// The ring that a file says it belongs to; empty: to none, or it can't be read. Reads its beginning alone.
std::string recorded_ring(const std::string& path);
/// True also where that can't be told.
bool has_recorded_messages(const std::string& path);

/// "2026-11-24T15:00:00.000000000Z"
std::string mcap_time_text(McapTime time);

}  // namespace rrgate
