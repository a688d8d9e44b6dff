#include "server/record/recording_writer.hpp"

#include <algorithm>
#include <filesystem>

#include "core/support/node_id.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

namespace {

constexpr int max_schema_depth = 12;  // structures may hold their own kind

rr::OrderedJson flat_schema(const rr::OrderedJson& schema, const rr::OrderedJson& named, int depth) {
  if (depth > max_schema_depth) return {{"type", "object"}};
  if (const auto reference = schema.find("$ref"); reference != schema.end()) {
    const auto target = reference->get<std::string>();
    const auto found = named.find(target.substr(target.rfind('/') + 1));
    return found == named.end() ? rr::OrderedJson{{"type", "object"}} : flat_schema(*found, named, depth + 1);
  }
  for (const auto* choice : {"oneOf", "anyOf"})
    if (const auto found = schema.find(choice); found != schema.end()) {
      auto out = flat_schema(found->front(), named, depth + 1);
      if (schema.contains("x-rr-type")) out["x-rr-type"] = schema["x-rr-type"];
      return out;
    }
  rr::OrderedJson out = schema;
  if (const auto type = out.find("type"); type != out.end() && type->is_array()) *type = type->front();
  if (out.contains("const")) return {{"type", "array"}, {"items", {{"type", "integer"}}}};  // dimensions
  if (!out.contains("type")) out["type"] = "object";
  for (const auto* inner : {"items", "additionalProperties"})
    if (const auto found = out.find(inner); found != out.end() && found->is_object())
      *found = flat_schema(*found, named, depth + 1);
  if (const auto properties = out.find("properties"); properties != out.end())
    for (auto& each : *properties) each = flat_schema(each, named, depth + 1);
  return out;
}

std::string numbered_path(const std::string& path, std::uint32_t number) {
  const std::filesystem::path whole(path);
  return (whole.parent_path() / (whole.stem().string() + "-" + std::to_string(number) + whole.extension().string()))
      .string();
}

}  // namespace

McapTime to_mcap_time(rr::TimeSpec time) {
  const auto normal = time.normalized();
  constexpr std::int64_t last_second = 18'446'744'072;  // of 64 bits
  if (normal.seconds < 0 || normal.nanoseconds < 0) return 0;
  return static_cast<McapTime>(std::min(normal.seconds, last_second)) * 1'000'000'000u +
         static_cast<McapTime>(normal.nanoseconds);
}

rr::OrderedJson recorded_schema(const rr::MemberDefinition& member, const rr::TypeRegistry& types) {
  const auto named = rr::named_type_schemas(types);
  rr::OrderedJson out{{"type", "object"}, {"properties", rr::OrderedJson::object()}};
  auto& properties = out["properties"];
  if (member.kind == rr::MemberKind::event)
    for (const auto& parameter : member.parameters)
      properties[parameter.name] = flat_schema(rr::type_schema(parameter.type), named, 0);
  else
    properties["value"] = flat_schema(rr::type_schema(member.type), named, 0);
  if (!member.documentation.empty()) out["description"] = member.documentation;
  return out;
}

rr::Result<RecordingWriter> RecordingWriter::create(const std::string& path, RecordingOptions options) {
  auto writer = McapWriter::create(path, options.library);
  if (!writer) return writer.error();
  return RecordingWriter(path, std::move(options), std::move(*writer));
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
  return writer_.add_metadata(recorded_service_name, texts);
}

rr::Result<std::uint16_t> RecordingWriter::add_member(const RecordedService& service, const std::string& object_path,
                                                      const std::string& place, const rr::MemberDefinition& member,
                                                      const rr::TypeRegistry& types) {
  Channel channel;
  channel.topic = "/" + service.label + "/" + (place.empty() ? "" : place + "/") + member.name;
  const auto& object_type = service.objects.at(object_path);
  channel.schema_name = object_type + "." + member.name;
  channel.schema = rr::write_json(recorded_schema(member, types));
  channel.metadata = {{"service", service.label},
                      {"object", object_path},
                      {"object_type", object_type},
                      {"member", member.name},
                      {"kind", std::string(rr::member_kind_name(member.kind))}};
  if (member.kind != rr::MemberKind::event) channel.metadata["type"] = rr::format_type(member.type);
  if (auto put = put_channel(channel); !put) return put.error();
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
  if (options_.max_bytes != 0 && writer_.size() >= options_.max_bytes)
    if (auto begun = begin_next_file(); !begun) return begun;
  const auto text = rr::write_json(message);
  newest_ = std::max(newest_, to_mcap_time(now));  // the clock may be set back
  McapMessage out{channel, channels_.at(channel).sequence, newest_, newest_, rr::as_bytes(text)};
  if (sent) out.publish_time = to_mcap_time(*sent);
  auto written = writer_.write(out);
  if (written) ++channels_[channel].sequence;
  return written;
}

/// Files of an earlier recording stay, unless they were to be replaced.
std::string RecordingWriter::next_path() {
  for (;;) {
    auto path = numbered_path(first_path_, ++file_number_);
    std::error_code error;
    if (options_.replaces || !std::filesystem::exists(path, error)) return path;
  }
}

/// Each file stands for itself: services and channels are told again, under the same numbers.
rr::Result<> RecordingWriter::begin_next_file() {
  if (auto closed = writer_.close(); !closed) return closed;
  finished_messages_ += writer_.message_count();
  finished_bytes_ += writer_.size();
  paths_.push_back(next_path());
  auto next = McapWriter::create(paths_.back(), options_.library);
  if (!next) return next.error();
  writer_ = std::move(*next);
  schemas_.clear();
  for (const auto& service : services_)
    if (auto added = writer_.add_metadata(recorded_service_name, service); !added) return added;
  for (const auto& channel : channels_)
    if (auto put = put_channel(channel); !put) return put;
  while (options_.kept_files != 0 && paths_.size() > options_.kept_files) {
    std::error_code error;  // whoever removed it was faster
    std::filesystem::remove(paths_.front(), error);
    paths_.erase(paths_.begin());
  }
  return {};
}

}  // namespace rrgate
