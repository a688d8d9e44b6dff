// Recordings of Robot Raconteur services as MCAP files. Layer: server/record.
//
// A file holds all that showing and replaying it takes. Each service is a metadata record "robotraconteur.service": its
// URL, node, type, attributes and definitions. Each member is a channel with the topic "/SERVICE/path/member", whose
// metadata name the service, the object and the member; its messages are JSON as the gateway writes it: {"value": ...}
// of wires, pipes and properties, the arguments by name of events.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/robdef/model/service_definition.hpp"
#include "core/session/connection.hpp"
#include "server/json/json.hpp"
#include "server/record/mcap_writer.hpp"

namespace rrgate {

/// Name of the metadata record of a service.
inline constexpr const char* recorded_service_name = "robotraconteur.service";
/// Name of the metadata record that names the ring which a file belongs to, at the beginning of the file.
inline constexpr const char* recorded_ring_name = "rrgate.ring";

struct RecordedService {
  std::string label;  ///< by which the file knows it: the service's name, and where that is taken a number behind it
  std::string url;
  std::string service;
  std::string type;  ///< of the root object
  rr::NodeIdentity node;
  rr::OrderedJson attributes = rr::OrderedJson::object();  ///< a varvalue{string}
  std::vector<std::string> definitions;                    ///< imports before importers
  std::map<std::string, std::string> objects;              ///< service path -> qualified type, the root's included
};

struct RecordingOptions {
  /// Of one file, about; then the next one begins. 0: no limit. Where it is less than least_file_bytes(), that counts.
  std::uint64_t max_bytes = 0;
  /// The oldest go when a further one has its first message: one that stays empty takes the place of none. 0: all stay.
  std::uint32_t kept_files = 0;
  std::deque<std::string> former = {};  ///< paths of older files that count among the kept ones, oldest first
  std::string ring = {};                ///< what each file says it belongs to: see recorded_ring(). Empty: nothing
  bool replaces = false;                ///< further files that are there already; else their numbers are left out
  std::string library = "rrgate";       ///< what the file says it was written by
  /// A file whose index has become so large ends, too: the index is held in memory.
  std::size_t max_index_bytes = 16u << 20;
};

/// What schemas may have: of one member, and of all of a recording. A node is about 64 bytes of text.
inline constexpr std::size_t max_member_schema_nodes = 2'000;
inline constexpr std::size_t max_schema_nodes = 50'000;

/// Errors of all   those of McapWriter.
class RecordingWriter {
 public:
  /// A file of the name `path` is replaced.
  static rr::Result<RecordingWriter> create(const std::string& path, RecordingOptions options = {});

  /// A label that no other service of the recording has.
  std::string free_label(const std::string& service) const;
  /// Again with a label that is there: its objects have become more.
  rr::Result<> add_service(const RecordedService& service);
  /// `object_path`  one of the service's objects. `place`  how the topic names it: "axes/0", empty for the root.
  /// `named`  see recorded_schema().
  /// Returns  the channel, for write().
  rr::Result<std::uint16_t> add_member(const RecordedService& service, const std::string& object_path,
                                       const std::string& place, const rr::MemberDefinition& member,
                                       const rr::OrderedJson& named);
  /// `sent`  when the device sent it; where that is not known, it is taken to be now.
  rr::Result<> write(std::uint16_t channel, const rr::OrderedJson& message, std::optional<rr::TimeSpec> sent,
                     rr::TimeSpec now);
  rr::Result<> flush() { return writer_.flush(); }
  /// Deletes the oldest of the files that are complete, where not all stay. False: there is none.
  bool drop_oldest();
  /// Paths of the files that are kept beside the one at hand, where not all stay; oldest first.
  const std::deque<std::string>& kept() const { return complete_; }
  rr::Result<> close() { return writer_.close(); }

  std::uint64_t message_count() const { return finished_messages_ + writer_.message_count(); }
  /// Of all files.
  std::uint64_t size() const { return finished_bytes_ + writer_.size(); }
  /// How large a file becomes before the next begins: a quarter more than what stands before its messages, its services
  /// with their definitions and its channels with their schemas. Else a low limit makes files of little else.
  std::uint64_t least_file_bytes() const { return preamble_bytes_ + preamble_bytes_ / 4; }
  /// The file that is written now.
  const std::string& path() const { return writer_.path(); }
  const std::vector<std::string>& topics() const { return topics_; }

 private:
  struct Channel {
    std::string topic;
    std::string schema_name;
    std::string schema;
    McapTexts metadata;
    std::uint32_t sequence = 0;
  };
  RecordingWriter(std::string path, RecordingOptions options, McapWriter writer)
      : first_path_(std::move(path)), options_(std::move(options)), writer_(std::move(writer)) {}
  rr::Result<> put_channel(const Channel& channel);
  rr::Result<> begin_next_file();
  std::string next_path();
  McapTime time_to_log(McapTime now);

  std::string first_path_;
  RecordingOptions options_;
  McapWriter writer_;
  std::deque<std::string> complete_;  ///< see kept()
  std::uint32_t file_number_ = 1;
  std::vector<McapTexts> services_;
  std::vector<Channel> channels_;
  std::vector<std::string> topics_;
  std::map<std::string, std::uint16_t> schemas_;  ///< of the file at hand: text -> id
  std::size_t schema_nodes_left_ = max_schema_nodes;
  McapTime newest_ = 0;
  McapTime shift_ = 0;  ///< of the clock, which was set back
  std::uint64_t finished_messages_ = 0;
  std::uint64_t finished_bytes_ = 0;
  std::uint64_t preamble_bytes_ = writer_.size();  ///< of the file at hand: what stands before the messages
};

/// The schema of a member's messages, without references and choices, as tools read it that plot numbers. Text and
/// numbers that may stand for one another are told as what they are most: NaN has the type "number" as well. A schema
/// that would become too large says no more than that there is an object.
/// `named`  from rr::named_type_schemas(). `nodes_left`  that it may have; what it has is taken off.
rr::OrderedJson recorded_schema(const rr::MemberDefinition& member, const rr::OrderedJson& named,
                                std::size_t& nodes_left);

/// 0 for times before 1970.
McapTime to_mcap_time(rr::TimeSpec time);

}  // namespace rrgate
