#include "server/recordings/recordings.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <filesystem>

#include "node/platform/utc_time.hpp"
#include "server/config/version.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using SystemClock = std::chrono::system_clock;
using std::chrono::steady_clock;

constexpr std::string_view extension = ".mcap";
constexpr std::chrono::seconds standing_period{60};
constexpr std::size_t most_ended = 100;  ///< recordings that are remembered with what they came to

/// "20261125T083000123Z"
std::string name_of_time(SystemClock::time_point time) {
  auto text = rr::format_utc(rr::to_time_spec(time), 3);
  std::erase_if(text, [](char c) { return c == '-' || c == ':' || c == '.'; });
  return text;
}

/// The other way; nullopt: it is no such text.
std::optional<SystemClock::time_point> time_of_name(std::string_view text) {
  constexpr std::string_view form = "00000000T000000000Z";
  if (text.size() != form.size()) return std::nullopt;
  for (std::size_t i = 0; i < form.size(); ++i)
    if (form[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != form[i]) return std::nullopt;
  const auto number = [text](std::size_t at, std::size_t size) {
    int out = 0;
    for (const char c : text.substr(at, size)) out = out * 10 + (c - '0');
    return out;
  };
  const std::chrono::year_month_day date{std::chrono::year(number(0, 4)),
                                         std::chrono::month(static_cast<unsigned>(number(4, 2))),
                                         std::chrono::day(static_cast<unsigned>(number(6, 2)))};
  if (!date.ok()) return std::nullopt;
  return std::chrono::sys_days(date) + std::chrono::hours(number(9, 2)) + std::chrono::minutes(number(11, 2)) +
         std::chrono::seconds(number(13, 2)) + std::chrono::milliseconds(number(15, 3));
}

}  // namespace

std::optional<RecordingInfo> parse_recording_name(std::string_view name) {
  const auto last = name.rfind('.');
  if (last == std::string_view::npos) return std::nullopt;
  const auto begin = time_of_name(name.substr(last + 1));
  const auto middle = name.substr(0, last).rfind('.');
  if (!begin || middle == std::string_view::npos || middle == 0 || middle + 1 == last) return std::nullopt;
  RecordingInfo out;
  out.name = name;
  out.device = name.substr(0, middle);
  out.service = name.substr(middle + 1, last - middle - 1);
  out.begin = out.end = *begin;
  return out;
}

namespace {

/// "NAME.mcap" is the first file, "NAME-2.mcap" the second. 0: it is none of these.
std::uint32_t number_of_file(std::string_view file, std::string& name) {
  if (!file.ends_with(extension)) return 0;
  file.remove_suffix(extension.size());
  name = file;
  if (parse_recording_name(name)) return 1;
  const auto dash = file.rfind('-');
  if (dash == std::string_view::npos) return 0;
  name = file.substr(0, dash);
  std::uint32_t number = 0;
  for (const char c : file.substr(dash + 1)) {
    if (c < '0' || c > '9' || number > 100'000'000) return 0;
    number = number * 10 + static_cast<std::uint32_t>(c - '0');
  }
  return number;
}

struct FoundFile {
  std::uint32_t number = 0;
  RecordingFile file;
};

/// All recordings of a folder, by their names.
std::map<std::string, std::vector<FoundFile>, std::less<>> look_into(const std::string& folder) {
  std::map<std::string, std::vector<FoundFile>, std::less<>> out;
  std::error_code error;
  if (folder.empty()) return out;
  for (auto it = fs::directory_iterator(folder, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    FoundFile found;
    found.file.name = it->path().filename().string();
    std::string name;
    found.number = number_of_file(found.file.name, name);
    std::error_code of_file;
    if (found.number == 0 || !parse_recording_name(name) || !it->is_regular_file(of_file) || it->is_symlink(of_file))
      continue;
    found.file.bytes = it->file_size(of_file);
    if (of_file) continue;
    found.file.written = std::chrono::file_clock::to_sys(it->last_write_time(of_file));
    if (!of_file) out[name].push_back(std::move(found));
  }
  for (auto& [name, files] : out)
    std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  return out;
}

rr::Error no_such_recording(std::string_view name) {
  return rr::make_error(rr::ErrorCode::resource_not_found, "no recording " + rr::quote(name));
}

}  // namespace

std::string recording_of_file(std::string_view file) {
  std::string name;
  return number_of_file(file, name) > 0 && parse_recording_name(name) ? name : std::string();
}

std::string_view to_string(RecordingState state) {
  constexpr std::string_view names[] = {"recording", "waiting", "ended", "failed"};
  return names[static_cast<std::size_t>(state)];
}

std::uint64_t RecordingInfo::bytes() const {
  std::uint64_t out = 0;
  for (const auto& file : files) out += file.bytes;
  return out;
}

/// A recording that was begun since the gateway started.
struct Recordings::Run {
  RecordingInfo info;  ///< without the files
  RecordingWish wish;
  std::string folder;
  std::unique_ptr<RecordingWriter> writer;  ///< null: it has ended
  std::shared_ptr<DeviceRecorder> recorder;
  std::optional<steady_clock::time_point> over;
};

Recordings::Recordings(const asio::any_io_executor& executor, const Config& config, DeviceRegistry& devices,
                       ValueClients& clients)
    : executor_(executor), config_(config), devices_(devices), clients_(clients), timer_(executor) {}

Recordings::~Recordings() {
  stop();
}

// --- what is under way ---

void Recordings::follow_config() {
  const auto& wishes = config_.recordings.standing;
  for (auto& [name, run] : runs_) {
    if (!run->writer) continue;
    const bool is_wanted = std::find(wishes.begin(), wishes.end(), run->wish) != wishes.end();
    if (run->folder != config_.recordings.folder || (run->info.is_standing && !is_wanted)) end_run(*run, std::nullopt);
  }
  begin_standing();
  wait();
}

void Recordings::begin_standing() {
  next_standing_ = steady_clock::now() + standing_period;
  std::string problem;
  for (const auto& wish : config_.recordings.standing) {
    const auto is_it = [&](const auto& each) {
      return each.second->writer && each.second->info.is_standing && each.second->wish == wish;
    };
    if (std::any_of(runs_.begin(), runs_.end(), is_it)) continue;
    forget_ended(&wish);
    if (const auto begun = begin_run(wish, true); !begun)
      problem += (problem.empty() ? "" : "; ") + wish.device + ": " + begun.error().message;
  }
  if (std::exchange(standing_problem_, problem) != problem && !problem.empty())
    log(LogLevel::error, "recordings can't begin", {{"error", problem}});
}

void Recordings::forget_ended(const RecordingWish* failed) {
  std::erase_if(runs_, [&](const auto& each) {
    const auto& run = *each.second;
    return !run.writer && failed && run.wish == *failed && run.info.messages == 0;
  });
  while (static_cast<std::size_t>(std::count_if(runs_.begin(), runs_.end(),
                                                [](const auto& each) { return !each.second->writer; })) > most_ended) {
    auto oldest = runs_.end();
    for (auto it = runs_.begin(); it != runs_.end(); ++it)
      if (!it->second->writer && (oldest == runs_.end() || it->second->info.begin < oldest->second->info.begin))
        oldest = it;
    runs_.erase(oldest);
  }
}

rr::Result<std::string> Recordings::begin(const RecordingWish& wish) {
  const auto is_of_clients = [](const auto& each) { return each.second->writer && !each.second->info.is_standing; };
  if (static_cast<std::size_t>(std::count_if(runs_.begin(), runs_.end(), is_of_clients)) >= config_.recordings.at_once)
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "there are " + std::to_string(config_.recordings.at_once) + " recordings under way already");
  auto begun = begin_run(wish, false);
  wait();
  return begun;
}

rr::Result<std::string> Recordings::begin_run(const RecordingWish& wish, bool is_standing) {
  const auto& limits = config_.recordings;
  if (limits.folder.empty())
    return rr::make_error(rr::ErrorCode::invalid_state, "the gateway has no \"recordings\" in its configuration");
  auto* device = devices_.find(wish.device);
  if (!device) return rr::make_error(rr::ErrorCode::resource_not_found, "no device " + rr::quote(wish.device));
  const auto is_name_char = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  if (wish.service.empty() || !std::all_of(wish.service.begin(), wish.service.end(), is_name_char))
    return rr::make_error(rr::ErrorCode::invalid_argument, rr::quote(wish.service) + " is no name of a service");
  if (used_bytes() >= limits.max_bytes)
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "recordings have taken all that they may, " + std::to_string(limits.max_bytes) + " bytes");
  auto run = std::make_unique<Run>();
  run->wish = wish;
  run->folder = limits.folder;
  run->info.device = wish.device;
  run->info.service = wish.service;
  run->info.is_standing = is_standing;
  std::error_code error;
  fs::create_directories(run->folder, error);  // creating the file says what is wrong
  auto time = SystemClock::now();
  do {  // files that are there stay
    run->info.name = wish.device + "." + wish.service + "." + name_of_time(time);
    run->info.begin = time;
    time += std::chrono::milliseconds(1);
  } while (runs_.contains(run->info.name) ||
           fs::exists(fs::path(run->folder) / (run->info.name + std::string(extension)), error));
  RecordingOptions how;
  how.max_bytes = wish.max_file_bytes;
  how.kept_files = static_cast<std::uint32_t>(wish.kept_files);
  how.library = "rrgate " + std::string(version);
  auto writer =
      RecordingWriter::create((fs::path(run->folder) / (run->info.name + std::string(extension))).string(), how);
  if (!writer) {
    fs::remove(fs::path(run->folder) / (run->info.name + std::string(extension)), error);
    return writer.error();
  }
  run->writer = std::make_unique<RecordingWriter>(std::move(*writer));

  const auto name = run->info.name;
  // Not within a call of the recorder's own: that would end it.
  const auto fail_later = [this, life = std::weak_ptr(life_), name](const rr::Error& failure) {
    asio::post(executor_, [this, life, name, failure] {
      if (!life.expired()) fail(name, failure);
    });
  };
  RecordListener listener;
  listener.begun = [raw = run.get(), fail_later](const rr::Result<>& outcome) {
    if (!outcome) return fail_later(outcome.error());
    if (raw->wish.duration.count() > 0) raw->over = steady_clock::now() + raw->wish.duration;
  };
  listener.problem = [raw = run.get()](const std::string& problem) {
    raw->info.problem = problem;
    log(LogLevel::warning, "recording has a problem", {{"recording", raw->info.name}, {"problem", problem}});
  };
  listener.failed = fail_later;
  const RecorderOptions options{wish.members, wish.interval};
  run->recorder = std::make_shared<DeviceRecorder>(device->shared_from_this(), wish.service, clients_, *run->writer,
                                                   options, std::move(listener));
  log(LogLevel::info, "recording begins", {{"recording", name}});
  forget_ended(nullptr);
  auto& kept = *(runs_[name] = std::move(run));
  kept.recorder->start();
  return name;
}

void Recordings::fail(const std::string& name, const rr::Error& error) {
  if (const auto found = runs_.find(name); found != runs_.end() && found->second->writer)
    end_run(*found->second, error);
}

void Recordings::end_run(Run& run, std::optional<rr::Error> failure) {
  run.recorder->close();
  run.recorder.reset();
  run.info.messages = run.writer->message_count();
  run.info.end = SystemClock::now();
  if (const auto closed = run.writer->close(); !closed && !failure) failure = closed.error();
  const auto path = run.writer->path();
  run.writer.reset();
  std::error_code ignored;  // whoever removed it was faster
  if (failure && run.info.messages == 0) fs::remove(path, ignored);
  run.info.state = failure ? RecordingState::failed : RecordingState::ended;
  if (failure) {
    run.info.problem = failure->message;
    log(LogLevel::error, "recording failed", {{"recording", run.info.name}, {"error", failure->message}});
    return;
  }
  log(LogLevel::info, "recording ended", {{"recording", run.info.name}, {"messages", *run.info.messages}});
}

void Recordings::wait() {
  const auto is_under_way = [](const auto& each) { return each.second->writer != nullptr; };
  const bool has_work = !config_.recordings.standing.empty() || std::any_of(runs_.begin(), runs_.end(), is_under_way);
  if (is_stopped_ || is_waiting_ || !has_work) return;
  is_waiting_ = true;
  timer_.expires_after(std::chrono::seconds(1));
  timer_.async_wait([this, life = std::weak_ptr(life_)](const auto& error) {
    if (life.expired()) return;
    is_waiting_ = false;
    if (error) return;
    tick();
    wait();
  });
}

/// What waits for its chunk reaches the file, so that a gateway that is killed loses a second at most.
void Recordings::tick() {
  const auto now = steady_clock::now();
  const bool is_full = used_bytes() >= config_.recordings.max_bytes;
  for (auto& [name, run] : runs_) {
    if (!run->writer) continue;
    if (const auto flushed = run->writer->flush(); !flushed)
      end_run(*run, flushed.error());
    else if (is_full)
      end_run(*run, rr::make_error(rr::ErrorCode::out_of_system_resource,
                                   "recordings have taken all that they may, " +
                                       std::to_string(config_.recordings.max_bytes) + " bytes"));
    else if (!devices_.has(run->recorder->device()))
      end_run(*run, rr::make_error(rr::ErrorCode::resource_not_found, "the device has left the gateway"));
    else if (run->over && now >= *run->over)
      end_run(*run, std::nullopt);
  }
  if (now >= next_standing_) begin_standing();
}

void Recordings::stop() {
  is_stopped_ = true;
  timer_.cancel();
  for (auto& [name, run] : runs_)
    if (run->writer) end_run(*run, std::nullopt);
}

rr::Result<> Recordings::end(std::string_view name) {
  const auto found = runs_.find(name);
  if (found == runs_.end()) return find(name) ? rr::Result<>() : no_such_recording(name);
  auto& run = *found->second;
  if (!run.writer) return {};
  if (run.info.is_standing)
    return rr::make_error(rr::ErrorCode::invalid_state, "the configuration wants this recording");
  end_run(run, std::nullopt);
  return {};
}

rr::Result<> Recordings::remove(std::string_view name) {
  const auto info = find(name);
  if (!info) return no_such_recording(name);
  if (const auto run = runs_.find(name); run != runs_.end()) {
    if (run->second->writer)
      return rr::make_error(rr::ErrorCode::invalid_state, "the recording is under way; stop it first");
    runs_.erase(run);
  }
  for (const auto& file : info->files) {
    std::error_code error;
    fs::remove(path_of(file), error);
    if (error)
      return rr::make_error(rr::ErrorCode::system_resource_error, "delete " + file.name + ": " + error.message());
  }
  return {};
}

// --- what there is ---

std::string Recordings::path_of(const RecordingFile& file) const {
  return (fs::path(config_.recordings.folder) / file.name).string();
}

std::uint64_t Recordings::used_bytes() const {
  std::uint64_t out = 0;
  for (const auto& [name, files] : look_into(config_.recordings.folder))
    for (const auto& found : files) out += found.file.bytes;
  return out;
}

std::vector<RecordingInfo> Recordings::list() const {
  std::map<std::string, RecordingInfo> found;
  for (auto& [name, files] : look_into(config_.recordings.folder)) {
    auto& info = found[name] = *parse_recording_name(name);
    for (auto& each : files) {
      info.end = std::max(info.end, each.file.written);
      info.files.push_back(std::move(each.file));
    }
  }
  for (const auto& [name, run] : runs_) {
    auto files = std::move(found[name].files);
    auto& info = found[name] = run->info;
    info.files = std::move(files);
    if (!run->writer) continue;
    info.state = run->recorder->is_following() ? RecordingState::recording : RecordingState::waiting;
    info.end = SystemClock::now();
    info.messages = run->writer->message_count();
  }
  std::vector<RecordingInfo> out;
  out.reserve(found.size());
  for (auto& [name, info] : found) out.push_back(std::move(info));
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.begin > b.begin; });
  return out;
}

std::optional<RecordingInfo> Recordings::find(std::string_view name) const {
  for (auto& info : list())
    if (info.name == name) return info;
  return std::nullopt;
}

}  // namespace rrgate
