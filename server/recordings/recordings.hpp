// The recordings that a gateway makes of its devices: which there are, which are under way, what they may take.
// Layer: server/recordings. See docs/recording.md.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/access_rules.hpp"
#include "server/config/config.hpp"
#include "server/recordings/device_recorder.hpp"

namespace rrgate {

struct RecordingFile {
  std::string name;
  std::uint64_t bytes = 0;
  std::chrono::system_clock::time_point written;  ///< last
};

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
  std::string problem;       ///< the newest; of one that failed, why
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

/// What the name of a recording says; nullopt: it is none.
std::optional<RecordingInfo> parse_recording_name(std::string_view name);
/// The recording that a file of this name is of; empty: of none.
std::string recording_of_file(std::string_view file);

/// For the gateway's thread. Files are written on it: a folder on a disk that answers slowly slows the gateway.
class Recordings {
 public:
  /// All outlive it.
  Recordings(const boost::asio::any_io_executor& executor, const Config& config, DeviceRegistry& devices,
             ValueClients& clients);
  ~Recordings();

  /// Begins what the configuration wants; again when that has changed.
  void follow_config();
  /// Completes all files.
  void stop();

  /// Returns its name. Errors   invalid_state: the configuration has no folder; resource_not_found: no such device;
  /// out_of_system_resource: too many, or the folder is full; system_resource_error: the file, and what the system
  /// says.
  rr::Result<std::string> begin(const RecordingWish& wish);
  /// The one that is ended already stays as it is. Errors   resource_not_found; invalid_state: the configuration wants
  /// it.
  rr::Result<> end(std::string_view name);
  /// Its files too. Errors   as end(), but invalid_state: it is under way.
  rr::Result<> remove(std::string_view name);

  /// The newest first.
  std::vector<RecordingInfo> list() const;
  /// nullopt: there is none.
  std::optional<RecordingInfo> find(std::string_view name) const;
  /// Where a file is that a recording has.
  std::string path_of(const RecordingFile& file) const;

 private:
  struct Run;
  /// What all files in the folder take.
  std::uint64_t used_bytes() const;
  rr::Result<std::string> begin_run(const RecordingWish& wish, bool is_standing);
  void begin_standing();
  /// Those that have ended are told of by their files alone, where they are many.
  void forget_ended(const RecordingWish* failed);
  void end_run(Run& run, std::optional<rr::Error> failure);
  void fail(const std::string& name, const rr::Error& error);
  void tick();
  void wait();

  boost::asio::any_io_executor executor_;
  const Config& config_;
  DeviceRegistry& devices_;
  ValueClients& clients_;
  std::map<std::string, std::unique_ptr<Run>, std::less<>> runs_;  ///< since the gateway started
  boost::asio::steady_timer timer_;
  std::chrono::steady_clock::time_point next_standing_{};  ///< when those that are not under way are begun again
  std::string standing_problem_;                           ///< told
  bool is_waiting_ = false;
  bool is_stopped_ = false;
  std::shared_ptr<int> life_ = std::make_shared<int>(0);  ///< for what is posted
};

}  // namespace rrgate
