// What a gateway needs so that somebody can log in for the first time. Layer: server/cli.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/support/error.hpp"

namespace rrgate {

/// The names and IPv4 addresses by which browsers may reach this machine, its own name first, loopback included.
std::vector<std::string> names_of_machine();
/// The IPv4 addresses among them that other machines reach.
std::vector<std::string> addresses_of_machine();

/// Adds a user with all rights to a new file. Returns the password, which is kept nowhere else.
/// Errors   io_error: the file is there, or can't be written.
rr::Result<std::string> write_first_user(const std::filesystem::path& users_file, const std::string& name);

}  // namespace rrgate
