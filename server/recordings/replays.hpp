// The recordings that a gateway plays: each is a device of it, until it is ended. Layer: server/recordings. See
// docs/recording.md.
#pragma once

#include <list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/limits/memory_budget.hpp"
#include "server/upstream/device_registry.hpp"

namespace rrgate {

/// For the gateway's thread. A recording is read and served on a thread of its own, by a node that the gateway shares
/// as it shares a device. It ends by itself when one of its files has gone.
class Replays {
 public:
  static constexpr std::size_t most = 4;  ///< at a time

  /// `devices`  outlives it. `memory`  see ValueClient.
  Replays(const boost::asio::any_io_executor& executor, DeviceRegistry& devices, MemoryBudget::Charge memory);
  /// Waits for the threads.
  ~Replays();
  Replays(const Replays&) = delete;
  Replays& operator=(const Replays&) = delete;

  /// Returns once the files are a device of that name, as one time line. One that is played already goes on.
  /// Errors   invalid_state: so many are played already; member_busy: so many are still ending; resource_not_found:
  /// there is no such file; data_serialization_error, system_resource_error: a file that can't be played, or no thread;
  /// out_of_system_resource: it takes more memory than is left; operation_cancelled: it was ended before it began. They
  /// name files, and not where they are: clients hear of them.
  rr::awaitable<rr::Result<>> play(std::string device, std::string folder, std::vector<std::string> files);
  /// Of a device that plays a recording. Its clients hear that its services end.
  void end(std::string_view device);
  /// Of a recording, and of its files.
  void end_all_of(std::string_view recording);
  /// Whether it is a device: not while its file is still read.
  bool is_playing(std::string_view device) const;
  /// The devices, and what will be some.
  std::vector<std::string> list() const;
  /// Ends those of other folders.
  void keep_folder(const std::string& folder);
  /// Ends all, and plays nothing more.
  void stop();

 private:
  struct Run;
  using RunPtr = std::shared_ptr<Run>;
  using Runs = std::map<std::string, RunPtr, std::less<>>;

  /// Errors   system_resource_error: there is no thread.
  rr::Result<> begin(Run& run);
  void note_opened(Run& run, rr::Result<rr::ConnectionUrl> url, std::size_t bytes);
  void note_end(Run& run);
  void end(Runs::iterator at, const rr::Error& why);

  boost::asio::any_io_executor executor_;
  DeviceRegistry& devices_;
  MemoryBudget::Charge memory_;  ///< of nothing: those of the recordings are its siblings
  Runs runs_;                    ///< by device
  std::list<RunPtr> ending_;     ///< their threads
  bool is_stopped_ = false;
  std::shared_ptr<int> life_ = std::make_shared<int>(0);  ///< for what is posted
};

}  // namespace rrgate
