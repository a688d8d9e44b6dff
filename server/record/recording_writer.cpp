#include "server/record/recording_writer.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "core/support/node_id.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

namespace {

constexpr int max_schema_depth = 12;  // structures may hold their own kind

rr::OrderedJson any_object() {
  return {{"type", "object"}};
}

/// Nodes that a part of a schema takes, but for schemas within it.
std::size_t weight_of(const rr::OrderedJson& part) {
  constexpr std::size_t node_bytes = 64;
  if (part.is_string()) return 1 + part.get_ref<const std::string&>().size() / node_bytes;
  std::size_t out = 1;
  if (part.is_array())
    for (const auto& each : part) out += each.is_string() ? weight_of(each) : 1;
  return out;
}

/// Schemas with what they refer to inlined: that may double with each reference, so there is a bound.
class FlatSchemas {
 public:
  FlatSchemas(const rr::OrderedJson& named, std::size_t nodes) : named_(named), left_(nodes) {}

  rr::OrderedJson make(const rr::OrderedJson& schema, int depth = 0) {
    if (depth > max_schema_depth || !take(schema)) return any_object();
    if (const auto reference = schema.find("$ref"); reference != schema.end()) {
      const auto target = reference->get<std::string>();
      const auto found = named_.find(target.substr(target.rfind('/') + 1));
      return found == named_.end() ? any_object() : make(*found, depth + 1);
    }
    for (const auto* choice : {"oneOf", "anyOf"})
      if (const auto found = schema.find(choice); found != schema.end()) {
        auto out = make(found->front(), depth + 1);
        if (schema.contains("x-rr-type")) out["x-rr-type"] = schema["x-rr-type"];
        return out;
      }
    rr::OrderedJson out = schema;
    if (const auto type = out.find("type"); type != out.end() && type->is_array()) *type = type->front();
    if (out.contains("const")) return {{"type", "array"}, {"items", {{"type", "integer"}}}};  // dimensions
    if (!out.contains("type")) out["type"] = "object";
    for (const auto* inner : {"items", "additionalProperties"})
      if (const auto found = out.find(inner); found != out.end() && found->is_object())
        *found = make(*found, depth + 1);
    if (const auto properties = out.find("properties"); properties != out.end())
      for (auto& each : *properties) each = make(each, depth + 1);
    return out;
  }
  /// Before a schema is copied.
  bool take(const rr::OrderedJson& schema) {
    std::size_t weight = 1;
    for (const auto& part : schema) weight += weight_of(part);
    if (const auto properties = schema.find("properties"); properties != schema.end()) weight += properties->size();
    is_too_large_ = is_too_large_ || weight > left_;
    left_ -= std::min(left_, weight);
    return !is_too_large_;
  }
  bool is_too_large() const { return is_too_large_; }
  std::size_t left() const { return left_; }

 private:
  const rr::OrderedJson& named_;
  std::size_t left_;
  bool is_too_large_ = false;
};

std::string numbered_path(const std::string& path, std::uint32_t number) {
  const std::filesystem::path whole(path);
  return (whole.parent_path() / (whole.stem().string() + "-" + std::to_string(number) + whole.extension().string()))
      .string();
}

void drop_front(std::deque<std::string>& paths) {
  std::error_code ignored;  // whoever removed it was faster
  std::filesystem::remove(paths.front(), ignored);
  paths.pop_front();
}

/// Makes room for one more. `kept`  0: all stay.
void drop_down_to(std::deque<std::string>& paths, std::size_t kept) {
  while (kept != 0 && paths.size() >= kept) drop_front(paths);
}

/// No file is left of one that could not be begun; what is no file, as /dev/full, stays.
rr::Result<McapWriter> begin_file(const std::string& path, const RecordingOptions& options) {
  auto out = McapWriter::create(path, options.library);
  rr::Result<> begun;
  if (!out)
    begun = out.error();
  else if (!options.ring.empty())
    begun = out->add_metadata(recorded_ring_name, {{"of", options.ring}});
  if (begun) return out;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
  return begun.error();
}

}  // namespace

McapTime to_mcap_time(rr::TimeSpec time) {
  const auto normal = time.normalized();
  constexpr std::int64_t last_second = 18'446'744'072;  // of 64 bits
  if (normal.seconds < 0 || normal.nanoseconds < 0) return 0;
  return static_cast<McapTime>(std::min(normal.seconds, last_second)) * 1'000'000'000u +
         static_cast<McapTime>(normal.nanoseconds);
}

rr::OrderedJson recorded_schema(const rr::MemberDefinition& member, const rr::OrderedJson& named,
                                std::size_t& nodes_left) {
  const auto allowed = std::min(nodes_left, max_member_schema_nodes);
  FlatSchemas flat(named, allowed);
  rr::OrderedJson out{{"type", "object"}, {"properties", rr::OrderedJson::object()}};
  if (!member.documentation.empty()) out["description"] = member.documentation;
  if (!flat.take(out)) {
    nodes_left -= std::min<std::size_t>(nodes_left, 1);
    return any_object();
  }
  auto& properties = out["properties"];
  if (member.kind == rr::MemberKind::event)
    for (const auto& parameter : member.parameters)
      properties[parameter.name] = flat.make(rr::type_schema(parameter.type));
  else
    properties["value"] = flat.make(rr::type_schema(member.type));
  nodes_left -= allowed - flat.left();
  return flat.is_too_large() ? any_object() : out;
}

rr::Result<RecordingWriter> RecordingWriter::create(const std::string& path, RecordingOptions options) {
  auto complete = std::exchange(options.former, {});
  auto writer = begin_file(path, options);
  if (!writer) return writer.error();
  RecordingWriter out(path, std::move(options), std::move(*writer));
  out.complete_ = std::move(complete);
  return out;
}

std::string RecordingWriter::free_label(const std::string& service) const {
  auto label = service;
  const auto is_taken = [&](const McapTexts& other) { return other.at("label") == label; };
  for (int number = 2; std::any_of(services_.begin(), services_.end(), is_taken); ++number)
    label = service + "-" + std::to_string(number);
  return label;
}

rr::Result<> RecordingWriter::add_service(const RecordedService& service) {
  McapTexts texts{{"label", service.label},
                  {"url", service.url},
                  {"service", service.service},
                  {"type", service.type},
                  {"node_name", service.node.name},
                  {"node_id", rr::format_node_id(service.node.id)},
                  {"attributes", rr::write_json(service.attributes)},
                  {"definitions", rr::write_json(service.definitions)},
                  {"objects", rr::write_json(service.objects)}};
  const auto is_same = [&](const McapTexts& other) { return other.at("label") == service.label; };
  const auto known = std::find_if(services_.begin(), services_.end(), is_same);
  if (known != services_.end())
    *known = texts;
  else
    services_.push_back(texts);
  const auto before = writer_.size();
  auto added = writer_.add_metadata(recorded_service_name, texts);
  preamble_bytes_ += writer_.size() - before;
  return added;
}

rr::Result<std::uint16_t> RecordingWriter::add_member(const RecordedService& service, const std::string& object_path,
                                                      const std::string& place, const rr::MemberDefinition& member,
                                                      const rr::OrderedJson& named) {
  Channel channel;
  channel.topic = "/" + service.label + "/" + (place.empty() ? "" : place + "/") + member.name;
  const auto& object_type = service.objects.at(object_path);
  channel.schema_name = object_type + "." + member.name;
  channel.schema = rr::write_json(recorded_schema(member, named, schema_nodes_left_));
  channel.metadata = {{"service", service.label},
                      {"object", object_path},
                      {"object_type", object_type},
                      {"member", member.name},
                      {"kind", std::string(rr::member_kind_name(member.kind))}};
  if (member.kind != rr::MemberKind::event) channel.metadata["type"] = rr::format_type(member.type);
  const auto before = writer_.size();
  if (auto put = put_channel(channel); !put) return put.error();
  preamble_bytes_ += writer_.size() - before;
  topics_.push_back(channel.topic);
  channels_.push_back(std::move(channel));
  return static_cast<std::uint16_t>(channels_.size() - 1);
}

rr::Result<> RecordingWriter::put_channel(const Channel& channel) {
  const auto key = channel.schema_name + "\n" + channel.schema;
  auto schema = schemas_.find(key);
  if (schema == schemas_.end()) {
    const auto added = writer_.add_schema(channel.schema_name, "jsonschema", channel.schema);
    if (!added) return added.error();
    schema = schemas_.emplace(key, *added).first;
  }
  const auto added = writer_.add_channel(channel.topic, "json", schema->second, channel.metadata);
  return added ? rr::Result<>() : rr::Result<>(added.error());
}

rr::Result<> RecordingWriter::write(std::uint16_t channel, const rr::OrderedJson& message,
                                    std::optional<rr::TimeSpec> sent, rr::TimeSpec now) {
  const bool is_full = options_.max_bytes != 0 && writer_.size() >= std::max(options_.max_bytes, least_file_bytes());
  if (is_full || writer_.index_bytes() >= options_.max_index_bytes)
    if (auto begun = begin_next_file(); !begun) return begun;
  if (writer_.message_count() == 0) drop_down_to(complete_, options_.kept_files);
  const auto text = rr::write_json(message);
  const auto time = time_to_log(to_mcap_time(now));
  McapMessage out{channel, channels_.at(channel).sequence, time, time, rr::as_bytes(text)};
  if (sent) out.publish_time = to_mcap_time(*sent);
  auto written = writer_.write(out);
  if (written) ++channels_[channel].sequence;
  return written;
}

/// A clock that was set back goes on counting from where it was, until it has caught up.
McapTime RecordingWriter::time_to_log(McapTime now) {
  if (now >= newest_)
    shift_ = 0;
  else if (now + shift_ < newest_)
    shift_ = newest_ - now;
  return newest_ = now + shift_;
}

/// Files of an earlier recording stay, unless they were to be replaced.
std::string RecordingWriter::next_path() {
  for (;;) {
    auto path = numbered_path(first_path_, ++file_number_);
    std::error_code error;
    if (options_.replaces || !std::filesystem::exists(path, error)) return path;
  }
}

bool RecordingWriter::drop_oldest() {
  if (complete_.empty()) return false;
  drop_front(complete_);
  return true;
}

/// Each file stands for itself: services and channels are told again, under the same numbers.
rr::Result<> RecordingWriter::begin_next_file() {
  if (auto closed = writer_.close(); !closed) return closed;
  if (options_.kept_files != 0) complete_.push_back(writer_.path());
  auto next = begin_file(next_path(), options_);
  if (!next) return next.error();
  finished_messages_ += writer_.message_count();
  finished_bytes_ += writer_.size();
  writer_ = std::move(*next);
  schemas_.clear();
  for (const auto& service : services_)
    if (auto added = writer_.add_metadata(recorded_service_name, service); !added) return added;
  for (const auto& channel : channels_)
    if (auto put = put_channel(channel); !put) return put;
  preamble_bytes_ = writer_.size();
  return {};
}

}  // namespace rrgate
