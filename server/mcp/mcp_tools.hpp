// What agents can do, one tool each. Layer: server/mcp. See docs/mcp.md.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/mcp/mcp_reply.hpp"
#include "server/socket/json_members.hpp"

namespace rrgate {

/// For one request.
class McpTools {
 public:
  McpTools(GatewayState& gateway, McpReply& reply) : gateway_(gateway), reply_(reply) {}

  /// The result of tools/list. The same for all devices: nothing of theirs is in it.
  static rr::OrderedJson list(const McpConfig& config);
  /// The result of tools/call: what a tool can't do is one too. nullopt: there is no such tool.
  /// `arguments`  borrowed for the wait.
  rr::awaitable<std::optional<rr::OrderedJson>> call(const std::string& name, const rr::Json& arguments);

  /// What there is to read, by its URI, "rrgate://DEVICE" or "rrgate://DEVICE/PATH". Throws   rr::Exception.
  rr::awaitable<rr::OrderedJson> read_resource(const std::string& uri);

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

  const Identity& who() const { return reply_.request().identity; }
  /// Throws   rr::Exception: there is no right to anything of it, or it is not there.
  Device& find_device(const std::string& name, const std::string& service);
  /// Where "device" and "path" lead to. Throws   rr::Exception.
  rr::awaitable<TargetPtr> find(JsonRequestPtr arguments);
  /// Throws   rr::Exception: there is no right to it, or it can't be recorded.
  AuditEntryPtr admit(const Target& target, Verb verb);
  Answer read_target(JsonRequestPtr arguments, TargetPtr target);

  GatewayState& gateway_;
  McpReply& reply_;
  std::optional<RateGate::Pass> pass_;
  bool has_asked_device_ = false;  ///< errors from then on may be in the device's words
};

/// {"content": ..., "structuredContent": ...}
rr::OrderedJson tool_result(rr::OrderedJson result, bool is_error);

}  // namespace rrgate
