// What an operator can set, with the defaults. Layer: server/config. Mirrors gateway-config/gateway.schema.json.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/url.hpp"
#include "core/types/value.hpp"
#include "node/tls/tls_context.hpp"
#include "node/transport/http_headers.hpp"
#include "server/access/access_config.hpp"
#include "server/config/finding.hpp"
#include "server/config/recording_options.hpp"
#include "server/http/forwarded.hpp"

namespace rrgate {

using std::chrono::milliseconds;

/// How devices that are reached by TLS are checked. The gateway itself shows no certificate: the clients whose messages
/// it relays are other nodes than it.
struct DeviceTls {
  std::vector<std::string> ca;  ///< PEM files; empty: what every Robot Raconteur program on this machine trusts

  bool operator==(const DeviceTls&) const = default;
};

/// Whose session with a device it is.
struct UpstreamLogin {
  std::string username;  ///< empty: without a login
  rr::MapString credentials;
  bool is_late = false;  ///< once the session is there: what services take that require no user

  bool operator==(const UpstreamLogin&) const = default;
};

/// Which client of a shared device answers a callback.
enum class CallbackPolicy : std::uint8_t {
  owner,  ///< the client whose call is being answered; where none is, the only client there is
  first,  ///< the client that has been there longest
  all,    ///< every client; the first answer that is no error counts
};

/// For the callbacks whose "path.member" fits a pattern with * and ?.
struct CallbackRule {
  std::string member;
  CallbackPolicy policy = CallbackPolicy::owner;

  bool operator==(const CallbackRule&) const = default;
};

/// What a lease is to a member that is written or called.
enum class LeaseNeed : std::uint8_t {
  covered,   ///< while somebody has one, the holder alone may
  required,  ///< the holder alone may, ever
  never,     ///< everybody with the right may, past leases and locks
};

/// For the members whose "path.member" fits a pattern with * and ?.
struct LeaseRule {
  std::string member;
  LeaseNeed need = LeaseNeed::covered;

  bool operator==(const LeaseRule&) const = default;
};

/// What makes a device safe.
struct SafeAction {
  enum class Kind : std::uint8_t { call, wire, property };
  Kind kind = Kind::call;
  std::string path;    ///< of the object
  std::string member;  ///< its name
  std::string json;    ///< the arguments as an array, or the value

  bool operator==(const SafeAction&) const = default;
};

/// The right to command a shared device, held by one client for as long as it renews it.
struct LeaseConfig {
  bool is_offered = false;
  std::vector<LeaseRule> members;     ///< the first that fits a member counts
  std::vector<SafeAction> safe;       ///< done in this order when a lease ends whose object they are at or below
  std::vector<std::string> takeover;  ///< roles of those who may take a lease from others; "*": everybody

  /// `member`  "path.member", however an index is spelled: "Create.arms[left%5fone].stop", "Create.arms.left_one.stop".
  LeaseNeed need_of(std::string_view member) const;
  /// Whether commands of a member pass all that keeps others waiting. `place`  as above.
  bool is_urgent(std::string_view place) const;
  /// Whether the end of a lease of an object makes anything safe. `place`  of the object, as above.
  bool makes_safe(std::string_view place) const;
  bool operator==(const LeaseConfig&) const = default;
};

/// How clients reach a device.
enum class DeviceMode : std::uint8_t {
  relay,   ///< each by a connection of its own, byte for byte
  shared,  ///< all by one session of the gateway's
};

struct DeviceConfig {
  std::string name;  ///< the path segment of /devices/<name>
  rr::ConnectionUrl url;
  std::size_t max_clients = 0;  ///< 0: no bound of its own
  bool is_found = false;        ///< by discovery, not configured
  bool is_served = false;       ///< by a page, not configured; there as long as that is
  DeviceTls tls;
  rr::HostPort proxy;       ///< HTTP proxy on the way; empty host: none
  rr::HttpHeaders headers;  ///< for WebSocket URLs
  DeviceMode mode = DeviceMode::relay;
  UpstreamLogin login;                  ///< of the shared session; no user name: none
  std::vector<CallbackRule> callbacks;  ///< of a shared device; the first that fits a callback counts
  bool shares_reads = false;            ///< of a shared device: clients that read a property at once are one to it

  LeaseConfig leases;  ///< of a shared device

  bool operator==(const DeviceConfig&) const = default;
};

struct Limits {
  std::size_t max_message_size = 12u * 1024 * 1024;  ///< bytes of one Robot Raconteur message, both directions
  std::size_t header_bytes = 8192;                   ///< of an HTTP request, with its empty line
  std::size_t body_bytes = 16u * 1024 * 1024;        ///< of an HTTP request
  milliseconds header_timeout{5000};                 ///< for the first bytes, and for a whole header
  std::size_t outbox_bytes = 256u * 1024;            ///< held for one client and direction before reading pauses
  std::size_t clients = 4000;                        ///< connections at a time, all addresses together
  std::size_t clients_per_address = 1000;
  std::size_t memory = 0;  ///< bytes that clients may make the gateway hold; 0: a quarter of the machine's
  std::size_t client_queue_bytes = 8u * 1024 * 1024;  ///< a client of a shared device that leaves more waiting is cut
  std::size_t opaque_rate = 128u * 1024 * 1024;       ///< bytes a second and direction of what is encrypted end to end

  bool operator==(const Limits&) const = default;
};

/// Requests over HTTP, WebSockets and in shared sessions; 0: no bound.
struct RateLimit {
  std::size_t per_second = 0;
  std::size_t at_once = 0;

  bool is_bound() const { return per_second > 0 || at_once > 0; }
  bool operator==(const RateLimit&) const = default;
};
struct Rates {
  RateLimit client;  ///< of one address
  RateLimit user;    ///< of one who has proven who he is
  RateLimit device;  ///< to one device, of all together

  bool is_bound() const { return client.is_bound() || user.is_bound() || device.is_bound(); }
  bool operator==(const Rates&) const = default;
};

struct Timeouts {
  milliseconds connect{5000};          ///< to reach a device
  milliseconds drain{5000};            ///< for sessions to end after SIGTERM
  milliseconds send_stall{15000};      ///< a peer that takes no byte for so long is cut
  milliseconds idle{60000};            ///< a kept-alive HTTP connection without a request
  milliseconds unused_session{60000};  ///< of a shared device, before it ends; 0: it is kept
  milliseconds request{60000};         ///< for a device to answer what the gateway asks it in a session of its own

  bool operator==(const Timeouts&) const = default;
};

/// Waiting between attempts to reach a device that is down: doubles from min to max, with jitter.
struct Retry {
  milliseconds min{500};
  milliseconds max{30000};
  milliseconds online{10000};  ///< between looks at a device that answers

  bool operator==(const Retry&) const = default;
};

/// HTTPS and secure WebSockets, on the same ports as everything else.
struct TlsConfig {
  std::vector<rr::WebCertificate> certificates;  ///< empty: TLS is not served
  bool is_required = false;                      ///< clients in clear are sent to HTTPS, or refused
  std::size_t hsts_seconds = 0;                  ///< how long browsers shall come by HTTPS alone; 0: they are not told

  bool operator==(const TlsConfig&) const = default;
};

/// What stands before the gateway.
struct ProxyConfig {
  ProxyTrust trust;
  bool has_proxy_protocol = false;  ///< connections of trusted proxies begin with a PROXY header

  bool operator==(const ProxyConfig&) const = default;
};

/// The gateway as a Robot Raconteur node.
struct NodeConfig {
  std::string name = "rrgate";
  rr::NodeId id;  ///< any: another one at each start

  bool operator==(const NodeConfig&) const = default;
};

struct LogConfig {
  std::string level = "info";
  std::string format = "text";

  bool operator==(const LogConfig&) const = default;
};

/// Which found nodes become devices. All conditions that are given must hold; at least one is.
struct DiscoverRule {
  std::string node_name;     ///< with * and ?; empty: any
  rr::NodeId node_id;        ///< any: any
  std::string service_type;  ///< of a root object, or of one that it implements; empty: any

  bool operator==(const DiscoverRule&) const = default;
};

struct Discover {
  bool is_enabled = false;                        ///< there where the configuration has "discover"
  std::vector<std::string> scopes{"link_local"};  ///< of node_local, link_local, site_local, ipv4_broadcast
  std::vector<DiscoverRule> allow;
  std::size_t max_devices = 64;  ///< found ones at a time
  bool local = true;             ///< nodes of this machine, by rr+local
  bool hardware = true;          ///< nodes that are plugged in: rr+usb, rr+pci
  DeviceTls tls;                 ///< of found devices
  DeviceMode mode = DeviceMode::relay;

  bool operator==(const Discover&) const = default;
};

/// Pages that are devices, each by a WebSocket at /serve/NAME.
struct ServeConfig {
  bool is_enabled = false;  ///< there where the configuration has "serve"
  std::size_t max_devices = 16;
  DeviceMode mode = DeviceMode::shared;

  bool operator==(const ServeConfig&) const = default;
};

/// The devices for agents, by the Model Context Protocol.
struct McpConfig {
  bool is_enabled = false;               ///< there where the configuration has "mcp"
  milliseconds longest_wait{60000};      ///< for an event
  milliseconds longest_approval{60000};  ///< what a person may take to allow a command; then it is refused

  bool operator==(const McpConfig&) const = default;
};

struct Config {
  std::vector<rr::HostPort> listen;
  std::vector<DeviceConfig> devices;
  Discover discover;
  NodeConfig node;
  std::string web_root;   ///< folder of the dashboard; empty: the one that was installed with the program
  std::string base_path;  ///< "" or "/robots": before all paths, where a proxy passes it on
  ProxyConfig proxy;
  std::vector<std::string> allowed_origins;
  std::vector<std::string> allowed_hosts;  ///< names by which browsers reach the gateway, beside those of certificates
  TlsConfig tls;
  AccessConfig access;
  bool insecure = false;  ///< other machines may come without TLS, or without saying who they are
  Limits limits;
  Rates rates;
  Timeouts timeouts;
  Retry retry;
  LogConfig log;
  McpConfig mcp;
  ServeConfig serve;
  RecordingsConfig recordings;

  bool operator==(const Config&) const = default;
};

/// Reads a configuration (JSON with comments). Every finding is listed, not only the first; with any of them the config
/// is not to be used. Relative paths in it count from `folder`.
struct ParsedConfig {
  Config config;
  std::vector<Finding> findings;
};
ParsedConfig parse_config(std::string_view text, const std::filesystem::path& folder = {});

/// The same for a file and its folder; a file that can't be read is a finding with an empty path.
ParsedConfig load_config(const std::string& file);

/// Names of devices stand in paths and logs: letters, digits, '_', '-', '.', beginning with a letter or digit.
/// Returns  what is wrong; empty: nothing.
std::string check_device_name(const std::string& name);

/// Every option the parser knows, in its order: what the schema must say too.
std::vector<OptionInfo> config_options();

}  // namespace rrgate
