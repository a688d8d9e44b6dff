// What the gateway counts. Layer: server/log. Plain numbers: all of it happens on the gateway's one thread.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/member/ledger.hpp"

namespace rrgate {

/// Why something was turned away.
enum class Rejection {
  too_many,          ///< limits.clients, clients_per_address
  unknown_protocol,  ///< neither Robot Raconteur nor HTTP nor, where it is served, TLS
  tls,               ///< a handshake that failed
  proxy_header,      ///< of a trusted proxy, missing or broken
  bad_request,       ///< no HTTP, too long, too late; a broken upgrade
  host,              ///< reached by a name that is not known to be the gateway's
  origin,            ///< a page that may not connect
  no_such_device,
  device_full,
  device_offline,
  unauthorized,  ///< a wrong password or token, or none where one is needed
  forbidden,     ///< no right to it
  rate,          ///< asked for more than "rates" allow
  audit,         ///< would be recorded, and can't be: "audit.fail_closed"
  memory,        ///< a request for which "limits.memory" has no room
};
inline constexpr std::array<std::string_view, 15> rejection_names = {"too_many",     "unknown_protocol",
                                                                     "tls",          "proxy_header",
                                                                     "bad_request",  "host",
                                                                     "origin",       "no_such_device",
                                                                     "device_full",  "device_offline",
                                                                     "unauthorized", "forbidden",
                                                                     "rate",         "audit",
                                                                     "memory"};

struct Metrics {
  std::uint64_t connections = 0;  ///< accepted
  std::uint64_t unaccepted = 0;   ///< times that none could be accepted: no descriptors left, or no memory
  std::uint64_t requests = 0;     ///< HTTP requests that were read
  std::array<std::uint64_t, rejection_names.size()> rejected{};
  std::array<std::uint64_t, 5> responses{};  ///< of HTTP, by status: 1xx to 5xx
  rr::AgeHistogram request_ages;             ///< of whole requests until their responses, streams and images left out
  std::uint64_t reloads = 0;
  std::uint64_t failed_reloads = 0;
  std::uint64_t clock_jumps = 0;  ///< times that somebody set the clock of the machine

  void respond(unsigned status) {
    if (status >= 100 && status < 600) ++responses[status / 100 - 1];
  }
  void reject(Rejection why) { ++rejected[static_cast<std::size_t>(why)]; }
};

/// What passed in one direction between a device and all its clients.
/// Of a shared device: between its clients and the gateway.
struct Flow {
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;  ///< without those inside TLS from end to end
  std::uint64_t waiting = 0;   ///< bytes that a slow reader has not taken yet
};

struct Traffic {
  Flow to_device;
  Flow to_clients;
  std::uint64_t sessions = 0;
  rr::Ledgers ledgers;  ///< of clients of a shared device
};

}  // namespace rrgate
