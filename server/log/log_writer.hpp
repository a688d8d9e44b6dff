// Lines of the log on their way to a file that may take none for a while. Layer: server/log.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

namespace rrgate {

/// Writes on a thread of its own, so that a pipe or a terminal that nobody reads keeps no caller waiting. May be used
/// from any thread.
class LogWriter {
 public:
  /// `file`  a descriptor, which outlives this.
  /// `max_bytes`  of all lines that wait. Above, new lines are dropped and counted.
  /// `caught_up`  is called from the writer's thread when all that waited was written after lines were dropped, with
  /// their number; it may call add().
  LogWriter(int file, std::size_t max_bytes, std::function<void(std::uint64_t)> caught_up);
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;
  /// Does not wait for lines that are left, nor for the thread; after it, `caught_up` is not called any more.
  ~LogWriter();

  /// `line`  with its end. Never waits for the file.
  void add(std::string_view line);
  /// Waits until everything was written. False: it was not, in that time.
  bool flush(std::chrono::milliseconds patience);
  /// Lines that were dropped so far.
  std::uint64_t lost() const;

 private:
  struct State;
  std::shared_ptr<State> state_;  ///< shared with the thread, which may be stuck in a write for ever
};

}  // namespace rrgate
