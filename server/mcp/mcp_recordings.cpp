#include "server/mcp/mcp_recordings.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "server/http/endpoints/call_log.hpp"
#include "server/http/endpoints/refusal.hpp"
#include "server/http/split_path.hpp"
#include "server/mcp/mcp_describe.hpp"
#include "server/mcp/mcp_summary.hpp"
#include "server/mcp/mcp_tools.hpp"
#include "server/recordings/recordings.hpp"

namespace rrgate {

namespace {

/// Of files: a thread reads them in a second or two.
constexpr std::uint64_t most_read_bytes = 32u * 1024 * 1024;
constexpr std::size_t most_members = 1000;
/// Of a value's JSON: an answer has no room for more.
constexpr std::size_t largest_recorded = 64u * 1024;
/// One agent reads at a time: the others get their turn, or give up.
constexpr std::chrono::seconds longest_turn_wait{10};

double seconds_since_epoch(std::chrono::system_clock::time_point time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

/// What stands before the values.
rr::OrderedJson about(const RecordingInfo& recording) {
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "recording") = recording.name;
  rr::add_key(out, "device") = recording.device;
  rr::add_key(out, "service") = recording.service;
  rr::add_key(out, "state") = std::string(to_string(recording.state));
  rr::add_key(out, "begin") = seconds_since_epoch(recording.begin);
  rr::add_key(out, "seconds") =
      std::max(0.0, seconds_since_epoch(recording.end) - seconds_since_epoch(recording.begin));
  rr::add_key(out, "bytes") = recording.bytes();
  return out;
}

/// The newest files that can be read at once, oldest first.
std::vector<RecordingFile> newest_files(const RecordingInfo& recording) {
  auto first = recording.files.size();
  std::uint64_t bytes = 0;
  while (first > 0 && bytes + recording.files[first - 1].bytes <= most_read_bytes)
    bytes += recording.files[--first].bytes;
  if (first == recording.files.size() && first > 0)
    refuse(rr::ErrorCode::out_of_system_resource, "the newest file of the recording has " +
                                                      std::to_string(recording.files.back().bytes) +
                                                      " bytes, and at most " + std::to_string(most_read_bytes) +
                                                      " are read for an agent; a person can download it");
  return {recording.files.begin() + static_cast<std::ptrdiff_t>(first), recording.files.end()};
}

rr::Error in_words_for_agent(const rr::Error& error, const std::string& path) {
  return rr::make_error(error.code, rr::quote(std::filesystem::path(path).filename().string()) + " can't be read");
}

/// What the files say of a member, from the first of them to the last.
struct RecordedValues {  // NOLINT(bugprone-exception-escape): the JSON of its values throws nothing in moves
  std::uint64_t count = 0;
  std::uint64_t too_large = 0;  ///< not counted in the others
  McapTime first_time = 0;
  McapTime last_time = 0;
  rr::OrderedJson first = nullptr;
  rr::OrderedJson last = nullptr;
  McpSummary numbers = {};

  void add(McapTime time, const rr::Json& value) {
    last = value;
    last_time = time;
    if (++count == 1) {
      first = last;
      first_time = time;
    }
    numbers.add(last);
  }

  rr::OrderedJson to_json() const {
    auto out = rr::OrderedJson::object();
    rr::add_key(out, "count") = count;
    if (too_large > 0) rr::add_key(out, "too_large") = too_large;
    if (count == 0) return out;
    constexpr double nanosecond = 1e-9;
    const auto between = last_time > first_time ? static_cast<double>(last_time - first_time) * nanosecond : 0.0;
    if (between > 0) rr::add_key(out, "per_second") = static_cast<double>(count - 1) / between;
    rr::add_key(out, "first_time") = mcap_time_text(first_time);
    rr::add_key(out, "last_time") = mcap_time_text(last_time);
    auto& said = rr::add_key(out, from_device) = rr::OrderedJson::object();
    rr::add_key(said, "first") = first;
    rr::add_key(said, "last") = last;
    rr::add_key(said, "numbers") = numbers.to_json();
    return out;
  }
};

rr::Result<> add_values(Recording& recording, const RecordedMember& member, RecordedValues& values) {
  return recording.for_each(member, [&](const McapMessage& message) -> rr::Result<> {
    if (message.data.size() > largest_recorded) {
      ++values.too_large;
      return {};
    }
    const auto document = recording.read_document(message);
    if (!document) return document.error();
    values.add(message.publish_time, member.kind == rr::MemberKind::event ? *document : document->at("value"));
    return {};
  });
}

struct RecordedCount {
  rr::MemberKind kind;
  std::string type;
  std::uint64_t count;
};

rr::OrderedJson members_json(const std::map<std::string, RecordedCount>& members) {
  auto list = rr::OrderedJson::array();
  for (const auto& [topic, member] : members) {
    if (list.size() == most_members) break;
    list.push_back({{"path", bounded_text(topic.substr(std::min<std::size_t>(1, topic.size())))},
                    {"kind", std::string(rr::member_kind_name(member.kind))},
                    {"type", bounded_text(member.type)},
                    {"count", member.count}});
  }
  auto out = rr::OrderedJson::object();
  rr::add_key(out, from_device)["members"] = std::move(list);
  return out;
}

}  // namespace

rr::Result<rr::OrderedJson> RecordingReading::read() const {
  std::map<std::string, RecordedCount> members;
  RecordedValues values;
  for (const auto& path : files) {
    auto recording = Recording::open(path);
    std::error_code error;
    if (!recording && !std::filesystem::exists(path, error)) continue;  // newer ones have taken its place
    if (!recording) return in_words_for_agent(recording.error(), path);
    for (const auto& [channel, member] : recording->members()) {
      auto& counted = members.try_emplace(member.topic, RecordedCount{member.kind, member.type, 0}).first->second;
      counted.count += member.message_count;
      if (member.topic != topic) continue;
      if (const auto added = add_values(*recording, member, values); !added)
        return in_words_for_agent(added.error(), path);
    }
  }
  if (topic.empty()) return rr::Result<rr::OrderedJson>(boost::system::in_place_value, members_json(members));
  if (!members.contains(topic))
    return rr::make_error(rr::ErrorCode::member_not_found,
                          "nothing is recorded of " + rr::quote(topic.substr(1)) + "; the recording lists its members");
  return rr::Result<rr::OrderedJson>(boost::system::in_place_value, values.to_json());
}

rr::awaitable<rr::OrderedJson> McpTools::read_recording(const std::string& uri) {
  const auto rest = std::string_view(uri).substr(recording_scheme.size());
  const auto slash = std::min(rest.find('/'), rest.size());
  const std::string name(rest.substr(0, slash));
  const auto recording = co_await gateway_.recordings().find_for(gateway_.access(), who(), name);
  if (!recording && recording.error().code == rr::ErrorCode::resource_not_found)
    refuse(rr::ErrorCode::resource_not_found, recording.error().message + "; resources/list names them");
  if (!recording) {
    gateway_.reject(recording.error());
    throw rr::Exception(recording.error());
  }
  const auto files = newest_files(*recording);
  RecordingReading reading;
  for (const auto& segment : value_or_throw(split_path(rest.substr(std::min(slash + 1, rest.size())))))
    reading.topic += "/" + segment;
  for (const auto& file : files) reading.files.push_back(gateway_.recordings().path_of(file));
  std::optional<RateGate::Pass> turn;
  const std::function<bool()> is_its_turn = [&] {
    turn = gateway_.recording_readers().enter({}, 0, 1, std::chrono::steady_clock::now());
    return turn.has_value();
  };
  if (!co_await reply_.wait(longest_turn_wait, is_its_turn))
    refuse(rr::ErrorCode::out_of_system_resource, "other agents read recordings; try again in a minute");
  auto begun = gateway_.access().check_and_begin(who(), wanted_of(*recording),
                                                 trace_id_of(reply_.request().header("traceparent")), "recording_read");
  const auto entry = value_or_throw(std::move(begun));
  const auto work = [&reading] { return reading.read(); };
  auto read = co_await gateway_.workers().run(work);
  if (entry)
    entry->finish(read ? Outcome::ok : Outcome::error, read ? std::string_view(recording->name) : read.error().message);
  auto out = about(*recording);
  rr::add_key(out, "files_left_out") = recording->files.size() - files.size();
  out.update(value_or_throw(std::move(read)));
  co_return out;
}

}  // namespace rrgate
