// What agents can do, one tool each. Layer: server/mcp. See docs/mcp.md.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/access/standing.hpp"
#include "server/mcp/mcp_reply.hpp"
#include "server/socket/json_members.hpp"

namespace rrgate {

/// For one request.
class McpTools {
 public:
  McpTools(GatewayState& gateway, McpReply& reply)
      : gateway_(gateway), reply_(reply), standing_(gateway.access(), reply.request().identity) {}

  /// The result of tools/list. The same for all devices: nothing of theirs is in it.
  static rr::OrderedJson list(const McpConfig& config);
  /// The result of tools/call: what a tool can't do is one too. nullopt: there is no such tool.
  /// `arguments`  borrowed for the wait.
  rr::awaitable<std::optional<rr::OrderedJson>> call(const std::string& name, const rr::Json& arguments);

  /// What there is to read, by its URI, "rrgate://DEVICE" or "rrgate://DEVICE/PATH". Throws   rr::Exception.
  rr::awaitable<rr::OrderedJson> read_resource(const std::string& uri);
  /// What an agent is told of an error: {"name", "message"}; where the words may be the device's, they stand under
  /// "from_device".
  rr::OrderedJson error_for_agent(const rr::Error& error) const;
  /// Whether the words of an error may be the device's.
  bool has_asked_device() const { return has_asked_device_; }

 private:
  using Answer = rr::awaitable<rr::OrderedJson>;
  using Perform = Answer (McpTools::*)(JsonRequestPtr arguments);
  struct Tool {
    std::string_view name;
    const char* definition;  ///< JSON, but for the name
    Perform perform;
  };
  static const Tool tools[];

  Answer devices(JsonRequestPtr arguments);
  Answer describe(JsonRequestPtr arguments);
  Answer read(JsonRequestPtr arguments);
  Answer wait_for_event(JsonRequestPtr arguments);
  Answer call_function(JsonRequestPtr arguments);
  Answer set_property(JsonRequestPtr arguments);
  Answer stop(JsonRequestPtr arguments);

  const Identity& who() const { return reply_.request().identity; }
  /// Throws   rr::Exception: there is no right to anything of it, or it is not there.
  Device& find_device(const std::string& name, const std::string& service);
  /// Where "device" and "path" lead to. Throws   rr::Exception.
  /// `is_urgent`  past the rates of the device.
  rr::awaitable<TargetPtr> find(JsonRequestPtr arguments, bool is_urgent = false);
  /// Throws   rr::Exception: there is no right to it, or it can't be recorded.
  AuditEntryPtr admit(const Target& target, Verb verb);
  /// The same for what is not recorded.
  void allow(const Target& target, Verb verb);
  /// For who waits: he still may. Throws   rr::Exception.
  void go_on(const Target& target, Verb verb);
  Answer read_target(JsonRequestPtr arguments, TargetPtr target);

  // mcp_commands.cpp. All throw   rr::Exception.

  struct Command;
  Answer command(JsonRequestPtr arguments, Verb verb);
  /// A command may be given now; on these terms.
  AgentTerms judge(const Command& command);
  /// Waits until a person has allowed it.
  rr::awaitable<void> ask_person(const Command& command);
  /// Gives the command, under the lease where the terms say so, and holds that.
  Answer give(const Command& command, const AgentTerms& terms);

  GatewayState& gateway_;
  McpReply& reply_;
  Standing standing_;
  std::optional<RateGate::Pass> pass_;
  bool has_asked_device_ = false;  ///< errors from then on may be in the device's words
};

/// By the gateway's clock; of any time that a device may say.
std::int64_t age_ms(const rr::TimeSpec& time, std::chrono::system_clock::time_point now);

/// {"content": ..., "structuredContent": ...}
rr::OrderedJson tool_result(rr::OrderedJson result, bool is_error);

}  // namespace rrgate
