#include "server/cli/run_gateway.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <filesystem>

#include "server/cli/command.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace {

/// A relayed client takes two descriptors. Asks for as many as the system allows, and lowers the bound on clients where
/// that is not enough: a refused client is better than a gateway that can't open a file.
void fit_descriptors(Limits& limits) {
  constexpr rlim_t others = 64;
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  const rlim_t wanted = limits.clients * 2 + others;
  if (files.rlim_cur < wanted) {
    files.rlim_cur = std::min(wanted, files.rlim_max);
    ::setrlimit(RLIMIT_NOFILE, &files);
  }
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0 || files.rlim_cur >= wanted) return;
  const auto possible = files.rlim_cur > 2 * others ? (files.rlim_cur - others) / 2 : 32;
  log(LogLevel::warning, "limits.clients lowered: not enough file descriptors",
      {{"clients", limits.clients}, {"possible", possible}, {"descriptors", files.rlim_cur}});
  limits.clients = possible;
}

}  // namespace

int run_gateway(Config config, const OnStarted& on_started) {
  std::signal(SIGPIPE, SIG_IGN);
  configure_log(config.log.level, config.log.format);
  fit_descriptors(config.limits);
  if (config.web_root.empty()) config.web_root = find_web_root();

  boost::asio::io_context io(1);
  Gateway gateway(io, std::move(config));
  boost::asio::signal_set signals(io, SIGTERM, SIGINT, SIGHUP);
  std::function<void()> wait_for_signal = [&] {
    signals.async_wait([&](const boost::system::error_code& error, int number) {
      if (error) return;
      log(LogLevel::info, "signal", {{"number", number}});
      if (number == SIGHUP) {
        gateway.reload_tls();
        wait_for_signal();
        return;
      }
      wait_for_signal();  // first: an idle gateway stops within the call below
      gateway.stop([&] { signals.cancel(); });
    });
  };
  wait_for_signal();

  const auto addresses = gateway.start();
  if (!addresses) {
    log(LogLevel::error, "not started", {{"error", addresses.error().message}});
    return exit_failed;
  }
  for (const auto& address : *addresses)
    log(LogLevel::info, "listening", {{"address", rr::format_host_port(address.host, address.port)}});
  on_started(io, gateway, *addresses);

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
