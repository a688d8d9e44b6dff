// A recording that is read, of one file or of several that follow one another: what it holds, and its messages.
// Layer: server/record.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/robdef/model/service_definition.hpp"
#include "server/record/mcap_reader.hpp"
#include "server/record/recording_writer.hpp"

namespace rrgate {

struct RecordedMember {
  std::uint16_t channel = 0;  ///< of the recording: files may number theirs otherwise
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
  std::size_t file = 0;  ///< of Recording::files()
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
  /// The same of several, one at least, as one time line: in the order of their first messages, however they are given.
  /// Those that were cut before their first service hold nothing: they are named in cut(), and one has to be left.
  /// `max_memory`  see memory(); asked after each file.
  /// Errors also   data_serialization_error: files whose times overlap, or that know different services by one label,
  /// and one that is given twice; out_of_system_resource.
  static rr::Result<Recording> open(const std::vector<std::string>& files, const std::stop_token& unwanted = {},
                                    const std::string& folder = {},
                                    std::size_t max_memory = std::numeric_limits<std::size_t>::max());

  const std::vector<RecordedService>& services() const { return services_; }
  const std::map<std::uint16_t, RecordedMember>& members() const { return members_; }
  const std::vector<RecordedChunk>& chunks() const { return chunks_; }
  std::uint64_t message_count() const { return message_count_; }
  McapTime begin() const { return begin_; }
  McapTime end() const { return end_; }
  /// See McapReader; of several files, which of them.
  const std::string& cut() const { return cut_; }
  /// As open() was told them, in the order of time.
  std::vector<std::string> files() const;
  /// For people: the file, or the first and the last.
  std::string name() const;
  std::uint64_t size() const { return size_; }
  /// Bytes that are held for it, about, also while a chunk is read.
  std::size_t memory() const;

  struct Messages {
    rr::Bytes bytes;  ///< what the messages borrow
    std::vector<McapMessage> messages;
  };
  /// In the order of the file, whose channels are those of members(). Errors   as open(), where it has changed since.
  rr::Result<Messages> read(const RecordedChunk& chunk);
  /// Calls `take` with each message of a member, in the order of the files; borrowed for the call. Errors   as read();
  /// the first that `take` returns, which ends it.
  rr::Result<> for_each(const RecordedMember& member, const std::function<rr::Result<>(const McapMessage&)>& take);
  /// The document of a message. Errors   data_serialization_error: what it is, and why.
  rr::Result<rr::Json> read_document(const McapMessage& message) const;

 private:
  struct File {
    std::string name;
    std::uint64_t size = 0;                                ///< when it was read: it may grow
    std::map<std::uint16_t, std::uint16_t> channels = {};  ///< by the file's own; without those that are the same

    std::uint16_t channel_of(std::uint16_t own) const {
      const auto found = channels.find(own);
      return found == channels.end() ? own : found->second;
    }
  };
  Recording(McapReader reader, std::string folder);
  /// Without a service where it was cut before the first.
  static rr::Result<Recording> read_file(const std::string& file, const std::stop_token& unwanted,
                                         const std::string& folder);
  /// What was recorded later.
  rr::Result<> add(Recording later);
  rr::Result<> add_service(RecordedService later);
  rr::Result<> add_members(const Recording& later, File& file);
  std::size_t index_memory() const;
  std::size_t buffer_memory() const;
  /// One file is open at a time.
  rr::Result<McapReader*> reader_of(std::size_t file);
  rr::Result<> take(const McapRecord& record);
  rr::Result<> take_channel(const McapRecord& record);
  rr::Result<> take_service(const McapRecord& record);
  rr::Result<> take_chunk(const McapRecord& record);

  std::string folder_;
  std::vector<File> files_;
  std::optional<McapReader> reader_;
  std::size_t reader_file_ = 0;
  std::string cut_;
  std::uint64_t size_ = 0;
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
