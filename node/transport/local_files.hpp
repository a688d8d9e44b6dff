// How nodes of one machine find each other's sockets: the folders, info files and locks below rr+local.
// Layer: node/transport. Source: transports spec sections 8.2, 8.4 and 8.5.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/connection.hpp"
#include "core/session/url.hpp"
#include "node/platform/locked_file.hpp"

namespace rr {

/// One info file.
struct LocalNodeInfo {
  NodeIdentity node;
  std::string socket;
  std::string username;
  std::string nonce;  ///< ServiceStateNonce
};
std::string format_local_info(const LocalNodeInfo& info);
/// Errors   invalid_configuration: no nodeid or socket in it, or they are not valid.
[[nodiscard]] Result<LocalNodeInfo> parse_local_info(std::string_view text);

/// The files of one running node, locked for as long as this lives, then deleted.
class LocalNodeFiles {
 public:
  /// Takes ID and name below `base`, where nobody else has them.
  /// Errors   system_resource_permission_denied: in use; system_resource_error.
  [[nodiscard]] static Result<LocalNodeFiles> take(const std::filesystem::path& base, const NodeIdentity& node);
  LocalNodeFiles(LocalNodeFiles&&) = default;
  LocalNodeFiles& operator=(LocalNodeFiles&&) = default;
  ~LocalNodeFiles();

  /// Tells clients where the socket is; again when the services have changed.
  [[nodiscard]] Result<> publish(const LocalNodeInfo& info);

 private:
  LocalNodeFiles() = default;
  std::vector<LockedFile> pids_;
  std::vector<LockedFile> infos_;
};

/// Where this user's nodes leave their info files, be there such a folder or not.
/// Errors   those of user_run_folder().
[[nodiscard]] Result<std::filesystem::path> own_base();
/// Folders of info files that a client of `url` looks through, in order.
/// Errors   those of user_run_folder().
[[nodiscard]] Result<std::vector<std::filesystem::path>> local_bases(const ConnectionUrl& url);
/// What a base says of the node that `url` names; nullopt when it doesn't know it.
std::optional<LocalNodeInfo> find_local_node(const std::filesystem::path& base, const ConnectionUrl& url);
/// All nodes that a base knows and that run; of very many, some.
/// Errors   out_of_system_resource: there is no descriptor or memory left for looking.
[[nodiscard]] Result<std::vector<LocalNodeInfo>> list_local_nodes(const std::filesystem::path& base);

/// One place where nodes of this machine leave their info files.
struct LocalBase {
  std::filesystem::path path;
  std::string user;  ///< whose public base it is; empty: this user's own
};
/// This user's, where it is not somebody else's folder, and the public ones of all users, which may be none yet.
/// Errors   those of system_run_folder() and user_run_folder(); out_of_system_resource, likewise.
[[nodiscard]] Result<std::vector<LocalBase>> all_local_bases();
/// The folder in which a public base has a folder for each user.
[[nodiscard]] Result<std::filesystem::path> public_bases_folder();
/// Deletes what nodes that ended without a word have left in a base of ours, their sockets in `sockets` too.
void clean_local_base(const std::filesystem::path& base, const std::filesystem::path& sockets);

/// <user run>/transport/local, and the folder of its sockets.
struct LocalFolders {
  std::filesystem::path base;
  std::filesystem::path sockets;
};
/// Creates them, for this user alone.
/// Errors   system_resource_error; system_resource_permission_denied: the folder is another user's.
[[nodiscard]] Result<LocalFolders> make_local_folders();
/// The same for nodes that others may use: below this user's public base, which the administrator has made, with its
/// group.
/// Errors   system_resource_error: there is no such base, or folders can't be made in it.
[[nodiscard]] Result<LocalFolders> make_public_folders();

}  // namespace rr
