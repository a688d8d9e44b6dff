#include "server/recordings/replays.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "server/log/log.hpp"
#include "server/record/replay.hpp"
#include "server/recordings/recording_files.hpp"

namespace rrgate {

namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

constexpr std::chrono::seconds file_look_period{1};
/// For clients to hear that their services end.
constexpr std::chrono::milliseconds last_words{500};

rr::Error replay_ended() {
  return rr::make_error(rr::ErrorCode::operation_cancelled, "the recording is not to be played any more");
}

}  // namespace

/// One recording. Its thread has `io` and what runs there; all else is the gateway's.
struct Replays::Run {
  Run(const asio::any_io_executor& executor, MemoryBudget::Charge charge)
      : file_watch(io), known(executor, asio::steady_timer::time_point::max()), memory(std::move(charge)) {}

  std::string name;  ///< of the device
  std::string folder;
  std::vector<std::string> files;
  std::size_t max_memory = 0;
  std::stop_source unwanted;  ///< for what opens it
  asio::io_context io{1};
  asio::steady_timer file_watch;
  std::thread thread;
  asio::steady_timer known;              ///< cancelled when there is an outcome
  std::optional<rr::Result<>> outcome;   ///< of opening it
  std::shared_ptr<const Device> device;  ///< null: not yet
  MemoryBudget::Charge memory;

  /// Its thread ends soon, whatever it does.
  void give_up() {
    unwanted.request_stop();
    io.stop();
  }

  rr::Result<std::unique_ptr<Replay>> open(std::size_t& bytes);
  void play(Replay& replay);
  void watch_files();
};

// --- on the thread of one ---

rr::Result<std::unique_ptr<Replay>> Replays::Run::open(std::size_t& bytes) {
  ReplayOptions how;
  how.listen = "rr+intra:///";
  how.report = [device = name](const std::string& problem) {
    log(LogLevel::warning, "recording is played with gaps", {{"device", device}, {"error", problem}});
  };
  try {
    auto recording = Recording::open(files, unwanted.get_token(), folder, max_memory);
    if (!recording) return recording.error();
    if (!recording->cut().empty()) how.report(recording->cut());
    bytes = recording->memory();
    files = recording->files();
    return std::make_unique<Replay>(io, std::move(*recording), std::move(how));
  } catch (const std::exception& problem) {
    return rr::make_error(rr::ErrorCode::data_serialization_error, problem.what());
  }
}

void Replays::Run::play(Replay& replay) {
  try {
    replay.player().play();
    watch_files();
    io.run();  // until it is stopped
    file_watch.cancel();
    replay.stop();
    io.restart();
    io.run_for(last_words);
  } catch (const std::exception& failure) {  // out of memory, or a mistake of ours: this recording only
    log(LogLevel::error, "recording can't be played", {{"device", name}, {"error", failure.what()}});
  }
}

void Replays::Run::watch_files() {
  for (const auto& file : files) {
    std::error_code error;
    if (!fs::exists(fs::path(folder) / file, error)) return io.stop();
  }
  file_watch.expires_after(file_look_period);
  file_watch.async_wait([this](const auto& cancelled) {
    if (!cancelled) watch_files();
  });
}

// --- on the gateway's ---

Replays::Replays(const asio::any_io_executor& executor, DeviceRegistry& devices, MemoryBudget::Charge memory)
    : executor_(executor), devices_(devices), memory_(std::move(memory)) {}

Replays::~Replays() {
  for (const auto& [name, run] : runs_) ending_.push_back(run);
  for (const auto& run : ending_) run->give_up();
  for (const auto& run : ending_) run->thread.join();
}

rr::Result<> Replays::begin(Run& run) {
  const auto tell = [this, life = std::weak_ptr(life_)](auto news) {
    asio::post(executor_, [life, news = std::move(news)] {
      if (!life.expired()) news();
    });
  };
  const auto work = [this, &run, tell] {
    std::size_t bytes = 0;
    auto replay = run.open(bytes);
    const auto url = replay ? rr::parse_url((*replay)->urls().front()) : rr::Result<rr::ConnectionUrl>(replay.error());
    tell([this, &run, url, bytes] { note_opened(run, url, bytes); });
    if (replay) run.play(**replay);
    if (replay) replay->reset();  // before its io_context
    tell([this, &run] { note_end(run); });
  };
  try {
    run.thread = std::thread(work);
  } catch (const std::exception& failure) {
    return rr::make_error(rr::ErrorCode::system_resource_error,
                          "there is no thread to play " + run.files.front() + ": " + failure.what());
  }
  return {};
}

rr::awaitable<rr::Result<>> Replays::play(std::string device, std::string folder, std::vector<std::string> files) {
  auto found = runs_.find(device);
  if (found == runs_.end()) {
    if (is_stopped_) co_return replay_ended();
    if (runs_.size() >= most)
      co_return rr::make_error(rr::ErrorCode::invalid_state,
                               "as many recordings are played as may be (" + std::to_string(most) + ")");
    if (ending_.size() >= most)
      co_return rr::make_error(rr::ErrorCode::member_busy,
                               "as many recordings as may be played (" + std::to_string(most) + ") are still ending");
    const auto run = std::make_shared<Run>(executor_, memory_.sibling());
    run->name = device;
    run->folder = folder;
    run->files = std::move(files);
    run->max_memory = run->memory.room();  // charged once it is known
    found = runs_.emplace(device, run).first;
    if (const auto begun = begin(*run); !begun) {
      runs_.erase(found);
      co_return begun.error();
    }
  }
  const auto run = found->second;
  while (!run->outcome) co_await run->known.async_wait(asio::as_tuple(asio::use_awaitable));
  co_return *run->outcome;
}

void Replays::note_opened(Run& run, rr::Result<rr::ConnectionUrl> url, std::size_t bytes) {
  const auto found = runs_.find(run.name);
  if (found == runs_.end() || found->second.get() != &run) return;  // ended meanwhile
  if (url && !run.memory.resize(bytes))
    url = rr::make_error(rr::ErrorCode::out_of_system_resource,
                         run.files.front() + ": the recording takes " + std::to_string(bytes) + " bytes");
  if (!url && url.error().code == rr::ErrorCode::out_of_system_resource) {
    if (bytes == 0) (void)run.memory.has_room(run.max_memory + 1);  // counts it
    url = rr::make_error(rr::ErrorCode::out_of_system_resource,
                         "the gateway has no memory left to play " + url.error().message);
  }
  if (!url) {
    log(LogLevel::warning, "recording can't be played",
        {{"device", run.name}, {"folder", run.folder}, {"error", url.error().message}});
    return end(found, url.error());
  }
  DeviceConfig config;
  config.name = run.name;
  config.url = std::move(*url);
  config.mode = DeviceMode::shared;
  run.device = devices_.add(std::move(config), nullptr).shared_from_this();
  run.outcome = rr::Result<>();
  run.known.cancel();
  log(LogLevel::info, "recording is played", {{"device", run.name}});
}

void Replays::end(std::string_view device) {
  if (const auto found = runs_.find(device); found != runs_.end()) end(found, replay_ended());
}

void Replays::end_all_of(std::string_view recording) {
  for (auto at = runs_.begin(); at != runs_.end();) {
    const auto next = std::next(at);
    if (recording_of_replay(at->first) == recording) end(at, replay_ended());
    at = next;
  }
}

/// `why`  for those who wait for it to begin.
void Replays::end(Runs::iterator at, const rr::Error& why) {
  const auto run = at->second;
  runs_.erase(at);
  ending_.push_back(run);
  run->give_up();
  if (!run->outcome) run->outcome = why;
  run->known.cancel();
  if (!run->device) return;
  log(LogLevel::info, "recording is played no more", {{"device", run->name}});
  if (!is_stopped_) devices_.remove(*run->device);  // else all devices go
}

void Replays::note_end(Run& run) {
  const auto is_it = [&run](const RunPtr& each) { return each.get() == &run; };
  const auto playing = runs_.find(run.name);
  if (playing != runs_.end() && is_it(playing->second)) end(playing, replay_ended());  // its file has gone
  const auto ending = std::find_if(ending_.begin(), ending_.end(), is_it);
  run.thread.join();
  ending_.erase(ending);
}

bool Replays::is_playing(std::string_view device) const {
  const auto found = runs_.find(device);
  return found != runs_.end() && found->second->device;
}

std::vector<std::string> Replays::list() const {
  std::vector<std::string> out;
  for (const auto& [name, run] : runs_) out.push_back(name);
  return out;
}

void Replays::keep_folder(const std::string& folder) {
  for (auto at = runs_.begin(); at != runs_.end();) {
    const auto next = std::next(at);
    if (at->second->folder != folder) end(at, replay_ended());
    at = next;
  }
}

void Replays::stop() {
  is_stopped_ = true;
  keep_folder({});
}

}  // namespace rrgate
