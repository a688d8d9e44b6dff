// The recordings that a gateway makes of its devices: which there are, which are under way, what they may take.
// Layer: server/recordings. See docs/recording.md.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/access.hpp"
#include "server/config/config.hpp"
#include "server/limits/workers.hpp"
#include "server/recordings/device_recorder.hpp"
#include "server/recordings/recording_files.hpp"
#include "server/recordings/replays.hpp"
#include "server/upstream/device_registry.hpp"

namespace rrgate {

enum class RecordingState : std::uint8_t {
  recording,
  waiting,  ///< for the device
  ended,
  failed,
};
std::string_view to_string(RecordingState state);

struct RecordingInfo {
  std::string name;  ///< "create.Create.20261125T083000123Z"
  std::string device;
  std::string service;
  RecordingState state = RecordingState::ended;
  bool is_standing = false;  ///< the configuration wants it
  std::string problem;       ///< the newest that is not solved; of one that failed, why
  std::chrono::system_clock::time_point begin;
  std::chrono::system_clock::time_point end;  ///< of one under way, now
  std::optional<std::uint64_t> messages;      ///< of one under way, or that has ended since the gateway started
  std::vector<RecordingFile> files;           ///< oldest first

  std::uint64_t bytes() const;
};

/// What is asked for by who wants to make it or to have it; borrows from it.
inline AccessRequest wanted_of(const RecordingInfo& recording) {
  return {.device = recording.device, .service = recording.service, .verb = Verb::record};
}

/// For the gateway's thread. Recordings are written on it: a folder on a disk that answers slowly slows the gateway.
/// Folders are looked into, and files deleted for clients, on other threads.
class Recordings {
 public:
  /// All outlive it, but for `workers`, which may go first. `memory`  of what plays recordings.
  Recordings(const boost::asio::any_io_executor& executor, const Config& config, DeviceRegistry& devices,
             ValueClients& clients, Workers& workers, MemoryBudget::Charge memory);
  ~Recordings();

  /// Begins what the configuration wants, soon; again when that, or a device, has changed.
  void follow_config();
  /// Completes all files, and ends what is played.
  void stop();
  /// Those that are played.
  Replays& replays() { return replays_; }

  /// Returns its name. Errors   invalid_state: the configuration has no folder, or the device plays a recording;
  /// resource_not_found: no such device;
  /// out_of_system_resource: too many, or the folder is full; system_resource_error: the file, and what the system
  /// says.
  rr::awaitable<rr::Result<std::string>> begin(RecordingWish wish);
  /// One that is not under way stays as it is. Errors   invalid_state: the configuration wants it.
  rr::Result<> end(std::string_view name);
  /// Its files too, which are played no more. Errors   resource_not_found; invalid_state: it is under way;
  /// system_resource_error.
  rr::awaitable<rr::Result<>> remove(std::string name);

  /// Those that somebody may have, the newest first.
  rr::awaitable<std::vector<RecordingInfo>> list(AccessStatePtr rights, Identity who);
  /// nullopt: there is none.
  rr::awaitable<std::optional<RecordingInfo>> find(std::string name);
  /// The same for somebody: who may not record the device is not told whether there is a recording.
  /// Errors   those of Access::check(); resource_not_found.
  rr::awaitable<rr::Result<RecordingInfo>> find_for(Access& access, Identity who, std::string name);
  /// Where a file is that a recording has.
  std::string path_of(const RecordingFile& file) const;

 private:
  struct Run;
  struct Folder;
  using Paths = std::deque<std::string>;

  static rr::awaitable<void> look_after(Recordings* self, std::weak_ptr<int> life);
  /// `recording`  whose files are looked for; empty: of all.
  static rr::awaitable<Folder> look(Workers& workers, std::string folder, std::string recording = {});
  bool has_work() const;
  /// Has the folder looked into, and what is under way looked after, as long as there is something.
  void wake();
  /// nullopt: there is none.
  std::optional<RecordingInfo> info_of(const std::string& name, const Folder& folder) const;
  void tick(Folder& folder);
  /// Why a recording has to end; nullopt: it goes on. `room`  see room_for_clients().
  std::optional<rr::Error> end_of(const Run& run, const Folder& folder, std::uint64_t room) const;
  std::optional<rr::Error> why_device_is_gone(const Run& run) const;
  /// What all files may take as far as clients are concerned: the configuration's recordings have room of their own.
  std::uint64_t room_for_clients(const Folder& folder) const;
  std::size_t count_of_clients() const;
  /// The oldest files of rings go, of the configuration's or of clients', until no more than this is taken.
  void make_room(Folder& folder, std::uint64_t limit, bool is_standing);
  /// What the configuration wants and is not under way.
  std::vector<RecordingWish> missing_standing() const;
  /// `rings`  of `missing`, in their order.
  void begin_standing(const std::vector<RecordingWish>& missing, std::vector<Paths> rings, Folder& folder);
  /// `ring`  files that count among those that are kept; null: a client wants it.
  rr::Result<std::string> begin_run(const RecordingWish& wish, Paths* ring);
  /// Whether it can be recorded. Errors   as begin().
  rr::Result<> check_wish(const RecordingWish& wish) const;
  /// Names the recording by the time, and begins its file.
  rr::Result<> open_file(Run& run, Paths* ring);
  /// What a recorder tells of its recording, which outlives it.
  RecordListener listen_to(Run& run);
  /// Of the attempts that have recorded nothing, each minute another one, the newest is told of.
  void forget_failed(const RecordingWish& wish);
  /// Those that have ended are told of by their files alone, where they are many.
  void forget_oldest();
  void end_run(Run& run, std::optional<rr::Error> failure);
  void fail(const std::string& name, const rr::Error& error);

  boost::asio::any_io_executor executor_;
  const Config& config_;
  DeviceRegistry& devices_;
  ValueClients& clients_;
  Workers& workers_;
  Replays replays_;
  std::map<std::string, std::unique_ptr<Run>, std::less<>> runs_;  ///< since the gateway started
  boost::asio::steady_timer timer_;
  std::chrono::steady_clock::time_point next_standing_{};  ///< when those that are not under way are begun again
  std::string standing_problem_;                           ///< told
  bool is_looked_after_ = false;
  bool is_stopped_ = false;
  std::shared_ptr<int> life_ = std::make_shared<int>(0);  ///< for what is posted
};

}  // namespace rrgate
