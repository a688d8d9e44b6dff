#include "server/cli/run_gateway.hpp"

#include <algorithm>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <filesystem>
#include <functional>
#include <limits>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "server/cli/command.hpp"
#include "server/cli/config_file.hpp"
#include "server/cli/service_manager.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace {

/// Works once in each period, until it is stopped.
class Periodic {
 public:
  Periodic(boost::asio::io_context& io, std::function<void()> work) : timer_(io), work_(std::move(work)) {}

  void start(std::chrono::milliseconds period) {
    timer_.expires_after(period);
    timer_.async_wait([this, period](const rr::error_code& error) {
      if (error || is_stopped_) return;  // a wait that has ended is not cancelled
      work_();
      start(period);
    });
  }
  void stop() {
    is_stopped_ = true;
    timer_.cancel();
  }

 private:
  boost::asio::steady_timer timer_;
  std::function<void()> work_;
  bool is_stopped_ = false;
};

void tell_alive() {
  notify_service_manager("WATCHDOG=1");
}

/// glibc takes large blocks from the heap once one of their size was freed, and keeps them there: with each thread that
/// judges a password, the 16 MB of that. Blocks of this size and more are the system's again as soon as they are free;
/// of smaller ones, each heap keeps as much as glibc would for blocks of this size.
void give_large_blocks_back() {
#ifdef __GLIBC__
  constexpr int large = 8 * 1024 * 1024;
  // NOLINTBEGIN(concurrency-mt-unsafe): there are no other threads yet
  mallopt(M_MMAP_THRESHOLD, large);
  mallopt(M_TRIM_THRESHOLD, 2 * large);
  // NOLINTEND(concurrency-mt-unsafe)
#endif
}

/// Gives the free pages of the heap back after a crowd has gone: those between what others hold stay resident
/// otherwise.
class FreePages {
 public:
  static constexpr std::chrono::seconds period{5};

  void look() {
#ifdef __GLIBC__
    const std::size_t free = mallinfo2().fordblks;  // resident or not
    least_ = std::min(least_, free);
    if (free - least_ < worth) return;
    malloc_trim(0);
    least_ = free;
#endif
  }

 private:
  static constexpr std::size_t worth = 16 * 1024 * 1024;  // no trim for what messages alone make come and go

  std::size_t least_ = std::numeric_limits<std::size_t>::max();  ///< that was free since the last time
};

}  // namespace

int run_gateway(Config config, const OnStarted& on_started, const std::string& config_file) {
  std::signal(SIGPIPE, SIG_IGN);
  give_large_blocks_back();
  complete_config(config);

  boost::asio::io_context io(1);
  Gateway gateway(io, std::move(config));
  ConfigFile file(io, gateway, config_file);
  Periodic heartbeat(io, tell_alive);
  FreePages free_pages;
  Periodic looks(io, [&] { free_pages.look(); });
  boost::asio::signal_set signals(io, SIGTERM, SIGINT, SIGHUP);
  bool has_stopped = false;
  std::function<void()> wait_for_signal = [&] {
    signals.async_wait([&](const boost::system::error_code& error, int number) {
      if (error || has_stopped) return;  // a signal that came in the last moment is not cancelled
      log(LogLevel::info, "signal", {{"number", number}});
      if (number == SIGHUP) {
        file.reload();
        gateway.reload_files();
        wait_for_signal();
        return;
      }
      wait_for_signal();  // first: an idle gateway stops within the call below
      notify_service_manager("STOPPING=1\nSTATUS=sessions may end");
      file.stop();
      gateway.stop([&] {
        has_stopped = true;
        heartbeat.stop();
        looks.stop();
        signals.cancel();
      });
    });
  };
  wait_for_signal();

  const auto addresses = gateway.start(take_listening_sockets());
  if (!addresses) {
    log(LogLevel::error, "not started", {{"error", addresses.error().message}});
    return exit_failed;
  }
  for (const auto& address : *addresses)
    log(LogLevel::info, "listening", {{"address", rr::format_host_port(address.host, address.port)}});
  on_started(io, gateway, *addresses);
  file.watch();
  if (const auto period = watchdog_period()) {  // as often as the service manager wants
    tell_alive();
    heartbeat.start(*period);
  }
  looks.start(FreePages::period);
  notify_service_manager("READY=1\nSTATUS=serving");

  io.run();  // returns when everything has ended by itself: nothing outlives what it refers to
  return exit_ok;
}

std::string program_folder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path().string();
}

std::string find_web_root() {
  const std::filesystem::path folder = program_folder();
  for (const auto candidate : {"../share/rrgate/web", "../../../web/dist"}) {
    std::error_code error;
    const auto path = folder / candidate;
    if (std::filesystem::exists(path / "index.html", error)) return std::filesystem::canonical(path, error).string();
  }
  return {};
}

}  // namespace rrgate
