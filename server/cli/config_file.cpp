#include "server/cli/config_file.hpp"

#include <sys/resource.h>

#include <algorithm>

#include "node/platform/file_look.hpp"
#include "server/cli/run_gateway.hpp"
#include "server/cli/service_manager.hpp"
#include "server/config/access_options.hpp"
#include "server/config/cautions.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace {

/// A change is taken once the file has looked the same twice: editors and copies write in pieces.
constexpr std::chrono::milliseconds watch_period{1000};

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

void complete_config(Config& config) {
  configure_log(config.log.level, config.log.format);
  if (const auto problem = exposure(config.listen, config); !problem.empty())
    log(LogLevel::warning, "insecure", {{"why", problem}});
  for (const auto& [path, text] : find_cautions(config))
    log(LogLevel::warning, "caution", {{"at", path}, {"why", text}});
  fit_descriptors(config.limits);
  if (config.web_root.empty()) config.web_root = find_web_root();
}

ConfigFile::ConfigFile(boost::asio::io_context& io, Gateway& gateway, std::string path)
    : gateway_(gateway), path_(std::move(path)), used_(rr::file_look(path_)), seen_(used_), timer_(io) {}

void ConfigFile::watch() {
  if (!path_.empty()) wait();
}

void ConfigFile::wait() {
  timer_.expires_after(watch_period);
  timer_.async_wait([this](const rr::error_code& error) {
    if (error || gateway_.is_stopping()) return;
    const auto before = std::exchange(seen_, rr::file_look(path_));
    if (seen_ != used_ && seen_ == before) reload();
    wait();
  });
}

void ConfigFile::stop() {
  timer_.cancel();
}

bool ConfigFile::reload() {
  if (path_.empty() || gateway_.is_stopping()) return false;
  notify_reloading();
  used_ = seen_ = rr::file_look(path_);
  auto parsed = load_config(path_);
  bool is_used = parsed.findings.empty();
  for (const auto& finding : parsed.findings)
    log(LogLevel::error, "configuration not used; that from before stays", {{"error", format_finding(path_, finding)}});
  if (is_used) {
    complete_config(parsed.config);
    const auto done = gateway_.reconfigure(std::move(parsed.config));
    is_used = done.has_value();
    if (is_used)
      log(LogLevel::info, "configuration read anew", {{"devices", gateway_.devices().all().size()}});
    else
      log(LogLevel::error, "configuration not used; that from before stays", {{"error", done.error().message}});
  }
  // The log's settings of a file that isn't used are not used either.
  configure_log(gateway_.config().log.level, gateway_.config().log.format);
  ++(is_used ? gateway_.metrics().reloads : gateway_.metrics().failed_reloads);
  notify_service_manager(is_used ? "READY=1\nSTATUS=serving"
                                 : "READY=1\nSTATUS=serving; the configuration file can't be used");
  return is_used;
}

}  // namespace rrgate
