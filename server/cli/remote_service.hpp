// What the commands share that use a service: opening it, finding its members, JSON in and out. Layer: server/cli.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "node/client/client.hpp"
#include "server/cli/command.hpp"
#include "server/json/value_to_json.hpp"

namespace rrgate {

/// Exit codes of commands that use a service, beside those of all commands.
enum RemoteExitCode {
  exit_unreachable = 3,   ///< not reached, lost, or no answer in time
  exit_refused = 4,       ///< login, rights or a lock
  exit_device_error = 5,  ///< the service answered with an error
};

/// A request that makes no sense for the service at hand: exit_usage.
class NotUnderstood : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What all these commands take.
struct RemoteOptions {
  std::string url;
  std::string user;
  double timeout = 10;  ///< in s
  bool is_json = false;
};

CLI::Option* add_url(CLI::App& app, RemoteOptions& options);
/// The option's URL may begin with ws or wss, as those that pages connect to: it is read as http or https.
CLI::Option* takes_websocket_url(CLI::Option* option);
/// --user, --timeout.
void add_connection_options(CLI::App& app, RemoteOptions& options);
CLI::Option* add_json(CLI::App& app, RemoteOptions& options);
/// A whole number from 1 on.
CLI::Option* add_count(CLI::App& app, const std::string& name, std::uint32_t& count, const std::string& summary);

/// That of --user: $RRGATE_PASSWORD. Throws   NotUnderstood: there is none.
std::string user_password();

/// How a service is reached. The password of --user is that of $RRGATE_PASSWORD; without --user, a gateway's token is
/// that of $RRGATE_TOKEN. Where neither is given, a gateway's login is the stored one.
struct RemoteAddress {
  std::string url;  ///< a Robot Raconteur URL
  rr::ConnectOptions options = {};
  std::chrono::milliseconds timeout{10'000};
};

/// Of a Robot Raconteur URL, or of a gateway's "http(s)://HOST:PORT/devices/NAME?service=SERVICE" or the dashboard's
/// "http(s)://HOST:PORT/#/devices/NAME/SERVICE", where the login is the gateway's. Throws   NotUnderstood.
RemoteAddress remote_address(const RemoteOptions& options);
/// Throws   NotUnderstood; rr::Exception.
rr::RemoteObject open_service(const RemoteAddress& address);
/// "http://h:1/devices/arm?service=Arm" of the dashboard's "http://h:1/#/devices/arm/Arm", "http://h:1/devices/arm" of
/// "http://h:1/#/devices/arm"; other URLs, and those of an object's page, as they are.
std::string address_of_page(std::string_view url);
/// "rr+ws://h:1/devices/arm?service=Arm" of "http://h:1/devices/arm?service=Arm"; empty for URLs of other schemes.
std::string gateway_url(std::string_view url);
/// "http://h:1/robots" of "http://h:1/robots/devices/arm?service=Arm": by what a gateway goes, a path prefix included.
std::string gateway_base(std::string_view url);
/// The gateway's own service (org.rrgate.gateway). `address`  of anything at the gateway.
rr::RemoteObject open_gateway(RemoteAddress address);

/// A member, or with null the object itself.
struct RemoteMember {
  rr::RemoteObject object;
  const rr::EntityDefinition* type = nullptr;
  const rr::MemberDefinition* member = nullptr;

  const rr::TypeRegistry& types() const { return object.connection().asynchronous().session().types(); }
};

/// Walks from the root object along a path as HTTP has it: "axes/0/position". Throws   NotUnderstood: no such member;
/// ClientException.
RemoteMember find_member(const rr::RemoteObject& root, std::string_view path);
/// Throws   NotUnderstood: it is of no kind that is listed.
void expect_kind(const RemoteMember& found, const std::vector<rr::MemberKind>& kinds, std::string_view verb);

/// JSON as it was written, of a file ("@name") or of standard input ("-"); other text where the type takes text.
/// Throws   NotUnderstood.
rr::Json read_json_argument(std::string_view text, const rr::TypeDefinition& type);
/// Throws   rr::Exception: text of the device that is not UTF-8.
rr::OrderedJson to_json(const rr::Value& value, const rr::TypeDefinition& type, const rr::TypeRegistry& types);
/// Text of a device as it is; printable() where standard output is a terminal, with its line ends.
std::string text_for_output(const std::string& text);
/// For people: text without quotes, structures over several lines. With --json: one line.
void print_value(const rr::OrderedJson& json, bool is_json);

/// One of RemoteExitCode, or exit_usage.
int exit_code_of(const rr::Exception& failure);
/// Runs a command: what it throws becomes one sentence and an exit code. Without `run`'s throwing: exit_ok.
int run_remote(std::string_view command, std::string_view url, const std::function<void()>& run);

}  // namespace rrgate
