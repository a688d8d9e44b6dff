#include "server/http/endpoints/recordings.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <optional>

#include "core/session/service/service_index.hpp"
#include "server/access/replay_name.hpp"
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
constexpr std::string_view play_suffix = "/play";

Json described(GatewayState& gateway, const RecordingInfo& recording) {
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
  const auto played = [&gateway](std::string device) {
    return gateway.recordings().replays().is_playing(device) ? Json(std::move(device)) : Json();
  };
  out["replay"] = played(replay_of(recording.name));
  auto& files = out["files"] = Json::array();
  for (const auto& file : recording.files)
    files.push_back({{"name", file.name}, {"bytes", file.bytes}, {"replay", played(replay_of_file(file.name))}});
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

using RecordingsAnswer = rr::awaitable<Response>;

rr::awaitable<void> send_made(std::function<RecordingsAnswer(const Request&)> make, ResponseWriter& writer) {
  const auto response = co_await make(writer.request());
  co_await writer.send(response);
}

/// A response that others do not wait for while it is made.
Response make_later(std::function<RecordingsAnswer(const Request&)> make) {
  Response out;
  out.answer_later = [make = std::move(make)](ResponseWriter& writer) { return send_made(make, writer); };
  return out;
}

RecordingsAnswer begin_recording(GatewayState& gateway, const Request& request) {
  const auto body = body_of(request);
  if (!body) co_return error_answer(body.error());
  auto wish = read_wish(*body);
  if (!wish) co_return error_answer(wish.error());
  const auto* device = gateway.devices().find(wish->device);
  if (device && wish->service.empty()) wish->service = only_service(*device);
  const AccessRequest wanted{.device = wish->device, .service = wish->service, .verb = Verb::record};
  const auto entry = gateway.access().check_and_begin(request.identity, wanted, {}, "recording_begun");
  if (!entry) co_return refuse_recorder(gateway, request, entry.error());
  rr::Result<std::string> begun = bad_request("service is missing, and the device has none, or several");
  if (!device || !wish->service.empty()) begun = co_await gateway.recordings().begin(*wish);
  if (*entry)
    (*entry)->finish(begun ? Outcome::ok : Outcome::error, begun ? std::string_view(*begun) : begun.error().message);
  if (!begun) co_return failure_answer(begun.error());
  const auto recording = co_await gateway.recordings().find(*begun);
  if (!recording) co_return failure_answer(rr::make_error(rr::ErrorCode::resource_not_found, "it was deleted already"));
  auto response = json_answer(201, described(gateway, *recording));
  response.set("Location", request.arrival.prefix + "/api/v1/recordings/" + *begun);
  co_return response;
}

Response refuse_finder(GatewayState& gateway, const Request& request, const rr::Error& why) {
  if (why.code != rr::ErrorCode::resource_not_found) return refuse_recorder(gateway, request, why);
  return problem_response(404, why.message + "; /api/v1/recordings lists them");
}

/// What is done with a recording goes into the record. `event`  a literal.
AuditEntryPtr begin_entry(GatewayState& gateway, const Request& request, const RecordingInfo& recording,
                          std::string_view event) {
  return gateway.access().begin(request.identity, wanted_of(recording), {}, event);
}

void finish_entry(const AuditEntryPtr& entry, std::string_view name, const rr::Result<>& done) {
  if (entry) entry->finish(done ? Outcome::ok : Outcome::error, done ? name : done.error().message);
}

Response answer_recorded(const AuditEntryPtr& entry, std::string_view name, const rr::Result<>& done,
                         Response response) {
  finish_entry(entry, name, done);
  return done ? std::move(response) : failure_answer(done.error());
}

RecordingsAnswer look_at_recording(GatewayState& gateway, const Request& request, std::string name) {
  const auto found = co_await gateway.recordings().find_for(gateway.access(), request.identity, name);
  if (!found) co_return refuse_finder(gateway, request, found.error());
  auto response = json_answer(200, described(gateway, *found));
  response.set("Cache-Control", "no-store");
  co_return response;
}

RecordingsAnswer stop_recording(GatewayState& gateway, const Request& request, std::string name) {
  const auto found = co_await gateway.recordings().find_for(gateway.access(), request.identity, name);
  if (!found) co_return refuse_finder(gateway, request, found.error());
  const auto entry = begin_entry(gateway, request, *found, "recording_stopped");
  const auto done = gateway.recordings().end(name);
  const auto now = co_await gateway.recordings().find(name);
  co_return answer_recorded(entry, name, done, json_answer(200, described(gateway, now.value_or(*found))));
}

RecordingsAnswer delete_recording(GatewayState& gateway, const Request& request, std::string name) {
  const auto found = co_await gateway.recordings().find_for(gateway.access(), request.identity, name);
  if (!found) co_return refuse_finder(gateway, request, found.error());
  const auto entry = begin_entry(gateway, request, *found, "recording_deleted");
  const auto done = co_await gateway.recordings().remove(name);
  Response response;
  response.status = 204;
  co_return answer_recorded(entry, name, done, std::move(response));
}

/// What a path names: a recording, or one of its files.
struct RecordingPlace {
  std::string name;
  std::string file;  ///< empty: the recording
};

RecordingPlace place_of(std::string_view text) {
  auto name = recording_of_file(text);
  if (name.empty()) return {std::string(text), {}};
  return {std::move(name), std::string(text)};
}

/// Null: it has no such file.
const RecordingFile* find_file(const RecordingInfo& recording, std::string_view file) {
  const auto found = std::find_if(recording.files.begin(), recording.files.end(),
                                  [file](const auto& each) { return each.name == file; });
  return found == recording.files.end() ? nullptr : &*found;
}

Response no_such_file(const std::string& file) {
  return problem_response(404, "the recording has no file" + (file.empty() ? file : " " + rr::quote(file)));
}

/// Those that are played, as far as somebody may end them.
std::string names_of_replays(GatewayState& gateway, const Identity& who) {
  std::string out;
  std::size_t others = 0;
  for (const auto& device : gateway.recordings().replays().list()) {
    if (gateway.access().state().rules.check(who, to_record(*played_by(device))))
      out += (out.empty() ? "" : ", ") + device;
    else
      ++others;
  }
  if (others == 0) return out;
  return out + (out.empty() ? "" : " and ") + std::to_string(others) + " of others";
}

/// `why`  see Replays::play().
Response refuse_to_play(GatewayState& gateway, const rr::Error& why) {
  switch (why.code) {
    case rr::ErrorCode::data_serialization_error:  // the file's fault, not that of who asks
    case rr::ErrorCode::member_busy:
    case rr::ErrorCode::operation_cancelled:
      return problem_response(409, why.message);
    case rr::ErrorCode::out_of_system_resource: {
      gateway.reject(Rejection::memory);
      auto response = problem_response(503, why.message);
      response.set("Retry-After", "60");
      return response;
    }
    default:
      return error_answer(why);
  }
}

RecordingsAnswer play_recording(GatewayState& gateway, const Request& request, RecordingPlace place) {
  auto& recordings = gateway.recordings();
  const auto found = co_await recordings.find_for(gateway.access(), request.identity, place.name);
  if (!found) co_return refuse_finder(gateway, request, found.error());
  std::vector<std::string> files;
  for (const auto& file : found->files)
    if (place.file.empty() || file.name == place.file) files.push_back(file.name);
  if (files.empty()) co_return no_such_file(place.file);
  const auto device = place.file.empty() ? replay_of(place.name) : replay_of_file(place.file);
  const bool is_new = !recordings.replays().is_playing(device);
  const auto entry = begin_entry(gateway, request, *found, "recording_played");
  auto begun = co_await recordings.replays().play(device, gateway.config().recordings.folder, std::move(files));
  const auto why = begun ? rr::Error{} : begun.error();
  if (why.code == rr::ErrorCode::invalid_state)
    begun = rr::make_error(why.code, why.message + ": " + names_of_replays(gateway, request.identity));
  finish_entry(entry, found->name, begun);
  if (!begun) co_return refuse_to_play(gateway, begun.error());
  auto response = json_answer(is_new ? 201 : 200, Json{{"device", device}});
  response.set("Location", request.arrival.prefix + "/api/v1/devices/" + device);
  co_return response;
}

RecordingsAnswer end_playing(GatewayState& gateway, const Request& request, RecordingPlace place) {
  const auto found = co_await gateway.recordings().find_for(gateway.access(), request.identity, place.name);
  if (!found) co_return refuse_finder(gateway, request, found.error());
  if (!place.file.empty() && !find_file(*found, place.file)) co_return no_such_file(place.file);
  const auto entry = begin_entry(gateway, request, *found, "recording_play_ended");
  if (place.file.empty())
    gateway.recordings().replays().end_all_of(place.name);
  else
    gateway.recordings().replays().end(replay_of_file(place.file));
  const rr::Result<> done;
  Response response;
  response.status = 204;
  co_return answer_recorded(entry, found->name, done, std::move(response));
}

RecordingsAnswer list_recordings(GatewayState& gateway, const Request& request) {
  const auto& limits = gateway.config().recordings;
  Json out;
  out["enabled"] = !limits.folder.empty();
  std::uint64_t bytes = 0;
  auto list = Json::array();
  const auto recordings = co_await gateway.recordings().list(gateway.access().state_ptr(), request.identity);
  for (const auto& each : recordings) {
    bytes += each.bytes();
    list.push_back(described(gateway, each));
  }
  out["bytes"] = bytes;
  out["max_bytes"] = limits.max_bytes;
  out["recordings"] = std::move(list);
  auto response = json_answer(200, out);
  response.set("Cache-Control", "no-store");
  co_return response;
}

// --- files ---

/// Read on the workers: whoever waits for a disk keeps nobody else waiting.
class Download {
 public:
  explicit Download(std::string path) : path_(std::move(path)) {}

  bool open() {
    file_.open(path_, std::ios::binary);
    return file_.is_open();
  }
  /// nullopt: it can't be read. Empty: that was all.
  std::optional<std::string_view> read() {
    file_.read(part_.data(), static_cast<std::streamsize>(part_.size()));
    if (file_.bad()) return std::nullopt;
    return std::string_view(part_.data(), static_cast<std::size_t>(file_.gcount()));
  }

 private:
  std::string path_;
  std::ifstream file_;
  std::string part_ = std::string(256u * 1024, '\0');
};

rr::awaitable<void> send_file(GatewayState& gateway, ResponseWriter& writer, std::string path, std::string name) {
  Download download(std::move(path));
  const auto open = [&download] { return download.open(); };
  if (!co_await gateway.workers().run(open)) {
    const auto response = problem_response(404, "the file has gone");
    co_await writer.send(response);
    co_return;
  }
  Response head;
  head.set("Content-Type", "application/octet-stream").set("Cache-Control", "no-store");
  head.set("Content-Disposition", "attachment; filename=\"" + name + "\"");
  if (co_await writer.begin(head) || !writer.has_body()) co_return;
  const auto read = [&download] { return download.read(); };
  for (;;) {
    const auto part = co_await gateway.workers().run(read);
    if (!part) co_return writer.break_off();
    if (part->empty()) break;
    const auto failed = co_await writer.write(*part);
    if (failed) co_return;
  }
  co_await writer.end();
}

rr::awaitable<void> send_download(GatewayState& gateway, ResponseWriter& writer, std::string name, std::string file) {
  const auto& request = writer.request();
  auto found = co_await gateway.recordings().find_for(gateway.access(), request.identity, name);
  const auto* wanted = found ? find_file(*found, file) : nullptr;
  if (!wanted) {
    const auto refusal = found ? no_such_file(file) : refuse_finder(gateway, request, found.error());
    co_await writer.send(refusal);
    co_return;
  }
  if (const auto entry = begin_entry(gateway, request, *found, "recording_downloaded"))
    entry->finish(Outcome::ok, found->name);
  const auto standing = std::make_shared<Standing>(gateway.access(), request.identity);
  auto path = gateway.recordings().path_of(*wanted);
  const auto recording = std::make_shared<const RecordingInfo>(std::move(*found));
  writer.go_on_while(
      [standing, recording] { return standing->check(wanted_of(*recording), Recorded::never).has_value(); });
  co_await send_file(gateway, writer, std::move(path), std::move(file));
}

}  // namespace

Handler recordings_endpoint(GatewayState& gateway) {
  return [&gateway](const Request& request, std::string_view) {
    if (!gateway.access().state().rules.sees_any(request.identity))
      return gateway.http_access().refusal(
          request, rr::make_error(rr::ErrorCode::permission_denied, "you may use nothing here"));
    return make_later([&gateway](const Request& asked) { return list_recordings(gateway, asked); });
  };
}

Handler begin_recording_endpoint(GatewayState& gateway) {
  return [&gateway](const Request&, std::string_view) {
    return make_later([&gateway](const Request& request) { return begin_recording(gateway, request); });
  };
}

Handler recording_endpoint(GatewayState& gateway) {
  return [&gateway](const Request&, std::string_view rest) {
    const auto name = recording_of_file(rest);
    if (name.empty())
      return make_later([&gateway, rest = std::string(rest)](const Request& request) {
        return look_at_recording(gateway, request, rest);
      });
    Response response;
    response.answer_later = [&gateway, name, file = std::string(rest)](ResponseWriter& writer) {
      return send_download(gateway, writer, name, file);
    };
    return response;
  };
}

Handler recording_action_endpoint(GatewayState& gateway) {
  return [&gateway](const Request&, std::string_view rest) {
    if (rest.ends_with(play_suffix)) {
      rest.remove_suffix(play_suffix.size());
      return make_later([&gateway, place = place_of(rest)](const Request& request) {
        return play_recording(gateway, request, place);
      });
    }
    if (!rest.ends_with(stop_suffix))
      return problem_response(404, "expected /api/v1/recordings/NAME/stop or /api/v1/recordings/NAME/play");
    rest.remove_suffix(stop_suffix.size());
    return make_later([&gateway, name = std::string(rest)](const Request& request) {
      return stop_recording(gateway, request, name);
    });
  };
}

Handler delete_recording_endpoint(GatewayState& gateway) {
  return [&gateway](const Request&, std::string_view rest) {
    if (rest.ends_with(play_suffix)) {
      rest.remove_suffix(play_suffix.size());
      return make_later(
          [&gateway, place = place_of(rest)](const Request& request) { return end_playing(gateway, request, place); });
    }
    return make_later([&gateway, name = std::string(rest)](const Request& request) {
      return delete_recording(gateway, request, name);
    });
  };
}

}  // namespace rrgate
