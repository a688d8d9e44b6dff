// Where Robot Raconteur keeps its files on this machine. Layer: node/platform. Source: transports spec section 8.1.
//
// As with the reference, but for two things: an empty variable counts as unset, and a relative path is refused.
#pragma once

#include <filesystem>

#include "core/support/error.hpp"

namespace rr {

/// Certificates and NodeIDs of this user; of the whole machine for root.
/// Errors   invalid_configuration: nothing says where, or what does is a relative path.
[[nodiscard]] Result<std::filesystem::path> user_config_folder();
/// Sockets and locks of this user's nodes. Below /tmp where there is no XDG_RUNTIME_DIR; then it must be the user's
/// own: see is_own_folder(). Errors   as above.
[[nodiscard]] Result<std::filesystem::path> user_run_folder();
/// Whether it is a folder of this process's user, and no link to one: a link may lead elsewhere the next time.
bool is_own_folder(const std::filesystem::path& folder);
/// The same, made for this user alone (mode 0700) where it is not there yet.
/// Errors   those of user_run_folder(); system_resource_error: it can't be made; system_resource_permission_denied: it
///          is no folder of this user's.
[[nodiscard]] Result<std::filesystem::path> make_user_run_folder();
[[nodiscard]] Result<std::filesystem::path> system_run_folder();
/// What nodes of this user keep: that of the configuration, or of the machine's own nodes for root. Errors   as above.
[[nodiscard]] Result<std::filesystem::path> user_state_folder();
/// What this machine's own nodes keep.
[[nodiscard]] Result<std::filesystem::path> system_state_folder();

/// This process's user. Empty where the system knows no name for its number.
std::string user_name();

}  // namespace rr
