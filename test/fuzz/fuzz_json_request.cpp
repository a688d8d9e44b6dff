// What clients say on a JSON WebSocket (rrgate.json.v1): frames to messages, messages to requests, requests to values
// of members; and every answer is JSON that names its request. The device is left out: members answer at once.
//
// Input: the first byte chooses frames, in pieces of that many bytes, or with 't' one message as it is.
#include <cstdio>
#include <cstdlib>

#include "node/transport/websocket_messages.hpp"
#include "server/http/endpoints/refusal.hpp"
#include "server/http/split_path.hpp"
#include "server/json/arguments.hpp"
#include "server/socket/json_request.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rrgate;

constexpr std::size_t max_message = 16 * 1024;

constexpr const char* definition = R"(service test.fuzz
stdver 0.10
enum mode
  off = 0,
  on = 1
end
pod point
  field int16 id
  field single value
end
struct pose
  field double[3] p
  field string label
  field varvalue extra
end
object Thing
  property double number
  property string{int32} names
  property pose here
  property mode how
  function pose move(pose to, double[] by, mode how)
  function int32 add(int32 left, int32 right)
  function double{generator} scale(double factor, double{generator} values)
  wire point[] points
  pipe varvalue packets
  callback int32 ask(string question)
  event changed(double value, string why)
  memory double[*] grid
end
)";

void require(bool holds, const char* rule, const std::string& detail) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s: %s\n", rule, detail.c_str());
  std::abort();
}

const rr::TypeRegistry& types() {
  static const auto registry = [] {
    rr::TypeRegistry out;
    const auto added = out.add({definition}, rr::RobdefMode::strict);
    require(added.has_value(), "the definition is one", added ? "" : added.error().message);
    return out;
  }();
  return registry;
}

const rr::MemberDefinition& find_member(const JsonRequest& request) {
  const auto segments = value_or_throw(split_path(request.text("path", "")));
  const auto* member =
      segments.empty() ? nullptr : types().find_entity("test.fuzz.Thing")->find_member(segments.back());
  if (!member) refuse(rr::ErrorCode::member_not_found, "no member");
  return *member;
}

rr::OrderedJson written(const rr::Value& value, const rr::TypeDefinition& type, const rr::JsonForm& form) {
  auto json = rr::value_to_json(value, type, types(), form);
  require(json.has_value(), "what was read is written", json ? "" : json.error().message);
  return std::move(*json);
}

/// As the operations read their requests: what was read is the result.
rr::OrderedJson perform(const JsonRequest& request, const rr::JsonForm& form) {
  const auto operation = request.text("op", "");
  if (operation == "set" || operation == "send" || operation == "write" || operation == "next") {
    const auto& member = find_member(request);
    if (operation == "write") static_cast<void>(request.numbers("offset", 3));
    const auto& type = operation == "next" && !member.parameters.empty() ? member.parameters.back().type : member.type;
    return written(value_or_throw(rr::value_from_json(request.at("value"), type, types(), form, member.name)), type,
                   form);
  }
  if (operation == "call" || operation == "open") {
    const auto& member = find_member(request);
    static const auto none = rr::Json::object();
    const auto* given = request.find("args");
    const auto arguments = value_or_throw(rr::arguments_from_json(given ? *given : none, member, types(), form));
    auto told = rr::arguments_to_json(arguments, member, types(), form);
    require(told.has_value(), "arguments that were read are written", told ? "" : told.error().message);
    return std::move(*told);
  }
  if (operation == "read") {
    const auto offset = request.numbers("offset", 2);
    const auto count = request.numbers("count", 2);
    require(!offset || offset->size() == 2, "a number a dimension", "offset");
    return count ? rr::OrderedJson(*count) : rr::OrderedJson();
  }
  if (operation == "close" || operation == "unsubscribe")
    return request.at(operation == "close" ? "generator" : "subscription").dump();
  if (operation == "lock") return request.text("kind", "client");
  refuse(rr::ErrorCode::invalid_argument, "no operation \"op\": " + rr::quote(operation));
}

void check_told(const std::string& text, const std::string& id, const char* what) {
  const auto told = rr::read_json(text);
  require(told.has_value(), "what is told is JSON", text);
  require(told->is_object() && told->contains("id") && (*told)["id"].dump() == id, "it names the request", text);
  require(told->contains(what), "it is an answer", text);
}

void take(const std::string& message) {
  const auto request = JsonRequest::from_text(message);
  if (!request) {
    require(!request.error().message.empty(), "an error says what", message);
    check_told(json_refusal("null", request.error()), "null", "error");
    return;
  }
  rr::JsonForm form;
  form.packs_arrays = message.size() & 1;
  form.numbers_enums = message.size() & 2;
  form.ignores_unknown = message.size() & 4;
  try {
    check_told(json_answer(request->id(), perform(*request, form)), request->id(), "result");
  } catch (const rr::Exception& exception) {
    check_told(json_refusal(request->id(), exception.error()), request->id(), "error");
  }
}

void take_frames(rr::ByteSpan bytes, std::size_t piece) {
  rr::WebSocketMessageDecoder decoder(max_message);
  while (!bytes.empty()) {
    auto part = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(part.size());
    while (!part.empty()) {
      const auto taken = decoder.feed(part);
      if (!taken) {
        require(decoder.close_code() >= 1000 && decoder.close_code() < 1016, "a violation has a code", "");
        return;
      }
      require(*taken <= part.size(), "no more is taken than was given", "");
      part = part.subspan(*taken);
      if (const auto message = decoder.take_message()) {
        require(message->size() <= max_message, "messages have a bound", "");
        take(*message);
      }
      static_cast<void>(decoder.take_ping());
      if (decoder.received_close()) return;
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size < 2) return 0;
  const rr::ByteSpan rest(data + 1, size - 1);
  if (data[0] == 't')
    take(std::string(rr::as_text(rest)));
  else
    take_frames(rest, 1 + std::size_t{data[0]});
  return 0;
}
