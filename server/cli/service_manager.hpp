// What a service manager (systemd) gives and wants to hear. Layer: server/cli.
// Source: sd_notify(3), sd_listen_fds(3); the protocols are a datagram and two environment variables, so no library.
#pragma once

#include <chrono>
#include <optional>
#include <string_view>
#include <vector>

namespace rrgate {

/// Tells the service manager, if there is one ($NOTIFY_SOCKET): lines of "READY=1", "STATUS=...".
void notify_service_manager(std::string_view text);

/// "RELOADING=1" with the time that Type=notify-reload asks for; "READY=1" must follow.
void notify_reloading();

/// How often "WATCHDOG=1" has to come; nullopt: never.
std::optional<std::chrono::milliseconds> watchdog_period();

/// Listening sockets that we were started with; empty where there are none. They are ours to close. Takes the variables
/// out of the environment: programs that we start have no such sockets.
std::vector<int> take_listening_sockets();

}  // namespace rrgate
