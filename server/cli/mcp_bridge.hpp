// Messages of the Model Context Protocol between lines and /mcp of a gateway. Layer: server/cli. See docs/mcp.md.
// Source: modelcontextprotocol.io, revisions 2025-06-18 to 2026-07-28, "stdio" and "Streamable HTTP".
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "node/transport/byte_stream.hpp"
#include "node/transport/http_headers.hpp"
#include "node/transport/watchdog.hpp"
#include "server/json/json.hpp"

namespace rrgate {

/// Where messages go: each by a connection of its own, whose end cancels it.
struct McpServer {
  std::function<rr::awaitable<rr::Result<std::unique_ptr<rr::ByteStream>>>()> connect;
  std::string authority;  ///< host[:port]
  std::string path = "/mcp";
  rr::HttpHeaders headers = {};
};

/// For one thread.
class McpBridge {
 public:
  /// `tell`   takes each message for the client, as a line without its end.
  /// `ended`  called once, after end(), when nothing goes on any more.
  McpBridge(boost::asio::any_io_executor executor, McpServer server, std::function<void(std::string_view line)> tell,
            std::function<void()> ended);

  /// A message of the client.
  void take(std::string_view line);
  /// The client has no more to say: what still goes on after a second is cancelled, as it would be if it had gone.
  void end();

 private:
  struct Message;
  struct Subscription;
  void subscribe(const rr::OrderedJson& id, const std::string& uri);
  void listen(const std::shared_ptr<Subscription>& subscription);
  void unsubscribe(const rr::OrderedJson& id, const std::string& uri);
  rr::awaitable<void> keep_listening(std::shared_ptr<Subscription> subscription);
  /// Refuses what is not answered yet, and ends it.
  void give_up(Subscription& subscription, int code, std::string_view why);
  void take_news(Subscription& subscription, const rr::Json& news);
  rr::awaitable<void> carry(std::shared_ptr<Message> message);
  rr::awaitable<rr::Result<>> exchange(Message& message);
  rr::Result<> pass_on(Message& message, unsigned status, std::string body);
  void answer(Message& message, std::string text);
  void answer_empty(const rr::OrderedJson& id);
  void refuse(const rr::OrderedJson& id, int code, std::string_view why);
  void cancel(const std::string& id);
  std::string request_of(const Message& message) const;

  boost::asio::any_io_executor executor_;
  McpServer server_;
  std::function<void(std::string_view)> tell_;
  std::function<void()> ended_;
  std::multimap<std::string, std::shared_ptr<Message>> under_way_;  ///< by the JSON of their ids; "null" without one
  std::string revision_;                                            ///< that "initialize" came to
  std::map<std::string, std::shared_ptr<Subscription>> subscriptions_;  ///< by URI
  std::shared_ptr<Subscription> list_;                                  ///< to the list of resources, once agreed
  rr::Deadline grace_;
  bool is_ending_ = false;
};

}  // namespace rrgate
