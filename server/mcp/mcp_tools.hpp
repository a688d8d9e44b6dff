// What agents can do, one tool each. Layer: server/mcp. See docs/mcp.md.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "server/access/standing.hpp"
#include "server/mcp/mcp_image.hpp"
#include "server/mcp/mcp_reply.hpp"
#include "server/socket/json_members.hpp"

namespace rrgate {

/// For one request.
class McpTools {
 public:
  McpTools(GatewayState& gateway, McpReply& reply)
      : gateway_(gateway), reply_(reply), standing_(gateway.access(), reply.request().identity) {}

  /// The result of tools/list. The same for all devices: nothing of theirs is in it.
  static rr::OrderedJson list();
  /// Whether there is such a tool, and it does more than read.
  static bool is_command(std::string_view name);
  /// The result of tools/call: what a tool can't do is one too. nullopt: there is no such tool.
  /// `arguments`  borrowed for the wait.
  rr::awaitable<std::optional<rr::OrderedJson>> call(const std::string& name, const rr::Json& arguments);

  /// The image that stands beside the answer; null: there is none.
  const McpImage* image() const { return image_ ? &*image_ : nullptr; }

  /// What there is to read, by its URI: "rrgate://DEVICE", "rrgate://DEVICE/PATH", or of a recording (see
  /// mcp_recordings.hpp). Throws   rr::Exception.
  rr::awaitable<rr::OrderedJson> read_resource(const std::string& uri);
  /// Tells the client what changes of resources and of their list, until it goes, or may not any more. Throws
  /// rr::Exception. `wanted`  what it wants to hear of; borrowed for the wait. `id`  of the request.
  rr::awaitable<void> listen(const rr::Json& wanted, rr::OrderedJson id);
  /// The same for what its session has subscribed to, which may change meanwhile. What it has not been told of before
  /// may have changed.
  rr::awaitable<void> tell_session(const AgentSubscriptions::Stream& session);
  /// What it can be told of. Throws   rr::Exception.
  rr::awaitable<void> expect_changing(std::string uri);
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
    bool is_command = false;
  };
  static const Tool tools[];

  Answer devices(JsonRequestPtr arguments);
  Answer describe(JsonRequestPtr arguments);
  Answer read(JsonRequestPtr arguments);
  Answer wait_for_event(JsonRequestPtr arguments);
  Answer watch(JsonRequestPtr arguments);
  Answer call_function(JsonRequestPtr arguments);
  Answer set_property(JsonRequestPtr arguments);
  Answer stop(JsonRequestPtr arguments);

  const Identity& who() const { return reply_.request().identity; }
  /// Throws   rr::Exception: there is no right to anything of it, or it is not there.
  Device& find_device(const std::string& name, const std::string& service);
  /// Where "device" and "path" lead to. The words of errors behind it are the gateway's, until the device is asked.
  /// Throws   rr::Exception.
  /// `is_urgent`  past the rates of the device.
  rr::awaitable<TargetPtr> find(JsonRequestPtr arguments, bool is_urgent = false);
  /// Throws   rr::Exception: there is no right to it, or it can't be recorded.
  AuditEntryPtr admit(const Target& target, Verb verb);
  /// The same for what is not recorded.
  void allow(const Target& target, Verb verb);
  /// For who waits: he still may. Throws   rr::Exception.
  void go_on(const Target& target, Verb verb);

  // mcp_reading.cpp. All throw   rr::Exception.

  Answer read_target(JsonRequestPtr arguments, TargetPtr target);
  /// Adds what a device has said: under "from_device", or as an image beside the answer.
  rr::awaitable<void> add_value(rr::OrderedJson& answer, const Target& target, const rr::Value& value);

  rr::awaitable<rr::OrderedJson> read_recording(const std::string& uri);  // mcp_recordings.cpp

  // mcp_listen.cpp. All throw   rr::Exception.

  struct Followed;
  using FollowedPtr = std::shared_ptr<Followed>;
  struct Listening;
  rr::awaitable<FollowedPtr> follow(std::string uri);
  /// The same where many are to be followed. Throws   rr::Exception: the client has gone. Errors   why it can't be.
  rr::awaitable<rr::Result<FollowedPtr>> try_to_follow(std::string uri);
  /// These instead of those so far.
  rr::awaitable<void> follow_again(Listening& listening, std::set<std::string> uris);
  /// Whether there is news, and it is time to tell it.
  bool look(Listening& listening);
  void look_at(const FollowedPtr& followed);
  bool look_at_list(Listening& listening);
  rr::awaitable<void> tell_news(Listening& listening);

  // mcp_commands.cpp. All throw   rr::Exception.

  struct Command;
  Answer command(JsonRequestPtr arguments, Verb verb);
  /// A command may be given now; on these terms.
  AgentTerms judge(const Command& command);
  /// Waits until a person has allowed it.
  rr::awaitable<void> ask_person(const Command& command);
  /// Gives the command, under the lease where the terms say so, and holds that.
  Answer give(const Command& command, const AgentTerms& terms);
  using OnAnswer = std::function<void(const rr::Result<rr::Value>&)>;
  /// Asks the device for a part of a command. `check`  throws where it must not go on; borrowed for the wait.
  /// `on_answer`  called when the device answers, though nobody may wait for it any more. Nothing: not in time.
  rr::awaitable<std::optional<rr::Result<rr::Value>>> ask(ValueClient& client, rr::Called called,
                                                          std::chrono::milliseconds longest,
                                                          const std::function<void()>& check, OnAnswer on_answer);
  /// What the device answers to being made safe. Nothing: not yet, or it is not known.
  rr::awaitable<std::optional<rr::Result<>>> wait_for_answer(SafeAnswerPtr safe);
  /// All that a generator gives, up to as many as are wanted.
  Answer run_generator(const Command& command, std::shared_ptr<ValueClient> client, const std::function<void()>& check,
                       AuditEntryPtr entry);

  GatewayState& gateway_;
  McpReply& reply_;
  Standing standing_;
  std::optional<RateGate::Pass> pass_;
  std::optional<McpImage> image_;
  bool has_asked_device_ = false;  ///< errors from then on may be in the device's words
};

/// A whole number from 1 to `most`. Throws   rr::Exception, invalid_argument.
std::size_t count_of(const rr::Json& given, std::string_view name, std::size_t most);

inline constexpr std::string_view device_scheme = "rrgate://";

/// What a URI of a device's resource names. `path`  empty: the device itself.
struct ResourceName {
  std::string device;
  std::string path;
};
/// Throws   rr::Exception: it is no such URI.
ResourceName parse_resource(const std::string& uri);
/// As the tools take it. Throws   rr::Exception.
JsonRequestPtr request_of(const ResourceName& resource);

/// By the gateway's clock; of any time that a device may say.
std::int64_t age_ms(const rr::TimeSpec& time, std::chrono::system_clock::time_point now);

/// Why an answer to a command that the device has carried out, which stands under "sent", has not all of its result.
inline constexpr std::string_view result_left_out = "result_left_out";

/// {"content": ..., "structuredContent": ...}. A result that is too long is an error, but of a command that was sent.
/// `image`  beside the result; null: there is none.
rr::OrderedJson tool_result(rr::OrderedJson result, bool is_error, const McpImage* image = nullptr);

}  // namespace rrgate
