#include "server/recordings/recordings.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <filesystem>
#include <unordered_map>

#include "server/access/replay_name.hpp"
#include "server/config/version.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using SystemClock = std::chrono::system_clock;
using std::chrono::steady_clock;

constexpr std::chrono::seconds look_period{1};
constexpr std::chrono::seconds standing_period{60};
constexpr std::size_t most_ended = 100;  ///< recordings that are remembered with what they came to

rr::Error no_such_recording(std::string_view name) {
  return rr::make_error(rr::ErrorCode::resource_not_found, "no recording " + rr::quote(name));
}

rr::Error folder_is_full(std::uint64_t max_bytes) {
  return rr::make_error(rr::ErrorCode::out_of_system_resource,
                        "recordings have taken all that they may, " + std::to_string(max_bytes) + " bytes");
}

rr::Error no_room_for_clients(std::uint64_t room, std::uint64_t max_bytes) {
  if (room == max_bytes) return folder_is_full(max_bytes);
  return rr::make_error(rr::ErrorCode::out_of_system_resource,
                        "recordings have taken all that they may, " + std::to_string(room) + " bytes; " +
                            std::to_string(max_bytes - room) + " more are for those that the configuration wants");
}

}  // namespace

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

  bool is_of_client() const { return writer && !info.is_standing; }
};

/// What was in the folder.
struct Recordings::Folder {
  RecordingFiles files;
  std::unordered_map<std::string, std::uint64_t> sizes;  ///< of all files, by name
  std::uint64_t bytes = 0;

  explicit Folder(RecordingFiles found) : files(std::move(found)) {
    for (const auto& [name, list] : files)
      for (const auto& file : list) {
        sizes[file.name] = file.bytes;
        bytes += file.bytes;
      }
  }
  std::uint64_t bytes_of(std::string_view recording) const {
    const auto found = files.find(recording);
    std::uint64_t out = 0;
    if (found != files.end())
      for (const auto& file : found->second) out += file.bytes;
    return out;
  }
  /// Of a file, by its path; 0: it was not there.
  std::uint64_t bytes_at(const std::string& path) const {
    const auto found = sizes.find(fs::path(path).filename().string());
    return found == sizes.end() ? 0 : found->second;
  }
  /// A file is about to go.
  void forget(const std::string& path) { bytes -= std::min(bytes, bytes_at(path)); }
};

Recordings::Recordings(const asio::any_io_executor& executor, const Config& config, DeviceRegistry& devices,
                       ValueClients& clients, Workers& workers, MemoryBudget::Charge memory)
    : executor_(executor),
      config_(config),
      devices_(devices),
      clients_(clients),
      workers_(workers),
      replays_(executor, devices, std::move(memory)),
      timer_(executor) {}

Recordings::~Recordings() {
  stop();
}

// --- what is under way ---

void Recordings::follow_config() {
  const auto& wishes = config_.recordings.standing;
  for (auto& [name, run] : runs_) {
    if (!run->writer) continue;
    const bool is_wanted = std::find(wishes.begin(), wishes.end(), run->wish) != wishes.end();
    if (run->folder != config_.recordings.folder || (run->info.is_standing && !is_wanted))
      end_run(*run, std::nullopt);
    else if (auto why = why_device_is_gone(*run))
      end_run(*run, std::move(why));
  }
  replays_.keep_folder(config_.recordings.folder);
  next_standing_ = steady_clock::now();
  timer_.cancel();
  wake();
}

bool Recordings::has_work() const {
  const auto is_under_way = [](const auto& each) { return each.second->writer != nullptr; };
  return !is_stopped_ &&
         (!config_.recordings.standing.empty() || std::any_of(runs_.begin(), runs_.end(), is_under_way));
}

void Recordings::wake() {
  if (is_looked_after_ || !has_work()) return;
  is_looked_after_ = true;
  asio::co_spawn(executor_, look_after(this, life_), asio::detached);
}

rr::awaitable<Recordings::Folder> Recordings::look(Workers& workers, std::string folder, std::string recording) {
  const auto work = [&folder, &recording] { return Folder(look_into(folder, recording)); };
  co_return co_await workers.run(work);
}

/// Whoever waits here may find that `self` has gone.
rr::awaitable<void> Recordings::look_after(Recordings* self, std::weak_ptr<int> life) {
  while (!life.expired() && self->has_work()) {
    auto folder = co_await look(self->workers_, self->config_.recordings.folder);
    if (life.expired()) co_return;
    if (self->is_stopped_) break;
    self->tick(folder);
    if (steady_clock::now() >= self->next_standing_) {
      self->next_standing_ = steady_clock::now() + standing_period;
      const auto missing = self->missing_standing();
      std::set<std::string> under_way;
      for (const auto& [name, run] : self->runs_)
        if (run->writer) under_way.insert(name);
      const auto limits = self->config_.recordings;
      const auto work = [&missing, &under_way, &limits] {
        std::vector<Paths> rings;
        rings.reserve(missing.size());
        for (const auto& wish : missing) rings.push_back(find_ring(limits.folder, wish, limits.standing, under_way));
        return rings;
      };
      auto rings = co_await self->workers_.run(work);
      if (life.expired()) co_return;
      if (self->is_stopped_) break;
      const bool is_same_folder = limits.folder == self->config_.recordings.folder;
      if (is_same_folder) self->begin_standing(missing, std::move(rings), folder);
    }
    self->timer_.expires_after(steady_clock::now() < self->next_standing_ ? look_period : std::chrono::seconds(0));
    co_await self->timer_.async_wait(asio::as_tuple(asio::use_awaitable));
  }
  if (!life.expired()) self->is_looked_after_ = false;
}

std::vector<RecordingWish> Recordings::missing_standing() const {
  std::vector<RecordingWish> out;
  for (const auto& wish : config_.recordings.standing) {
    const auto is_it = [&](const auto& each) {
      return each.second->writer && each.second->info.is_standing && each.second->wish == wish;
    };
    if (std::none_of(runs_.begin(), runs_.end(), is_it)) out.push_back(wish);
  }
  return out;
}

void Recordings::begin_standing(const std::vector<RecordingWish>& missing, std::vector<Paths> rings, Folder& folder) {
  std::string problem;
  const auto& wanted = config_.recordings.standing;
  for (std::size_t i = 0; i < missing.size(); ++i) {
    const auto& wish = missing[i];
    if (std::find(wanted.begin(), wanted.end(), wish) == wanted.end()) continue;  // not any more
    forget_failed(wish);
    auto& ring = rings[i];
    for (std::error_code error; !ring.empty() && folder.bytes >= config_.recordings.max_bytes; ring.pop_front()) {
      folder.forget(ring.front());
      fs::remove(ring.front(), error);
    }
    auto begun = folder.bytes < config_.recordings.max_bytes ? begin_run(wish, &ring)
                                                             : folder_is_full(config_.recordings.max_bytes);
    if (!begun) problem += (problem.empty() ? "" : "; ") + wish.device + ": " + begun.error().message;
  }
  if (std::exchange(standing_problem_, problem) != problem && !problem.empty())
    log(LogLevel::error, "recordings can't begin", {{"error", problem}});
}

void Recordings::forget_failed(const RecordingWish& wish) {
  std::erase_if(runs_, [&](const auto& each) {
    const auto& run = *each.second;
    return !run.writer && run.wish == wish && run.info.messages == 0;
  });
}

void Recordings::forget_oldest() {
  while (static_cast<std::size_t>(std::count_if(runs_.begin(), runs_.end(),
                                                [](const auto& each) { return !each.second->writer; })) > most_ended) {
    auto oldest = runs_.end();
    for (auto it = runs_.begin(); it != runs_.end(); ++it)
      if (!it->second->writer && (oldest == runs_.end() || it->second->info.begin < oldest->second->info.begin))
        oldest = it;
    runs_.erase(oldest);
  }
}

std::size_t Recordings::count_of_clients() const {
  return static_cast<std::size_t>(
      std::count_if(runs_.begin(), runs_.end(), [](const auto& each) { return each.second->is_of_client(); }));
}

rr::awaitable<rr::Result<std::string>> Recordings::begin(RecordingWish wish) {
  const auto folder = co_await look(workers_, config_.recordings.folder);
  const auto& limits = config_.recordings;
  if (is_stopped_) co_return rr::make_error(rr::ErrorCode::operation_cancelled, "the gateway stops");
  if (count_of_clients() >= limits.at_once)
    co_return rr::make_error(rr::ErrorCode::out_of_system_resource,
                             "there are " + std::to_string(limits.at_once) + " recordings under way already");
  const auto room = room_for_clients(folder);
  if (!limits.folder.empty() && folder.bytes >= room) co_return no_room_for_clients(room, limits.max_bytes);
  auto begun = begin_run(wish, nullptr);
  wake();
  co_return begun;
}

rr::Result<std::string> Recordings::begin_run(const RecordingWish& wish, Paths* ring) {
  if (const auto possible = check_wish(wish); !possible) return possible.error();
  auto run = std::make_unique<Run>();
  run->wish = wish;
  run->folder = config_.recordings.folder;
  run->info.device = wish.device;
  run->info.service = wish.service;
  run->info.is_standing = ring != nullptr;
  if (const auto opened = open_file(*run, ring); !opened) return opened.error();
  const RecorderOptions options{wish.members, wish.interval};
  run->recorder = std::make_shared<DeviceRecorder>(devices_.find(wish.device)->shared_from_this(), wish.service,
                                                   clients_, *run->writer, options, listen_to(*run));
  const auto name = run->info.name;
  log(LogLevel::info, "recording begins", {{"recording", name}});
  forget_oldest();
  auto& kept = *(runs_[name] = std::move(run));
  kept.recorder->start();
  return name;
}

rr::Result<> Recordings::check_wish(const RecordingWish& wish) const {
  if (config_.recordings.folder.empty())
    return rr::make_error(rr::ErrorCode::invalid_state, "the gateway has no \"recordings\" in its configuration");
  if (!devices_.find(wish.device))
    return rr::make_error(rr::ErrorCode::resource_not_found, "no device " + rr::quote(wish.device));
  if (is_replay(wish.device))
    return rr::make_error(rr::ErrorCode::invalid_state, rr::quote(wish.device) + " plays a recording already");
  const auto is_name_char = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  if (wish.service.empty() || !std::all_of(wish.service.begin(), wish.service.end(), is_name_char))
    return rr::make_error(rr::ErrorCode::invalid_argument, rr::quote(wish.service) + " is no name of a service");
  return {};
}

rr::Result<> Recordings::open_file(Run& run, Paths* ring) {
  std::error_code error;
  fs::create_directories(run.folder, error);  // creating the file says what is wrong
  fs::path path;
  auto time = SystemClock::now();
  do {  // files that are there stay
    run.info.name = format_recording_name({run.info.device, run.info.service, time});
    run.info.begin = time;
    path = fs::path(run.folder) / first_file_of(run.info.name);
    time += std::chrono::milliseconds(1);
  } while (runs_.contains(run.info.name) || fs::exists(path, error));
  RecordingOptions how;
  how.max_bytes = run.wish.max_file_bytes;
  how.kept_files = static_cast<std::uint32_t>(run.wish.kept_files);
  how.library = "rrgate " + std::string(version);
  if (ring) {
    how.ring = ring_of(run.wish);
    how.former = std::move(*ring);
  }
  auto writer = RecordingWriter::create(path.string(), std::move(how));
  if (!writer) return writer.error();
  run.writer = std::make_unique<RecordingWriter>(std::move(*writer));
  return {};
}

RecordListener Recordings::listen_to(Run& run) {
  // Not within a call of the recorder's own: that would end it.
  const auto fail_later = [this, life = std::weak_ptr(life_), name = run.info.name](const rr::Error& failure) {
    asio::post(executor_, [this, life, name, failure] {
      if (!life.expired()) fail(name, failure);
    });
  };
  RecordListener listener;
  listener.begun = [&run, fail_later](const rr::Result<>& outcome) {
    if (!outcome) return fail_later(outcome.error());
    if (run.wish.duration.count() > 0) run.over = steady_clock::now() + run.wish.duration;
  };
  listener.problem = [&run](const std::string& problem) {
    run.info.problem = problem;
    log(LogLevel::warning, "recording has a problem", {{"recording", run.info.name}, {"problem", problem}});
  };
  listener.solved = [&run](const std::string& left) { run.info.problem = left; };
  listener.failed = fail_later;
  return listener;
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
  // Of a ring, an empty one would take the place of one that holds something.
  const bool is_of_ring = run.info.is_standing && !ring_of(run.wish).empty();
  if ((failure || is_of_ring) && run.info.messages == 0) fs::remove(path, ignored);
  run.info.state = failure ? RecordingState::failed : RecordingState::ended;
  if (failure) {
    run.info.problem = failure->message;
    log(LogLevel::error, "recording failed", {{"recording", run.info.name}, {"error", failure->message}});
    return;
  }
  log(LogLevel::info, "recording ended", {{"recording", run.info.name}, {"messages", *run.info.messages}});
}

std::uint64_t Recordings::room_for_clients(const Folder& folder) const {
  const std::uint64_t most = config_.recordings.max_bytes;
  const auto tenth = most / 10;
  std::uint64_t reserved = 0;
  for (const auto& [name, run] : runs_) {
    if (!run->writer || !run->info.is_standing) continue;
    if (run->wish.kept_files == 0) {  // what it will take is not known
      reserved += tenth;
      continue;
    }
    auto taken = folder.bytes_at(run->writer->path());
    for (const auto& path : run->writer->kept()) taken += folder.bytes_at(path);
    const auto wanted = static_cast<std::uint64_t>(run->wish.kept_files) * run->wish.max_file_bytes;
    reserved += wanted - std::min(wanted, taken);
  }
  return most - std::min(reserved, most - tenth);
}

void Recordings::make_room(Folder& folder, std::uint64_t limit, bool is_standing) {
  for (auto& [name, run] : runs_) {
    if (!run->writer || run->info.is_standing != is_standing) continue;
    while (folder.bytes >= limit && !run->writer->kept().empty()) {
      folder.forget(run->writer->kept().front());
      run->writer->drop_oldest();
    }
  }
}

/// Clients' recordings leave room to those of the configuration, and the largest of them leaves some to the others.
std::optional<rr::Error> Recordings::end_of(const Run& run, const Folder& folder, std::uint64_t room) const {
  const auto& limits = config_.recordings;
  if (run.info.is_standing && folder.bytes >= limits.max_bytes) return folder_is_full(limits.max_bytes);
  if (run.is_of_client()) {
    if (folder.bytes >= room) return no_room_for_clients(room, limits.max_bytes);
    const auto clients = count_of_clients();
    const auto taken = folder.bytes_of(run.info.name);
    if (clients > 1 && folder.bytes >= room - room / 10 && taken > room / clients)
      return rr::make_error(rr::ErrorCode::out_of_system_resource,
                            "the recording has " + std::to_string(taken) + " bytes of the " + std::to_string(room) +
                                " that " + std::to_string(clients) +
                                " recordings of clients share: the others need the rest");
  }
  return why_device_is_gone(run);
}

std::optional<rr::Error> Recordings::why_device_is_gone(const Run& run) const {
  if (devices_.has(run.recorder->device())) return std::nullopt;
  const bool is_changed = devices_.find(run.info.device) != nullptr;
  return rr::make_error(rr::ErrorCode::resource_not_found,
                        is_changed ? "the device was changed in the configuration" : "the device has left the gateway");
}

/// What waits for its chunk reaches the file, so that a gateway that is killed loses a second at most.
void Recordings::tick(Folder& folder) {
  const auto room = room_for_clients(folder);
  make_room(folder, room, false);
  make_room(folder, config_.recordings.max_bytes, true);
  const auto now = steady_clock::now();
  for (auto& [name, run] : runs_) {
    if (!run->writer) continue;
    if (const auto flushed = run->writer->flush(); !flushed)
      end_run(*run, flushed.error());
    else if (auto why = end_of(*run, folder, room))
      end_run(*run, std::move(why));
    else if (run->over && now >= *run->over)
      end_run(*run, std::nullopt);
  }
}

void Recordings::stop() {
  is_stopped_ = true;
  replays_.stop();
  timer_.cancel();
  for (auto& [name, run] : runs_)
    if (run->writer) end_run(*run, std::nullopt);
}

rr::Result<> Recordings::end(std::string_view name) {
  const auto found = runs_.find(name);
  if (found == runs_.end() || !found->second->writer) return {};
  if (found->second->info.is_standing)
    return rr::make_error(rr::ErrorCode::invalid_state, "the configuration wants this recording");
  end_run(*found->second, std::nullopt);
  return {};
}

rr::awaitable<rr::Result<>> Recordings::remove(std::string name) {
  const auto folder = co_await look(workers_, config_.recordings.folder, name);
  const auto info = info_of(name, folder);
  if (!info) co_return no_such_recording(name);
  if (const auto run = runs_.find(name); run != runs_.end()) {
    if (run->second->writer)
      co_return rr::make_error(rr::ErrorCode::invalid_state, "the recording is under way; stop it first");
    runs_.erase(run);
  }
  replays_.end_all_of(name);
  const auto work = [files = info->files, where = config_.recordings.folder]() -> rr::Result<> {
    for (const auto& file : files) {
      std::error_code error;
      fs::remove(fs::path(where) / file.name, error);
      if (error)
        return rr::make_error(rr::ErrorCode::system_resource_error, "delete " + file.name + ": " + error.message());
    }
    return {};
  };
  co_return co_await workers_.run(work);
}

// --- what there is ---

std::string Recordings::path_of(const RecordingFile& file) const {
  return (fs::path(config_.recordings.folder) / file.name).string();
}

std::optional<RecordingInfo> Recordings::info_of(const std::string& name, const Folder& folder) const {
  const auto files = folder.files.find(name);
  const auto run = runs_.find(name);
  RecordingInfo out;
  if (run != runs_.end()) {
    out = run->second->info;
  } else {
    auto said = files == folder.files.end() ? std::nullopt : parse_recording_name(name);
    if (!said) return std::nullopt;
    out.name = name;
    out.device = std::move(said->device);
    out.service = std::move(said->service);
    out.begin = out.end = said->begin;
  }
  if (files != folder.files.end()) out.files = files->second;
  if (run == runs_.end())
    for (const auto& file : out.files) out.end = std::max(out.end, file.written);
  if (run == runs_.end() || !run->second->writer) return out;
  out.state = run->second->recorder->is_following() ? RecordingState::recording : RecordingState::waiting;
  out.end = SystemClock::now();
  out.messages = run->second->writer->message_count();
  return out;
}

rr::awaitable<std::vector<RecordingInfo>> Recordings::list(AccessStatePtr rights, Identity who) {
  std::vector<RecordingInfo> out;
  if (!rights->rules.gives_any(who, Verb::record)) co_return out;
  const auto folder = co_await look(workers_, config_.recordings.folder);
  std::set<std::string> names;
  for (const auto& [name, files] : folder.files) names.insert(name);
  for (const auto& [name, run] : runs_) names.insert(name);
  for (const auto& name : names)
    if (auto info = info_of(name, folder); info && rights->rules.check(who, wanted_of(*info)))
      out.push_back(std::move(*info));
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.begin > b.begin; });
  co_return out;
}

rr::awaitable<std::optional<RecordingInfo>> Recordings::find(std::string name) {
  const auto folder = co_await look(workers_, config_.recordings.folder, name);
  co_return info_of(name, folder);
}

rr::awaitable<rr::Result<RecordingInfo>> Recordings::find_for(Access& access, Identity who, std::string name) {
  AccessRequest wanted{.verb = Verb::record};
  const auto said = parse_recording_name(name);
  if (said) {
    wanted.device = said->device;
    wanted.service = said->service;
  }
  if (const auto allowed = access.check(who, wanted); !allowed) co_return allowed.error();
  if (!said) co_return no_such_recording(name);
  auto found = co_await find(name);
  if (!found) co_return no_such_recording(name);
  co_return std::move(*found);
}

}  // namespace rrgate
