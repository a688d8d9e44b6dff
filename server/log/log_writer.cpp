#include "server/log/log_writer.hpp"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace rrgate {

struct LogWriter::State {
  const int file;
  const std::size_t max_bytes;
  std::mutex mutex;
  std::mutex caught_up_mutex;  ///< held while caught_up runs; taken before `mutex`
  std::function<void(std::uint64_t)> caught_up;
  std::condition_variable changed;
  std::string waiting;
  std::size_t being_written = 0;
  std::uint64_t lost = 0;
  std::uint64_t untold = 0;  ///< of those, that `caught_up` has not been told of
  bool is_telling = false;
  bool is_stopping = false;

  bool is_idle() const { return waiting.empty() && being_written == 0 && untold == 0 && !is_telling; }
};

namespace {

/// False: nothing can be written there.
bool write_to_log(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const auto written = ::write(file, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {  // whoever shares the file has made it so
      pollfd wait{file, POLLOUT, 0};
      (void)::poll(&wait, 1, -1);
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

}  // namespace

LogWriter::LogWriter(int file, std::size_t max_bytes, std::function<void(std::uint64_t)> caught_up)
    : state_(new State{.file = file,
                       .max_bytes = max_bytes,
                       .mutex = {},
                       .caught_up_mutex = {},
                       .caught_up = std::move(caught_up),
                       .changed = {},
                       .waiting = {}}) {
  const auto run = [](State& state) {
    std::unique_lock lock(state.mutex);
    for (;;) {
      state.changed.wait(lock, [&] { return state.is_stopping || !state.waiting.empty() || state.untold > 0; });
      if (state.is_stopping) return;
      if (!state.waiting.empty()) {
        const auto lines = std::exchange(state.waiting, {});
        state.being_written = lines.size();
        lock.unlock();
        const bool is_written = write_to_log(state.file, lines);
        lock.lock();
        state.being_written = 0;
        if (!is_written) state.lost += static_cast<std::uint64_t>(std::count(lines.begin(), lines.end(), '\n'));
      } else {
        const auto count = std::exchange(state.untold, 0);
        state.is_telling = true;
        lock.unlock();
        {
          const std::lock_guard telling(state.caught_up_mutex);
          if (state.caught_up) state.caught_up(count);
        }
        lock.lock();
        state.is_telling = false;
      }
      state.changed.notify_all();
    }
  };
  // Signals are for the threads that wait for them.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread([run, state = state_] { run(*state); }).detach();
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

LogWriter::~LogWriter() {
  {
    const std::lock_guard telling(state_->caught_up_mutex);
    state_->caught_up = nullptr;
  }
  const std::lock_guard lock(state_->mutex);
  state_->is_stopping = true;
  state_->changed.notify_all();
}

void LogWriter::add(std::string_view line) {
  const std::lock_guard lock(state_->mutex);
  if (state_->waiting.size() + state_->being_written + line.size() > state_->max_bytes) {
    ++state_->lost;
    ++state_->untold;
    return;
  }
  state_->waiting += line;
  state_->changed.notify_all();
}

bool LogWriter::flush(std::chrono::milliseconds patience) {
  std::unique_lock lock(state_->mutex);
  return state_->changed.wait_for(lock, patience, [this] { return state_->is_idle(); });
}

std::uint64_t LogWriter::lost() const {
  const std::lock_guard lock(state_->mutex);
  return state_->lost;
}

}  // namespace rrgate
