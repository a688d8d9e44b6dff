#include "server/http/endpoints/recordings.hpp"

#include <algorithm>
#include <fstream>

#include "core/session/service/service_index.hpp"
#include "server/access/standing.hpp"
#include "server/http/endpoints/gateway_request.hpp"
#include "server/http/response_writer.hpp"
#include "server/recordings/recordings.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

namespace {

using Json = rr::OrderedJson;

constexpr std::size_t most_members = 64;
constexpr std::size_t longest_pattern = 256;
constexpr std::string_view stop_suffix = "/stop";

Json described(const RecordingInfo& recording) {
  const auto seconds = [](auto duration) {
    return static_cast<double>(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count()) / 1000;
  };
  Json out;
  out["name"] = recording.name;
  out["device"] = recording.device;
  out["service"] = recording.service;
  out["state"] = std::string(to_string(recording.state));
  out["standing"] = recording.is_standing;
  out["problem"] = recording.problem.empty() ? Json() : Json(recording.problem);
  out["begin"] = seconds(recording.begin.time_since_epoch());
  out["seconds"] = std::max(0.0, seconds(recording.end - recording.begin));
  out["messages"] = recording.messages ? Json(*recording.messages) : Json();
  out["bytes"] = recording.bytes();
  auto& files = out["files"] = Json::array();
  for (const auto& file : recording.files) files.push_back({{"name", file.name}, {"bytes", file.bytes}});
  return out;
}

Response refuse_recorder(GatewayState& gateway, const Request& request, const rr::Error& why) {
  gateway.reject(why);
  return gateway.http_access().refusal(request, why);
}

Response failure_answer(const rr::Error& error) {
  if (error.code == rr::ErrorCode::out_of_system_resource || error.code == rr::ErrorCode::system_resource_error)
    return problem_response(507, error.message);
  return error_answer(error);
}

/// Whole numbers of a body. Errors   invalid_argument.
template <class T>
rr::Result<> read_number(const rr::Json& body, const char* key, std::int64_t least, std::int64_t most, T& into) {
  const auto found = body.find(key);
  if (found == body.end()) return {};
  if (!found->is_number_integer() || *found < least || *found > most)
    return bad_request(std::string(key) + ": expected a whole number from " + std::to_string(least) + " to " +
                       std::to_string(most));
  into = T(found->get<std::int64_t>());
  return {};
}

rr::Result<> read_members(const rr::Json& body, std::vector<std::string>& members) {
  const auto found = body.find("members");
  if (found == body.end()) return {};
  if (!found->is_array() || found->empty() || found->size() > most_members)
    return bad_request("members: expected an array of 1 to " + std::to_string(most_members) + " paths");
  members.clear();
  for (const auto& each : *found) {
    if (!each.is_string() || each.get_ref<const std::string&>().size() > longest_pattern)
      return bad_request("members: expected paths as \"state\" or \"axes/0/*\"");
    members.push_back(each.get<std::string>());
  }
  return {};
}

rr::Result<RecordingWish> read_wish(const rr::Json& body) {
  RecordingWish out;
  constexpr std::int64_t day = 86'400;
  constexpr std::int64_t most_bytes = 1'000'000'000'000;
  const auto device = text_of(body, "device");
  const auto service = text_of(body, "service");
  for (const auto* text : {&device, &service})
    if (!*text) return text->error();
  out.device = *device;
  out.service = *service;
  std::chrono::seconds duration{0};
  for (const auto& read :
       {read_members(body, out.members), read_number(body, "interval_ms", 10, day * 1000, out.interval),
        read_number(body, "seconds", 1, 365 * day, duration),
        read_number(body, "max_file_bytes", 100'000, most_bytes, out.max_file_bytes),
        read_number(body, "kept_files", 1, 1'000'000, out.kept_files)})
    if (!read) return read.error();
  out.duration = duration;
  if (out.device.empty()) return bad_request("device is missing; expected the name of one");
  return out;
}

/// Where the device has one service, it is meant by no name. Empty: it has none or several.
std::string only_service(const Device& device) {
  std::string out;
  if (const auto& identity = device.identity())
    for (const auto& service : identity->services) {
      if (service.name == rr::service_index_name) continue;
      if (!out.empty()) return {};
      out = service.name;
    }
  return out;
}

Response begin_recording(GatewayState& gateway, const Request& request) {
  const auto body = body_of(request);
  if (!body) return error_answer(body.error());
  auto wish = read_wish(*body);
  if (!wish) return error_answer(wish.error());
  const auto* device = gateway.devices().find(wish->device);
  if (device && wish->service.empty()) wish->service = only_service(*device);
  const AccessRequest wanted{.device = wish->device, .service = wish->service, .verb = Verb::record};
  const auto entry = gateway.access().check_and_begin(request.identity, wanted, {}, "recording_begun");
  if (!entry) return refuse_recorder(gateway, request, entry.error());
  rr::Result<std::string> begun = device && wish->service.empty()
                                      ? bad_request("service is missing, and the device has none, or several")
                                      : gateway.recordings().begin(*wish);
  if (*entry)
    (*entry)->finish(begun ? Outcome::ok : Outcome::error, begun ? std::string_view(*begun) : begun.error().message);
  if (!begun) return failure_answer(begun.error());
  auto response = json_answer(201, described(*gateway.recordings().find(*begun)));
  response.set("Location", request.arrival.prefix + "/api/v1/recordings/" + *begun);
  return response;
}

/// A recording that the asker may have. Else   what to answer.
struct Found {
  std::optional<RecordingInfo> recording;
  AuditEntryPtr entry;
  Response refusal;
};

/// `event`  of the record; empty: none is made.
Found find_recording(GatewayState& gateway, const Request& request, std::string_view name, std::string_view event) {
  Found out;
  // Who may not record the device is not told whether there is a recording.
  const auto said = parse_recording_name(name);
  const auto wanted = said ? wanted_of(*said) : AccessRequest{.verb = Verb::record};
  if (const auto allowed = gateway.access().check(request.identity, wanted); !allowed) {
    out.refusal = refuse_recorder(gateway, request, allowed.error());
    return out;
  }
  out.recording = gateway.recordings().find(name);
  if (!out.recording)
    out.refusal = problem_response(404, "no recording " + rr::quote(name) + "; /api/v1/recordings lists them");
  else if (!event.empty())
    out.entry = gateway.access().begin(request.identity, wanted, {}, event);
  return out;
}

Response answer_recorded(const Found& found, const rr::Result<>& done, Response response) {
  if (found.entry)
    found.entry->finish(done ? Outcome::ok : Outcome::error,
                        done ? std::string_view(found.recording->name) : done.error().message);
  return done ? std::move(response) : failure_answer(done.error());
}

rr::awaitable<void> send_file(ResponseWriter& writer, std::string path, std::string name) {
  constexpr std::size_t part_bytes = 64u * 1024;
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    const auto response = problem_response(404, "the file has gone");
    co_await writer.send(response);
    co_return;
  }
  Response head;
  head.set("Content-Type", "application/octet-stream").set("Cache-Control", "no-store");
  head.set("Content-Disposition", "attachment; filename=\"" + name + "\"");
  if (co_await writer.begin(head) || !writer.has_body()) co_return;
  std::string part(part_bytes, '\0');
  for (;;) {
    file.read(part.data(), static_cast<std::streamsize>(part.size()));
    const std::string_view got(part.data(), static_cast<std::size_t>(file.gcount()));
    if (got.empty()) break;
    const auto failed = co_await writer.write(got);
    if (failed) co_return;
  }
  co_await writer.end();
}

Response download(GatewayState& gateway, const Request& request, std::string_view file, const std::string& name) {
  auto found = find_recording(gateway, request, name, "recording_downloaded");
  if (!found.recording) return std::move(found.refusal);
  const auto& files = found.recording->files;
  const auto it = std::find_if(files.begin(), files.end(), [&](const auto& each) { return each.name == file; });
  if (it == files.end()) return problem_response(404, "the recording has no file " + rr::quote(file));
  Response response;
  const auto standing = std::make_shared<Standing>(gateway.access(), request.identity);
  const auto recording = std::make_shared<const RecordingInfo>(*found.recording);
  response.answer_later = [path = gateway.recordings().path_of(*it), name = it->name, standing,
                           recording](ResponseWriter& writer) {
    writer.go_on_while(
        [standing, recording] { return standing->check(wanted_of(*recording), Recorded::never).has_value(); });
    return send_file(writer, path, name);
  };
  return answer_recorded(found, {}, std::move(response));
}

}  // namespace

Handler recordings_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    const auto& limits = gateway.config().recordings;
    const auto& rules = gateway.access().state().rules;
    if (!rules.sees_any(request.identity))
      return gateway.http_access().refusal(
          request, rr::make_error(rr::ErrorCode::permission_denied, "you may use nothing here"));
    Json out;
    out["enabled"] = !limits.folder.empty();
    std::uint64_t bytes = 0;
    auto list = Json::array();
    for (const auto& each : gateway.recordings().list()) {
      if (!rules.check(request.identity, wanted_of(each))) continue;
      bytes += each.bytes();
      list.push_back(described(each));
    }
    out["bytes"] = bytes;
    out["max_bytes"] = limits.max_bytes;
    out["recordings"] = std::move(list);
    auto response = json_answer(200, out);
    response.set("Cache-Control", "no-store");
    return response;
  };
}

Handler begin_recording_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) { return begin_recording(gateway, request); };
}

Handler recording_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view rest) {
    if (const auto name = recording_of_file(rest); !name.empty()) return download(gateway, request, rest, name);
    auto found = find_recording(gateway, request, rest, {});
    if (!found.recording) return std::move(found.refusal);
    auto response = json_answer(200, described(*found.recording));
    response.set("Cache-Control", "no-store");
    return response;
  };
}

Handler stop_recording_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view rest) {
    if (!rest.ends_with(stop_suffix)) return problem_response(404, "expected /api/v1/recordings/NAME/stop");
    rest.remove_suffix(stop_suffix.size());
    auto found = find_recording(gateway, request, rest, "recording_stopped");
    if (!found.recording) return std::move(found.refusal);
    const auto done = gateway.recordings().end(rest);
    const auto now = gateway.recordings().find(rest);
    return answer_recorded(found, done, json_answer(200, described(now.value_or(*found.recording))));
  };
}

Handler delete_recording_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view rest) {
    auto found = find_recording(gateway, request, rest, "recording_deleted");
    if (!found.recording) return std::move(found.refusal);
    Response response;
    response.status = 204;
    return answer_recorded(found, gateway.recordings().remove(rest), std::move(response));
  };
}

}  // namespace rrgate
