#include "server/record/recording.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <set>
#include <system_error>
#include <tuple>

#include "core/support/node_id.hpp"
#include "node/platform/utc_time.hpp"

namespace rrgate {

namespace {

rr::Error bad_recording(std::string what) {
  return rr::make_error(rr::ErrorCode::data_serialization_error, std::move(what));
}

/// Texts that a record of ours has.
class RecordedTexts {
 public:
  explicit RecordedTexts(const McapTexts& texts) : texts_(texts) {}

  /// Empty where it is missing: see missing().
  std::string text(const std::string& key) {
    const auto found = texts_.find(key);
    if (found != texts_.end()) return found->second;
    if (problem_.empty()) problem_ = "has no metadata " + rr::quote(key) + ": was it recorded by rrgate?";
    return {};
  }
  template <class T>
  T json(const std::string& key) {
    const auto content = rr::read_json(text(key));
    if (!problem_.empty()) return {};
    try {
      if (content) return content->get<T>();
      problem_ = "metadata " + rr::quote(key) + ": " + content.error().message;
    } catch (const rr::Json::exception& mismatch) {
      problem_ = "metadata " + rr::quote(key) + ": " + mismatch.what();
    }
    return {};
  }
  void fail(std::string what) {
    if (problem_.empty()) problem_ = std::move(what);
  }
  const std::string& problem() const { return problem_; }

 private:
  const McapTexts& texts_;
  std::string problem_;
};

constexpr std::array recorded_kinds{rr::MemberKind::wire, rr::MemberKind::pipe, rr::MemberKind::event,
                                    rr::MemberKind::property};

}  // namespace

Recording::Recording(McapReader reader, std::string folder)
    : folder_(std::move(folder)),
      files_{{reader.file(), reader.size()}},
      reader_(std::move(reader)),
      size_(reader_->size()) {}

rr::Result<Recording> Recording::open(const std::string& file, const std::stop_token& unwanted,
                                      const std::string& folder) {
  return open(std::vector<std::string>{file}, unwanted, folder);
}

rr::Result<Recording> Recording::read_file(const std::string& file, const std::stop_token& unwanted,
                                           const std::string& folder) {
  auto reader = McapReader::open(file, folder);
  if (!reader) return reader.error();
  Recording out(std::move(*reader), folder);
  for (;;) {
    if (unwanted.stop_requested())
      return rr::make_error(rr::ErrorCode::operation_cancelled, file + ": is not wanted any more");
    auto record = out.reader_->next();
    if (!record) return record.error();
    if (!*record) break;
    if (auto taken = out.take(**record); !taken) return out.reader_->error_in(**record, taken.error().message);
  }
  out.cut_ = out.reader_->cut();
  if (out.services_.empty() && out.cut_.empty())
    return bad_recording(file + ": holds no service: has no metadata " + rr::quote(recorded_service_name) +
                         "; was it recorded by rrgate?");
  for (const auto& [channel, member] : out.members_) {
    const auto is_its_service = [&, label = &member.service](const auto& service) { return service.label == *label; };
    if (std::none_of(out.services_.begin(), out.services_.end(), is_its_service))
      return bad_recording(file + ": channel " + rr::quote(member.topic) + " is of service " +
                           rr::quote(member.service) + ", which the file does not hold");
  }
  return out;
}

rr::Result<Recording> Recording::open(const std::vector<std::string>& files, const std::stop_token& unwanted,
                                      const std::string& folder, std::size_t max_memory) {
  std::vector<Recording> parts;
  std::string cut;  // those that hold nothing
  std::set<std::filesystem::path> known;
  std::size_t index = 0;
  std::size_t buffers = 0;
  for (const auto& file : files) {
    std::error_code missing;
    auto path = std::filesystem::canonical(std::filesystem::path(folder) / file, missing);
    if (!missing && !known.insert(std::move(path)).second) return bad_recording(file + ": is given twice");
    auto part = read_file(file, unwanted, folder);
    if (!part) return part.error();
    if (files.size() > 1) {
      part->reader_.reset();
      if (!part->cut_.empty()) part->cut_ = file + " " + part->cut_;
    }
    if (part->services_.empty()) {
      cut += (cut.empty() ? "" : "; ") + part->cut_;
      continue;
    }
    index += part->index_memory();
    buffers = std::max(buffers, part->buffer_memory());
    if (index + buffers > max_memory)
      return rr::make_error(rr::ErrorCode::out_of_system_resource,
                            file + ": with it, the recording takes " + std::to_string(index + buffers) +
                                " bytes of memory, expected " + std::to_string(max_memory) + " at most");
    parts.push_back(std::move(*part));
  }
  if (parts.empty()) return bad_recording(files.front() + ": holds no service: " + cut);
  const auto is_before = [](const Recording& a, const Recording& b) {  // those without a message are the last
    return a.message_count_ != 0 && (b.message_count_ == 0 || std::tie(a.begin_, a.end_) < std::tie(b.begin_, b.end_));
  };
  std::stable_sort(parts.begin(), parts.end(), is_before);
  auto out = std::move(parts.front());
  for (std::size_t i = 1; i < parts.size(); ++i)
    if (auto added = out.add(std::move(parts[i])); !added) return added.error();
  if (!cut.empty()) out.cut_ += (out.cut_.empty() ? "" : "; ") + cut;
  return out;
}

rr::Result<> Recording::add(Recording later) {
  auto& file = files_.emplace_back(std::move(later.files_.front()));
  if (later.message_count_ != 0 && later.begin_ < end_)
    return bad_recording(file.name + ": begins before the end of " + files_[files_.size() - 2].name +
                         ": they are of two recordings");
  for (auto& service : later.services_)
    if (auto added = add_service(std::move(service)); !added)
      return bad_recording(file.name + ": " + added.error().message);
  if (auto added = add_members(later, file); !added) return bad_recording(file.name + ": " + added.error().message);
  for (auto& chunk : later.chunks_) {
    chunk.file = files_.size() - 1;
    std::map<std::uint16_t, std::uint64_t> counts;
    for (const auto& [channel, count] : chunk.message_counts) counts[file.channel_of(channel)] += count;
    chunk.message_counts = std::move(counts);
    chunks_.push_back(std::move(chunk));
  }
  end_ = std::max(end_, later.end_);
  message_count_ += later.message_count_;
  size_ += later.size_;
  if (!later.cut_.empty()) cut_ += (cut_.empty() ? "" : "; ") + later.cut_;
  return {};
}

/// What it did not have before is added to what is known of it, as the recorder does.
rr::Result<> Recording::add_service(RecordedService later) {
  const auto is_same = [&](const RecordedService& other) { return other.label == later.label; };
  const auto known = std::find_if(services_.begin(), services_.end(), is_same);
  if (known == services_.end()) {
    services_.push_back(std::move(later));
    return {};
  }
  if (known->service != later.service || known->type != later.type)
    return bad_recording("service " + rr::quote(later.label) + " is a " + later.type + ", and in the files before a " +
                         known->type);
  for (auto& definition : later.definitions)
    if (std::find(known->definitions.begin(), known->definitions.end(), definition) == known->definitions.end())
      known->definitions.push_back(std::move(definition));
  known->objects.merge(later.objects);
  return {};
}

rr::Result<> Recording::add_members(const Recording& later, File& file) {
  const auto key_of = [](const RecordedMember& member) {
    return std::tie(member.service, member.object, member.member, member.kind);
  };
  std::map<decltype(key_of(RecordedMember())), std::uint16_t> known;
  for (const auto& [channel, member] : members_) known.emplace(key_of(member), channel);
  for (const auto& [own, member] : later.members_) {
    auto found = known.find(key_of(member));
    if (found == known.end()) {
      const auto is_taken = members_.contains(own);
      const auto last = members_.empty() ? 0 : members_.rbegin()->first;
      if (is_taken && last == std::numeric_limits<std::uint16_t>::max())
        return bad_recording("with its channels there are more than 65535");
      const auto channel = is_taken ? static_cast<std::uint16_t>(last + 1) : own;
      auto& added = members_.emplace(channel, member).first->second;
      added.channel = channel;
      added.message_count = 0;
      found = known.emplace(key_of(added), channel).first;
    }
    members_.at(found->second).message_count += member.message_count;
    if (found->second != own) file.channels.emplace(own, found->second);
  }
  return {};
}

std::vector<std::string> Recording::files() const {
  std::vector<std::string> out;
  for (const auto& file : files_) out.push_back(file.name);
  return out;
}

std::string Recording::name() const {
  return files_.size() == 1 ? files_.front().name : files_.front().name + " to " + files_.back().name;
}

rr::Result<> Recording::take(const McapRecord& record) {
  switch (record.opcode) {
    case McapOpcode::channel:
      return take_channel(record);
    case McapOpcode::metadata:
      return take_service(record);
    case McapOpcode::chunk:
      return take_chunk(record);
    case McapOpcode::message:
      return bad_recording("stands outside of a chunk; \"mcap convert\" puts it into one");
    default:
      return {};
  }
}

rr::Result<> Recording::take_channel(const McapRecord& record) {
  const auto channel = parse_mcap_channel(record.content);
  if (!channel) return channel.error();
  RecordedTexts texts(channel->metadata);
  RecordedMember member{channel->id, channel->topic, texts.text("service"), texts.text("object"), texts.text("member")};
  const auto kind_text = texts.text("kind");
  const auto kind = std::find_if(recorded_kinds.begin(), recorded_kinds.end(),
                                 [&](rr::MemberKind each) { return rr::member_kind_name(each) == kind_text; });
  if (kind == recorded_kinds.end())
    texts.fail("kind " + rr::quote(kind_text) + ", expected wire, pipe, event or property");
  else
    member.kind = *kind;
  if (channel->encoding != "json") texts.fail("messages are " + rr::quote(channel->encoding) + ", expected \"json\"");
  if (const auto type = channel->metadata.find("type"); type != channel->metadata.end()) member.type = type->second;
  if (!texts.problem().empty()) return bad_recording(rr::quote(channel->topic) + " " + texts.problem());
  members_.emplace(channel->id, std::move(member));
  return {};
}

rr::Result<> Recording::take_service(const McapRecord& record) {
  const auto metadata = parse_mcap_metadata(record.content);
  if (!metadata) return metadata.error();
  if (metadata->name != recorded_service_name) return {};
  RecordedTexts texts(metadata->texts);
  RecordedService service{texts.text("label"), texts.text("url"), texts.text("service"), texts.text("type")};
  service.node.name = texts.text("node_name");
  const auto id = rr::parse_node_id(texts.text("node_id"));
  if (id)
    service.node.id = *id;
  else
    texts.fail("node_id: " + id.error().message);
  service.attributes = texts.json<rr::OrderedJson>("attributes");
  service.definitions = texts.json<std::vector<std::string>>("definitions");
  service.objects = texts.json<std::map<std::string, std::string>>("objects");
  if (!texts.problem().empty()) return bad_recording(texts.problem());
  const auto is_same = [&](const RecordedService& other) { return other.label == service.label; };
  const auto known = std::find_if(services_.begin(), services_.end(), is_same);
  if (known != services_.end())  // told again: objects that were found later
    *known = std::move(service);
  else
    services_.push_back(std::move(service));
  return {};
}

rr::Result<> Recording::take_chunk(const McapRecord& record) {
  auto records = McapChunkReader::open(record);
  if (!records) return records.error();
  RecordedChunk chunk;
  chunk.offset = record.offset;
  chunk.bytes = record.content.size();
  for (;;) {
    const auto inner = records->next();
    if (!inner) return inner.error();
    if (!*inner) break;
    if ((*inner)->opcode == McapOpcode::channel) {
      if (auto taken = take_channel(**inner); !taken) return taken;
    }
    if ((*inner)->opcode != McapOpcode::message) continue;
    const auto message = parse_mcap_message((*inner)->content);
    if (!message) return message.error();
    const auto member = members_.find(message->channel);
    if (member == members_.end())
      return bad_recording("message at byte " + std::to_string((*inner)->offset) + " of it: is of channel " +
                           std::to_string(message->channel) + ", which was not told before");
    chunk.first = chunk.message_count == 0 ? message->log_time : std::min(chunk.first, message->log_time);
    chunk.last = std::max(chunk.last, message->log_time);
    ++chunk.message_count;
    ++chunk.message_counts[message->channel];
    ++member->second.message_count;
  }
  if (chunk.message_count == 0) return {};
  begin_ = chunks_.empty() ? chunk.first : std::min(begin_, chunk.first);
  end_ = std::max(end_, chunk.last);
  message_count_ += chunk.message_count;
  chunks_.push_back(std::move(chunk));
  return {};
}

std::size_t Recording::memory() const {
  return index_memory() + buffer_memory();
}

std::size_t Recording::index_memory() const {
  constexpr std::size_t node_bytes = 64;  // of a map
  std::size_t out = 0;
  for (const auto& chunk : chunks_) out += sizeof(chunk) + chunk.message_counts.size() * node_bytes;
  return out;
}

std::size_t Recording::buffer_memory() const {
  std::size_t largest = 0;
  for (const auto& chunk : chunks_)
    largest = std::max(largest, chunk.bytes + static_cast<std::size_t>(chunk.message_count) * sizeof(McapMessage));
  return 2 * largest;  // the reader has its bytes, and who reads them has
}

rr::Result<McapReader*> Recording::reader_of(std::size_t file) {
  if (!reader_ || reader_file_ != file) {
    auto opened = McapReader::open(files_[file].name, folder_, files_[file].size);
    if (!opened) return opened.error();
    reader_.emplace(std::move(*opened));
    reader_file_ = file;
  }
  return &*reader_;
}

rr::Result<Recording::Messages> Recording::read(const RecordedChunk& chunk) {
  const auto found = reader_of(chunk.file);
  if (!found) return found.error();
  const auto& reader = **found;
  const auto& file = files_[chunk.file];
  const auto record = (*found)->read_at(chunk.offset);
  if (!record) return record.error();
  Messages out{rr::Bytes(record->content.begin(), record->content.end()), {}};
  auto whole = *record;
  whole.content = out.bytes;
  auto records = McapChunkReader::open(whole);
  if (!records) return reader.error_in(whole, records.error().message);
  for (;;) {
    const auto inner = records->next();
    if (!inner) return reader.error_in(whole, inner.error().message);
    if (!*inner) break;
    if ((*inner)->opcode != McapOpcode::message) continue;
    const auto message = parse_mcap_message((*inner)->content);
    if (!message) return reader.error_in(whole, message.error().message);
    out.messages.push_back(*message);
    auto& channel = out.messages.back().channel;
    channel = file.channel_of(channel);
    if (!members_.contains(channel)) return reader.error_in(whole, "has changed since it was opened");
  }
  return out;
}

rr::Result<> Recording::for_each(const RecordedMember& member,
                                 const std::function<rr::Result<>(const McapMessage&)>& take) {
  for (const auto& chunk : chunks_) {
    if (!chunk.message_counts.contains(member.channel)) continue;
    const auto found = read(chunk);
    if (!found) return found.error();
    for (const auto& message : found->messages)
      if (message.channel == member.channel)
        if (auto taken = take(message); !taken) return taken;
  }
  return {};
}

rr::Result<rr::Json> Recording::read_document(const McapMessage& message) const {
  auto document = rr::read_json(rr::as_text(message.data));
  const auto& member = members_.at(message.channel);
  std::string problem;
  if (!document)
    problem = document.error().message;
  else if (!document->is_object())
    problem = std::string("is ") + document->type_name() + ", expected an object";
  else if (member.kind != rr::MemberKind::event && !document->contains("value"))
    problem = "has no \"value\"";
  if (problem.empty()) return document;
  return bad_recording(name() + ": " + member.topic + ", message " + std::to_string(message.sequence) + ": " + problem);
}

std::string recorded_ring(const std::string& path) {
  auto reader = McapReader::open(path);
  if (!reader) return {};
  const auto header = reader->next();
  if (!header || !*header || (*header)->opcode != McapOpcode::header) return {};
  const auto record = reader->next();
  if (!record || !*record || (*record)->opcode != McapOpcode::metadata) return {};
  const auto metadata = parse_mcap_metadata((*record)->content);
  if (!metadata || metadata->name != recorded_ring_name) return {};
  const auto ring = metadata->texts.find("of");
  return ring == metadata->texts.end() ? std::string() : ring->second;
}

bool has_recorded_messages(const std::string& path) {
  // What stands before the first message is much smaller: nothing of large files needs to be read.
  constexpr std::uintmax_t surely = 1u << 20;
  std::error_code error;
  if (const auto size = std::filesystem::file_size(path, error); error || size > surely) return true;
  auto reader = McapReader::open(path);
  if (!reader) return true;
  for (;;) {
    const auto record = reader->next();
    if (!record) return true;
    if (!*record) return false;
    if ((*record)->opcode == McapOpcode::chunk || (*record)->opcode == McapOpcode::message) return true;
  }
}

std::string mcap_time_text(McapTime time) {
  constexpr McapTime second = 1'000'000'000;
  return rr::format_utc({static_cast<std::int64_t>(time / second), static_cast<std::int32_t>(time % second)}, 9);
}

}  // namespace rrgate
