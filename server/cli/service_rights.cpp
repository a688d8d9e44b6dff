#include "server/cli/service_rights.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "core/support/words.hpp"

namespace rrgate {

namespace {

namespace fs = std::filesystem;

struct WantedFile {
  std::string path;
  int access;                 ///< as access() takes it
  const char* for_what = "";  ///< what fails without it, where the gateway runs all the same
};

std::vector<WantedFile> wanted_files(const std::string& file, const Config& config) {
  std::vector<WantedFile> wanted{{file, R_OK}};
  const auto reads = [&wanted](const std::string& path) {
    if (!path.empty()) wanted.push_back({path, R_OK});
  };
  for (const auto& certificate : config.tls.certificates) {
    reads(certificate.certificate_file);
    reads(certificate.key_file);
  }
  for (const auto& device : config.devices)
    for (const auto& ca : device.tls.ca) reads(ca);
  for (const auto& ca : config.discover.tls.ca) reads(ca);
  for (const auto* files : {&config.access.clients.ca, &config.access.clients.crl, &config.access.jwt.ca})
    for (const auto& each : *files) reads(each);
  // A new token comes in a new file that takes the place of the old one.
  if (const auto& tokens = config.access.tokens_file; !tokens.empty())
    wanted.push_back({fs::path(tokens).parent_path().string(), W_OK | X_OK, "requests for access can't be approved"});
  for (const auto* path : {&config.access.users_file, &config.access.tokens_file, &config.access.jwt.jwks_file,
                           &config.access.jwt.secret_file, &config.access.ticket_key_file, &config.web_root})
    reads(*path);
  if (const auto& audit = config.access.audit.file; !audit.empty()) {
    wanted.push_back({fs::path(audit).parent_path().string(), W_OK | X_OK});
    std::error_code error;
    if (fs::exists(audit, error)) wanted.push_back({audit, W_OK});
  }
  if (!config.recordings.folder.empty()) {
    auto folder = fs::absolute(config.recordings.folder);
    std::error_code error;
    while (folder.has_relative_path() && !fs::exists(folder, error)) folder = folder.parent_path();  // that is made
    wanted.push_back({folder.string(), R_OK | W_OK | X_OK, "nothing can be recorded"});
  }
  return wanted;
}

/// The first part of the path that is in the way: a folder that may not be entered, or the file.
std::string obstacle(const fs::path& path) {
  fs::path part;
  for (const auto& word : path) {
    part /= word;
    if (part != path && ::eaccess(part.c_str(), X_OK) != 0) break;
  }
  struct stat about {};
  if (::stat(part.c_str(), &about) != 0) return part.string() + " is not there";
  const auto* owner = ::getpwuid(about.st_uid);  // NOLINT(concurrency-mt-unsafe): one thread
  const auto* group = ::getgrgid(about.st_gid);  // NOLINT(concurrency-mt-unsafe): one thread
  char mode[8] = {};
  std::snprintf(mode, sizeof mode, "%04o", about.st_mode & 07777u);
  return part.string() + " belongs to " + (owner ? owner->pw_name : std::to_string(about.st_uid)) + ":" +
         (group ? group->gr_name : std::to_string(about.st_gid)) + " with mode " + mode;
}

constexpr char needed_mark = '!';
constexpr char optional_mark = '?';

/// Runs as the user. One line for each file, which begins with a mark.
std::string missing_rights(const std::string& user, const std::vector<WantedFile>& wanted) {
  std::string lines;
  for (const auto& each : wanted) {
    const auto path = fs::absolute(each.path.empty() ? "." : each.path).lexically_normal();
    if (::eaccess(path.c_str(), each.access) == 0) continue;
    const auto* what = each.access == R_OK ? " can't read " : " can't write ";
    const std::string consequence = each.for_what;
    lines += (consequence.empty() ? needed_mark : optional_mark) + ("user " + rr::quote(user)) + what + path.string() +
             ": " + obstacle(path) + (consequence.empty() ? "" : "; " + consequence) + "\n";
  }
  return lines;
}

bool become(const passwd& user) {
  if (::geteuid() == user.pw_uid) return true;
  return ::initgroups(user.pw_name, user.pw_gid) == 0 && ::setgid(user.pw_gid) == 0 && ::setuid(user.pw_uid) == 0;
}

void write_all(int to, std::string_view text) {
  while (!text.empty()) {
    const auto written = ::write(to, text.data(), text.size());
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

rr::Result<MissingRights> find_missing_rights(const std::string& user, const std::string& file, const Config& config) {
  const auto* about = ::getpwnam(user.c_str());  // NOLINT(concurrency-mt-unsafe): one thread
  if (about == nullptr)
    return rr::make_error(rr::ErrorCode::invalid_argument, "there is no user " + rr::quote(user) + " on this machine");
  int ends[2];
  if (::pipe(ends) != 0) return rr::make_error(rr::ErrorCode::io_error, "no pipe: too many files are open");
  // What is asked for, before rights are gone: another user may not even see whether a file exists.
  const auto wanted = wanted_files(file, config);
  const auto child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    if (!become(*about)) ::_exit(1);
    write_all(ends[1], missing_rights(user, wanted));
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string lines;
  char part[4096];
  for (ssize_t size = 0; (size = ::read(ends[0], part, sizeof part)) > 0;)
    lines.append(part, static_cast<std::size_t>(size));
  ::close(ends[0]);
  int status = -1;
  if (child < 0 || ::waitpid(child, &status, 0) != child || status != 0)
    return rr::make_error(rr::ErrorCode::system_resource_permission_denied,
                          "only root can ask what user " + rr::quote(user) + " may do");
  MissingRights found;
  for (std::size_t begin = 0, end = 0; (end = lines.find('\n', begin)) != std::string::npos; begin = end + 1)
    (lines[begin] == optional_mark ? found.optional : found.needed).push_back(lines.substr(begin + 1, end - begin - 1));
  return found;
}

}  // namespace rrgate
