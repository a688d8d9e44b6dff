#include "node/transport/local_watch.hpp"

#include <sys/inotify.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstring>
#include <map>
#include <optional>
#include <set>

#include "core/session/service/service_index.hpp"
#include "node/transport/watch_timer.hpp"

namespace rr {

namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

/// A node that starts or ends touches several files.
constexpr std::chrono::milliseconds folder_settle_time{250};
/// Where the system tells nothing.
constexpr std::chrono::milliseconds blind_refresh{5000};
/// A folder may come into being between the look for it and the watch of the one that it is made in.
constexpr int attempts = 3;

constexpr std::uint32_t to_itself = IN_DELETE_SELF | IN_MOVE_SELF;
/// IN_CLOSE_WRITE: a node that is killed deletes nothing, but its files are closed.
constexpr std::uint32_t to_files =
    to_itself | IN_CREATE | IN_MODIFY | IN_ATTRIB | IN_DELETE | IN_MOVED_TO | IN_MOVED_FROM | IN_CLOSE_WRITE;
constexpr std::uint32_t to_folders = to_itself | IN_CREATE | IN_MOVED_TO;

/// What is watched: names that matter in a folder, by watch descriptor; an empty one: all.
using Watched = std::map<int, std::set<std::string>>;

/// Watches the folder, or the deepest one above it that is there, for the next one on the way.
void watch_folder(int inotify, const fs::path& folder, Watched& watched) {
  for (int i = 0; i < attempts; ++i) {
    fs::path at = folder;
    std::string name;
    int descriptor = -1;
    for (;;) {
      const auto news = name.empty() ? to_files : to_folders;
      descriptor = ::inotify_add_watch(inotify, at.c_str(), news | IN_ONLYDIR | IN_MASK_ADD);
      if (descriptor >= 0 || (errno != ENOENT && errno != ENOTDIR) || !at.has_relative_path()) break;
      name = at.filename().string();
      at = at.parent_path();
    }
    if (descriptor < 0) return;  // no permission, or too many watches: the refresh must do
    watched[descriptor].insert(name);
    std::error_code error;
    if (name.empty() || !fs::is_directory(at / name, error)) return;
  }
}

}  // namespace

Result<std::vector<LocalNode>> list_local_nodes() {
  const auto bases = all_local_bases();
  if (!bases) return bases.error();
  std::vector<LocalNode> nodes;
  for (const auto& base : *bases) {
    auto infos = list_local_nodes(base.path);
    if (!infos) return infos.error();
    for (auto& info : *infos) {
      if (!base.user.empty() && info.username != base.user) continue;
      const auto host = base.user.empty() ? std::string() : base.user + "@localhost";
      auto url = "rr+local://" + host + "/?nodeid=" + format_node_id(info.node.id, NodeIdFormat::dashes) +
                 "&service=" + std::string(service_index_name);
      nodes.push_back({std::move(info), std::move(url)});
    }
  }
  return nodes;
}

struct LocalWatch::State {
  bool is_news(std::string_view events) const {
    while (events.size() >= sizeof(inotify_event)) {
      inotify_event event{};
      std::memcpy(&event, events.data(), sizeof(event));
      events.remove_prefix(sizeof(event));
      const auto name = events.substr(0, event.len);
      events.remove_prefix(name.size());
      if (is_news(event, name.substr(0, name.find('\0')))) return true;
    }
    return false;
  }

  bool is_news(const inotify_event& event, std::string_view name) const {
    if (event.mask & IN_Q_OVERFLOW) return true;
    const auto found = watched.find(event.wd);
    if (found == watched.end()) return false;
    return (event.mask & (to_itself | IN_IGNORED)) != 0 || found->second.contains("") ||
           found->second.contains(std::string(name));
  }

  /// Again at each look: users come, folders are made. Watching what is watched already changes nothing.
  void watch_folders() {
    if (!inotify) return;
    const int number = inotify->native_handle();
    Watched now;
    if (const auto publics = public_bases_folder()) watch_folder(number, *publics, now);
    if (const auto base = own_base()) watch_folder(number, *base / "by-nodeid", now);  // it may come yet
    if (const auto bases = all_local_bases())
      for (const auto& base : *bases) watch_folder(number, base.path / "by-nodeid", now);
    for (const auto& [descriptor, names] : watched)
      if (!now.contains(descriptor)) ::inotify_rm_watch(number, descriptor);
    watched = std::move(now);
  }

  OnNodes on_nodes;
  OnProblem on_problem;
  std::optional<asio::posix::stream_descriptor> inotify;
  WatchTimer timer;
  Watched watched = {};
  std::string problem = {};  ///< reported last
};

LocalWatch::LocalWatch(const asio::any_io_executor& executor, OnNodes on_nodes, OnProblem on_problem,
                       std::chrono::milliseconds refresh) {
  std::optional<asio::posix::stream_descriptor> inotify;
  if (const int number = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC); number >= 0) inotify.emplace(executor, number);
  if (!inotify) refresh = std::min(refresh, blind_refresh);
  state_ = std::make_shared<State>(State{std::move(on_nodes), std::move(on_problem), std::move(inotify),
                                         WatchTimer(executor, refresh, folder_settle_time)});
  if (state_->inotify) asio::co_spawn(executor, listen(state_), asio::detached);
  asio::co_spawn(executor, run(state_), asio::detached);
}

LocalWatch::~LocalWatch() {
  state_->timer.stop();
  error_code ignored;
  if (state_->inotify) state_->inotify->close(ignored);
}

void LocalWatch::refresh() {
  state_->timer.hear_news();
}

awaitable<void> LocalWatch::run(std::shared_ptr<State> state) {
  while (!state->timer.is_stopped()) {
    state->timer.begin_look();
    state->watch_folders();  // before the look, so that nothing falls between
    const auto nodes = list_local_nodes();
    const auto problem = nodes ? std::string() : nodes.error().message;
    if (nodes)
      state->on_nodes(*nodes);
    else if (problem != state->problem)
      state->on_problem(problem);
    state->problem = problem;
    // The news that this look was for are still to be seen.
    if (!nodes && nodes.error().code == ErrorCode::out_of_system_resource) state->timer.hear_news();
    co_await state->timer.wait();
  }
}

awaitable<void> LocalWatch::listen(std::shared_ptr<State> state) {
  alignas(inotify_event) char buffer[16 * 1024];
  for (;;) {
    const auto [error, size] = co_await state->inotify->async_read_some(asio::buffer(buffer), await_tuple);
    if (error || state->timer.is_stopped()) break;
    if (state->is_news(std::string_view(buffer, size))) state->timer.hear_news();
  }
}

}  // namespace rr
