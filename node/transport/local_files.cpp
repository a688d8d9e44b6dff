#include "node/transport/local_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <map>
#include <system_error>
#include <thread>

#include "core/support/words.hpp"
#include "node/platform/folders.hpp"

namespace rr {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t max_info_size = 16 * 1024;
constexpr std::size_t max_nodes = 4096;  // of a base
constexpr std::size_t max_bases = 256;

bool is_key_char(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '+' || c == '.' || c == '-';
}

constexpr std::string_view line_blanks = " \t\r\v\f";

/// Lines "key: value"; the first of a key counts, other lines don't.
std::map<std::string, std::string, std::less<>> parse_lines(std::string_view text) {
  std::map<std::string, std::string, std::less<>> values;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const auto line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    const auto colon = line.find(':');
    if (colon == std::string_view::npos) continue;
    const auto key = trim(line.substr(0, colon), line_blanks);
    if (key.empty() || !std::all_of(key.begin(), key.end(), is_key_char)) continue;
    values.emplace(key, trim(line.substr(colon + 1), line_blanks));
  }
  return values;
}

/// What is no such file is none. Errors   those of open_to_read().
Result<std::optional<LocalNodeInfo>> try_read_info(const fs::path& file) {
  const std::optional<LocalNodeInfo> none;
  const auto descriptor = open_to_read(file);
  if (!descriptor) return descriptor.error();
  if (*descriptor < 0) return none;
  struct stat status {};
  std::string text(max_info_size, '\0');
  const bool is_file = ::fstat(*descriptor, &status) == 0 && S_ISREG(status.st_mode);
  const auto size = is_file ? ::read(*descriptor, text.data(), text.size()) : -1;
  ::close(*descriptor);
  if (size < 0) return none;
  text.resize(static_cast<std::size_t>(size));
  auto info = parse_local_info(text);
  return info ? std::optional(std::move(*info)) : none;
}

std::optional<LocalNodeInfo> read_info(const fs::path& file) {
  auto info = try_read_info(file);
  return info ? std::move(*info) : std::nullopt;
}

fs::path by_id(const fs::path& base, const NodeId& id, const char* extension) {
  return base / "by-nodeid" / (format_node_id(id, NodeIdFormat::dashes) + extension);
}
fs::path by_name(const fs::path& base, const std::string& name, const char* extension) {
  return base / "by-nodename" / (name + extension);
}

fs::path base_in(const fs::path& run) {
  return run / "transport" / "local";
}

Error file_error(const char* what, const fs::path& path, const std::string& why) {
  return make_error(ErrorCode::system_resource_error, std::string(what) + " " + path.string() + ": " + why);
}

}  // namespace

std::string format_local_info(const LocalNodeInfo& info) {
  std::string text = "ServiceStateNonce: " + info.nonce + "\nnodeid: " + format_node_id(info.node.id) + "\n";
  if (!info.node.name.empty()) text += "nodename: " + info.node.name + "\n";
  return text + "pid: " + std::to_string(::getpid()) + "\nsocket: " + info.socket + "\nusername: " + info.username +
         "\n";
}

Result<LocalNodeInfo> parse_local_info(std::string_view text) {
  auto values = parse_lines(text);
  const auto id = parse_node_id(values["nodeid"]);
  if (!id) return make_error(ErrorCode::invalid_configuration, "info file: " + id.error().message);
  LocalNodeInfo info{{*id, values["nodename"]}, values["socket"], values["username"], values["ServiceStateNonce"]};
  if (!info.node.name.empty() && !is_valid_node_name(info.node.name))
    return make_error(ErrorCode::invalid_configuration, "info file: nodename " + rr::quote(info.node.name));
  // A byte of zero would cut it short where it is used.
  if (info.socket.empty() || info.socket.front() != '/' || info.socket.find('\0') != std::string::npos)
    return make_error(ErrorCode::invalid_configuration, "info file: no absolute path of a socket");
  return info;
}

Result<LocalNodeFiles> LocalNodeFiles::take(const fs::path& base, const NodeIdentity& node) {
  LocalNodeFiles files;
  const auto add = [&](const fs::path& pid, const fs::path& info) -> Result<> {
    for (const auto& [path, list] : {std::pair(pid, &files.pids_), std::pair(info, &files.infos_)}) {
      auto file = LockedFile::open(path);
      // Another node that cleans up holds what is left of ours for a moment.
      for (int attempts = 5; !file && attempts > 0; --attempts) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        file = LockedFile::open(path);
      }
      if (!file) return file.error();
      list->push_back(std::move(*file));
    }
    return files.pids_.back().write(std::to_string(::getpid()));
  };
  for (const char* folder : {"by-nodeid", "by-nodename"}) {
    std::error_code error;
    fs::create_directories(base / folder, error);
    if (error) return file_error("create", base / folder, error.message());
  }
  if (auto done = add(by_id(base, node.id, ".pid"), by_id(base, node.id, ".info")); !done) return done.error();
  if (!node.name.empty())
    if (auto done = add(by_name(base, node.name, ".pid"), by_name(base, node.name, ".info")); !done)
      return done.error();
  return files;
}

LocalNodeFiles::~LocalNodeFiles() {
  // Info files first: who still sees the other finds a node that does not answer, and goes on.
  for (auto& file : infos_) file.remove();
  for (auto& file : pids_) file.remove();
}

Result<> LocalNodeFiles::publish(const LocalNodeInfo& info) {
  const auto text = format_local_info(info);
  for (auto& file : infos_)
    if (auto written = file.write(text); !written) return written;
  return {};
}

Result<fs::path> public_bases_folder() {
  const auto system = system_run_folder();
  if (!system) return system;
  return *system / "transport" / "local";
}

Result<fs::path> own_base() {
  const auto run = user_run_folder();
  if (!run) return run;
  return base_in(*run);
}

Result<std::vector<LocalBase>> all_local_bases() {
  const auto publics = public_bases_folder();
  if (!publics) return publics.error();
  const auto run = user_run_folder();
  if (!run) return run.error();
  std::vector<LocalBase> bases;
  if (is_own_folder(*run)) bases.push_back({base_in(*run), ""});
  std::error_code error;
  for (fs::directory_iterator entry(*publics, error), end; !error && entry != end && bases.size() < max_bases;
       entry.increment(error)) {
    std::error_code unreadable;
    if (entry->is_directory(unreadable)) bases.push_back({entry->path(), entry->path().filename().string()});
  }
  if (auto failure = shortage(error.value(), *publics)) return std::move(*failure);
  return bases;
}

Result<std::vector<fs::path>> local_bases(const ConnectionUrl& url) {
  const auto publics = public_bases_folder();
  if (!publics) return publics.error();
  const auto me = user_name();
  std::vector<fs::path> bases;
  if (url.user.empty() || url.user == me) {
    const auto run = user_run_folder();
    if (!run) return run.error();
    if (is_own_folder(*run)) bases.push_back(base_in(*run));
    if (!me.empty()) bases.push_back(*publics / me);
    if (url.user.empty() && me != "root") bases.push_back(*publics / "root");
  } else {
    bases.push_back(*publics / url.user);
  }
  return bases;
}

std::optional<LocalNodeInfo> find_local_node(const fs::path& base, const ConnectionUrl& url) {
  if (!url.node_id) {
    auto info = read_info(by_name(base, url.node_name, ".info"));
    if (info && info->node.name != url.node_name) return std::nullopt;
    return info;
  }
  auto info = read_info(by_id(base, *url.node_id, ".info"));
  if (!info || info->node.id != *url.node_id) return std::nullopt;
  if (url.node_name.empty()) return info;
  const auto named = read_info(by_name(base, url.node_name, ".info"));
  if (info->node.name != url.node_name || !named || named->socket != info->socket) return std::nullopt;
  return info;
}

Result<std::vector<LocalNodeInfo>> list_local_nodes(const fs::path& base) {
  std::vector<LocalNodeInfo> nodes;
  std::error_code error;
  std::size_t seen = 0;
  for (fs::directory_iterator entry(base / "by-nodeid", error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() != ".info") continue;
    if (++seen > max_nodes) break;
    auto info = try_read_info(entry->path());
    if (!info) return info.error();
    if (!*info || entry->path() != by_id(base, (*info)->node.id, ".info")) continue;
    // The reference's own info files lose their locks while it runs; its pid files don't.
    const auto is_held = LockedFile::is_held(by_id(base, (*info)->node.id, ".pid"));
    if (!is_held) return is_held.error();
    if (*is_held) nodes.push_back(std::move(**info));
  }
  if (auto failure = shortage(error.value(), base)) return std::move(*failure);
  return nodes;
}

void clean_local_base(const fs::path& base, const fs::path& sockets) {
  std::error_code error;
  std::vector<fs::path> infos;
  for (const char* folder : {"by-nodeid", "by-nodename"})
    for (const auto& entry : fs::directory_iterator(base / folder, error))
      if (entry.path().extension() == ".info") infos.push_back(entry.path());
  for (const auto& path : infos) {
    auto pid_path = path;
    pid_path.replace_extension(".pid");
    auto pid = LockedFile::open_left_behind(pid_path);
    if (!pid && fs::exists(pid_path, error)) continue;
    auto info = LockedFile::open_left_behind(path);
    if (!info) continue;
    if (const auto found = read_info(path); found && fs::path(found->socket).parent_path() == sockets)
      fs::remove(found->socket, error);
    info->remove();
    if (pid) pid->remove();
  }
}

Result<LocalFolders> make_local_folders() {
  const auto run = make_user_run_folder();
  if (!run) return run.error();
  std::error_code error;
  LocalFolders folders{base_in(*run), *run / "socket"};
  for (const auto& folder : {folders.base, folders.sockets}) {
    fs::create_directories(folder, error);
    if (error) return file_error("create", folder, error.message());
  }
  return folders;
}

Result<LocalFolders> make_public_folders() {
  const auto publics = public_bases_folder();
  if (!publics) return publics.error();
  const auto user = user_name();
  if (user.empty()) return make_error(ErrorCode::system_resource_error, "public nodes: this user has no name");
  const LocalFolders folders{*publics / user, *publics / user / "socket"};
  struct stat status {};
  if (::stat(folders.base.c_str(), &status) != 0 || !S_ISDIR(status.st_mode))
    return make_error(ErrorCode::system_resource_error,
                      "this machine is not set up for public nodes of " + user + ": " + folders.base.string() +
                          " is not there; its administrator makes it: install -d -m 2750 -o " + user +
                          " -g robotraconteur " + folders.base.string());
  for (const auto& folder : {folders.base / "by-nodeid", folders.base / "by-nodename", folders.sockets}) {
    if (::mkdir(folder.c_str(), 0750) != 0) {
      if (errno == EEXIST) continue;
      return file_error("create", folder, std::generic_category().message(errno));
    }
    // In this order: a change of the group takes the bit away that gives it on to the files.
    if (::chown(folder.c_str(), static_cast<uid_t>(-1), status.st_gid) != 0 || ::chmod(folder.c_str(), 02750) != 0)
      return file_error("hand to its group", folder, std::generic_category().message(errno));
  }
  return folders;
}

}  // namespace rr
