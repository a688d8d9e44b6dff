#include "test/core/session/replay/transcript.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "core/robdef/robdef.hpp"
#include "core/wire/codec.hpp"
#include "core/wire/frame_scanner.hpp"
#include "test/core/wire/message_tree.hpp"
#include "test/support/format_message.hpp"
#include "test/support/golden.hpp"

namespace rr::test {

namespace {

constexpr std::size_t any_length = 1u << 20;

std::string text_of(const Message& message) {
  return format_message(message, {any_length, any_length, any_length});
}

const MessageElement* find_element(const Message& message, std::string_view name) {
  for (const auto& element : message.elements)
    if (element.name == name) return &element;
  return nullptr;
}

std::vector<std::uint32_t> capability_words(const Step& step) {
  const auto* element = find_element(*step.message, "capabilities");
  if (!element) throw std::runtime_error("no capabilities: " + step.text);
  std::vector<std::uint32_t> words(element->count);
  std::memcpy(words.data(), element->data.data(), element->data.size());
  return words;
}

void wipe(Message& message, MessageElement& element) {
  element.data = message.store(ByteSpan(Bytes(element.data.size())));
}

void wipe_what_is_free(Message& message) {
  auto& header = message.header;
  header.message_id = header.message_res_id = 0;
  header.sender_node_id = header.receiver_node_id = {};
  header.sender_node_name = header.receiver_node_name = {};
  for (auto& element : message.elements) {
    if (element.name == "packettime")
      for (auto i = static_cast<std::size_t>(&element - message.elements.data()) + 1; i < element.end; ++i)
        wipe(message, message.elements[i]);
    const bool is_void = element.type == DataType::void_t || element.type == DataType::int32_t;
    if (element.name == "return" && is_void && message.elements.size() == 1 &&
        (message.entries.front().type == EntryType::function_call_res ||
         message.entries.front().type == EntryType::generator_next_res)) {
      element.type = DataType::void_t;
      element.count = 0;
      element.data = {};
    }
  }
}

template <class Key>
void exchange(const std::map<Key, Key>& names, Key& value) {
  if (const auto found = names.find(value); found != names.end()) value = found->second;
}

template <class Key>
bool is_exchanged(const std::map<Key, Key>& names, Key value) {
  const auto before = value;
  exchange(names, value);
  return value != before;
}

template <class Key>
std::map<Key, Key> reverse(const std::map<Key, Key>& names) {
  std::map<Key, Key> reversed;
  for (const auto& [from, to] : names) reversed[to] = from;
  return reversed;
}

/// Entries whose element `index` is a generator's.
bool names_generator(EntryType type) {
  return type == EntryType::generator_next_req || type == EntryType::function_call_res;
}

}  // namespace

Features Transcript::client_features() const {
  return negotiate(capability_words(steps.at(0)), Features{}).value();
}

Features Transcript::service_features() const {
  return negotiate(capability_words(steps.at(1)), Features{}).value();
}

std::uint32_t Transcript::endpoint(int connection, bool of_client) const {
  for (const auto& step : steps)
    if (step.connection == connection && step.is_clients == of_client && step.message->header.sender_endpoint != 0)
      return step.message->header.sender_endpoint;
  return 0;
}

Transcript read_transcript(const std::string& name) {
  const auto json = read_golden_json("transcripts/" + name + ".json");
  Transcript transcript;
  transcript.name = name;
  std::map<std::pair<int, bool>, FrameScanner> streams;
  for (const auto& from : json["steps"]) {
    if (!from.contains("hex") || from.contains("http")) continue;
    const auto bytes = from_hex(from.value("payload_hex", from["hex"].get<std::string>()));
    const bool is_clients = from["dir"] == "c>s";
    const int connection = from.value("conn", 1);
    auto& stream = streams[{connection, is_clients}];
    for (ByteSpan input = bytes; !input.empty();) {
      input = input.subspan(stream.feed(input).value());
      if (!stream.message()) continue;
      Step step;
      step.is_clients = is_clients;
      step.connection = connection;
      step.time = std::chrono::microseconds(static_cast<std::int64_t>(from.value("t", 0.0) * 1e6));
      step.bytes.assign(stream.message()->begin(), stream.message()->end());
      transcript.steps.push_back(std::move(step));
    }
  }
  DecodeOptions options;
  for (auto& step : transcript.steps) {
    step.message = std::make_unique<Message>();
    decode(step.bytes, options, *step.message).value();
    step.text = text_of(*step.message);
    if (&step == &transcript.steps[1] && find_element(*step.message, "capabilities"))
      options.string_table = transcript.service_features().string_table;
  }
  return transcript;
}

std::vector<std::string> transcript_names() {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(golden_path("transcripts")))
    if (file.path().extension() == ".json") names.push_back(file.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string transcript_definition() {
  const auto text = read_golden("transcripts/experimental.transcript.robdef");
  return format_service_definition(parse_service_definition(text, RobdefMode::strict).definition);
}

std::string Transcript::base_url() const {
  for (const auto& step : steps)
    for (const auto& element : step.message->elements)
      if (element.type == DataType::string_t && element.text().starts_with("rr+"))
        return std::string(element.text().substr(0, element.text().find('?')));
  return {};
}

std::chrono::milliseconds Transcript::service_heartbeat_period() const {
  if (name.ends_with("keepalive")) return std::chrono::hours(1);
  return name.ends_with("heartbeat-server") || name.ends_with("lock-monitor") ? std::chrono::seconds(2)
                                                                              : std::chrono::seconds(10);
}

std::chrono::milliseconds Transcript::client_heartbeat_period() const {
  if (name.ends_with("keepalive")) return std::chrono::hours(1);
  return name.ends_with("heartbeat-client") ? std::chrono::seconds(1) : std::chrono::seconds(10);
}

bool Transcript::has_service(std::string_view service) const {
  bool was_index_asked = false;
  for (const auto& step : steps)
    for (const auto& element : step.message->elements)
      if (element.name == "Name" && element.type == DataType::string_t) {
        was_index_asked = true;
        if (element.text() == service) return true;
      }
  return !was_index_asked;
}

Renaming Renaming::reversed() const {
  return {reverse(endpoints), reverse(requests), reverse(generators)};
}

bool Renaming::concerns(const Message& message) const {
  return is_exchanged(endpoints, message.header.sender_endpoint) ||
         is_exchanged(endpoints, message.header.receiver_endpoint) ||
         std::any_of(message.entries.begin(), message.entries.end(), [this](const auto& entry) {
           return is_exchanged(requests, entry.request_id) || (names_generator(entry.type) && !generators.empty());
         });
}

void Renaming::apply(Message& message) const {
  exchange(endpoints, message.header.sender_endpoint);
  exchange(endpoints, message.header.receiver_endpoint);
  for (auto& entry : message.entries) exchange(requests, entry.request_id);
  for (const auto& entry : message.entries) {
    if (!names_generator(entry.type)) continue;
    for (auto i = entry.first_element; i < entry.end_element; ++i) {
      auto& element = message.elements[i];
      if (element.name != "index" || element.type != DataType::int32_t) continue;
      auto index = load<std::int32_t>(element.data.data());
      exchange(generators, index);
      element.data = message.store(ByteSpan(reinterpret_cast<const std::uint8_t*>(&index), sizeof(index)));
    }
  }
}

void wipe_error_texts(Message& message) {
  for (auto& element : message.elements) {
    if (element.name != "errorstring") continue;
    element.data = {};
    element.count = 0;
  }
}

std::string compare(Message& found, Message& expected) {
  wipe_what_is_free(found);
  wipe_what_is_free(expected);
  const auto difference = compare_messages(found, expected);
  return difference.empty() ? difference
                            : difference + "\n  found    " + text_of(found) + "\n  expected " + text_of(expected);
}

}  // namespace rr::test
