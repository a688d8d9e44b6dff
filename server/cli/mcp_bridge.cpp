#include "server/cli/mcp_bridge.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <iostream>

#include "node/http/response_reader.hpp"

namespace rrgate {

namespace {

constexpr std::size_t most_at_once = 64;
/// Of an answer: twice what the gateway gives, as text and as JSON, and an image.
constexpr std::size_t largest_answer = 4u * 1024 * 1024;
/// The gateway says something every ten seconds as long as it works on a request.
constexpr std::chrono::seconds longest_silence{60};
constexpr std::chrono::seconds last_grace{1};

constexpr int parse_error = -32700;
constexpr int internal_error = -32603;
constexpr int resource_not_found = -32002;

/// Which has requests that are answered with news.
constexpr const char* listening_revision = "2026-07-28";
constexpr const char* list_changed = "notifications/resources/list_changed";
constexpr const char* resource_updated = "notifications/resources/updated";
/// After a cut; twice as long each time, until something is told: the gateway records each refusal.
constexpr std::chrono::seconds first_pause{1};
constexpr std::chrono::seconds longest_pause{60};

/// What a member of an object says as text; empty where it is none.
std::string text_in(const rr::Json& json, std::initializer_list<const char*> keys) {
  const auto* at = &json;
  for (const auto* key : keys) {
    const auto found = at->is_object() ? at->find(key) : at->end();
    if (!at->is_object() || found == at->end()) return {};
    at = &*found;
  }
  return at->is_string() ? at->get<std::string>() : std::string();
}

/// May stand in a header.
bool is_plain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

std::string trimmed(std::string text) {
  // White space of JSON alone: a line is a message.
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::replace(text.begin(), text.end(), '\r', ' ');
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

}  // namespace

struct McpBridge::Message {      // NOLINT(bugprone-exception-escape): JSON's null throws nothing
  rr::OrderedJson id = nullptr;  ///< null: a notification; nobody waits for an answer
  std::string method = {};
  std::string revision = {};  ///< that the message says it is of; empty: as agreed
  std::string text = {};
  rr::ByteStream* stream = nullptr;
  bool is_cancelled = false;
  bool is_answered = false;
  std::function<void(const rr::Json&)> take = {};  ///< takes what comes, in the place of the client
};

/// To what changes of a resource, of a client whose revision has a request for that, or of the list of resources: it is
/// carried as the newest revision has it, a request that is answered for as long as its connection lasts, and made anew
/// after each cut.
struct McpBridge::Subscription {
  Subscription(const boost::asio::any_io_executor& executor, std::string of) : uri(std::move(of)), again(executor) {}

  std::vector<rr::OrderedJson> unanswered = {};  ///< ids of the client's requests
  std::string uri;                               ///< empty: of the list
  Message listening = {};
  boost::asio::steady_timer again;
  std::chrono::seconds pause = first_pause;
  bool has_begun = false;
  bool is_over = false;

  const char* kind() const { return uri.empty() ? "resourcesListChanged" : "resourceSubscriptions"; }
  rr::OrderedJson wanted() const {
    if (uri.empty()) return true;
    return rr::OrderedJson::array({uri});
  }
  rr::OrderedJson news() const {
    if (uri.empty()) return {{"jsonrpc", "2.0"}, {"method", list_changed}};
    return {{"jsonrpc", "2.0"}, {"method", resource_updated}, {"params", {{"uri", uri}}}};
  }
  void end() {
    is_over = listening.is_cancelled = true;
    again.cancel();
    if (listening.stream) listening.stream->close();
  }
};

McpBridge::McpBridge(boost::asio::any_io_executor executor, McpServer server,
                     std::function<void(std::string_view)> tell, std::function<void()> ended)
    : executor_(std::move(executor)),
      server_(std::move(server)),
      tell_(std::move(tell)),
      ended_(std::move(ended)),
      grace_(executor_, [this] {
        for (const auto& [id, message] : under_way_) {
          message->is_cancelled = true;
          if (message->stream) message->stream->close();
        }
      }) {}

void McpBridge::take(std::string_view line) {
  if (line.find_first_not_of(" \t\r") == std::string_view::npos) return;
  const auto json = rr::read_json(line);
  if (!json) return refuse(nullptr, parse_error, json.error().message);
  const auto message = std::make_shared<Message>();
  message->text = line;
  message->method = text_in(*json, {"method"});
  message->revision = text_in(*json, {"params", "_meta", "io.modelcontextprotocol/protocolVersion"});
  const auto id_of = [](const rr::Json& object, const char* key) {
    const auto found = object.is_object() ? object.find(key) : object.end();
    return object.is_object() && found != object.end() ? rr::OrderedJson(*found) : rr::OrderedJson();
  };
  if (!message->method.empty()) message->id = id_of(*json, "id");
  if (!is_plain(message->method) || !is_plain(message->revision))
    return refuse(message->id, parse_error, "neither a method nor a revision has other characters than ASCII's");
  // The end of the request's connection tells the gateway.
  if (message->method == "notifications/cancelled" && json->contains("params"))
    return cancel(id_of((*json)["params"], "requestId").dump());
  if (message->method == "resources/subscribe" && message->revision.empty())
    return subscribe(message->id, text_in(*json, {"params", "uri"}));
  if (message->method == "resources/unsubscribe" && message->revision.empty())
    return unsubscribe(message->id, text_in(*json, {"params", "uri"}));
  if (under_way_.size() >= most_at_once)
    return refuse(message->id, internal_error,
                  "more than " + std::to_string(most_at_once) + " messages at once; wait for answers");
  under_way_.emplace(message->id.dump(), message);
  boost::asio::co_spawn(executor_, carry(message), [this, message](const std::exception_ptr& failure) {
    if (failure && !message->is_answered) refuse(message->id, internal_error, "the message could not be carried");
    std::erase_if(under_way_, [&](const auto& each) { return each.second == message; });
    if (is_ending_ && under_way_.empty()) ended_();
  });
}

void McpBridge::end() {
  is_ending_ = true;
  for (const auto& [uri, subscription] : subscriptions_) subscription->end();
  if (list_) list_->end();
  if (under_way_.empty()) return ended_();
  grace_.arm(last_grace);
}

void McpBridge::cancel(const std::string& id) {
  const auto [first, last] = under_way_.equal_range(id);
  for (auto it = first; it != last; ++it) {
    auto& message = *it->second;
    if (message.id.is_null()) continue;
    message.is_cancelled = true;
    if (message.stream) message.stream->close();
  }
}

void McpBridge::subscribe(const rr::OrderedJson& id, const std::string& uri) {
  if (const auto found = subscriptions_.find(uri); found != subscriptions_.end()) {
    auto& subscription = *found->second;
    if (subscription.has_begun) return answer_empty(id);
    if (subscription.unanswered.size() >= most_at_once)
      return refuse(id, internal_error, "more than " + std::to_string(most_at_once) + " messages at once");
    return subscription.unanswered.push_back(id);
  }
  if (subscriptions_.size() >= most_at_once)
    return refuse(id, internal_error, "more than " + std::to_string(most_at_once) + " subscriptions");
  const auto made = std::make_shared<Subscription>(executor_, uri);
  made->unanswered.push_back(id);
  subscriptions_[uri] = made;
  listen(made);
}

void McpBridge::listen(const std::shared_ptr<Subscription>& made) {
  made->listening.id = 1;
  made->listening.method = "subscriptions/listen";
  made->listening.revision = listening_revision;
  made->listening.text = rr::write_json({{"jsonrpc", "2.0"},
                                         {"id", made->listening.id},
                                         {"method", made->listening.method},
                                         {"params",
                                          {{"_meta", {{"io.modelcontextprotocol/protocolVersion", listening_revision}}},
                                           {"notifications", {{made->kind(), made->wanted()}}}}}});
  made->listening.take = [this, &subscription = *made](const rr::Json& news) { take_news(subscription, news); };
  boost::asio::co_spawn(executor_, keep_listening(made), boost::asio::detached);
}

void McpBridge::unsubscribe(const rr::OrderedJson& id, const std::string& uri) {
  if (const auto found = subscriptions_.find(uri); found != subscriptions_.end())
    give_up(*found->second, internal_error, "the resource was unsubscribed from before the gateway had answered");
  answer_empty(id);
}

rr::awaitable<void> McpBridge::keep_listening(std::shared_ptr<Subscription> subscription) {
  while (!subscription->is_over) {
    const auto done = co_await exchange(subscription->listening);
    subscription->listening.stream = nullptr;
    if (subscription->is_over) break;
    if (!subscription->unanswered.empty()) {
      give_up(*subscription, resource_not_found, done ? "the gateway has ended its answer" : done.error().message);
      break;
    }
    subscription->again.expires_after(subscription->pause);
    subscription->pause = std::min(2 * subscription->pause, longest_pause);
    co_await subscription->again.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
  }
}

void McpBridge::take_news(Subscription& subscription, const rr::Json& news) {
  const auto method = text_in(news, {"method"});
  const auto& uri = subscription.uri;
  if (method == "notifications/subscriptions/acknowledged") {
    const bool is_told = news["params"]["notifications"].contains(subscription.kind());
    const bool is_first = !std::exchange(subscription.has_begun, true);
    const bool is_awaited = !subscription.unanswered.empty();
    if (is_told) subscription.pause = first_pause;
    if (is_awaited && !is_told)
      return give_up(subscription, resource_not_found, "there is no " + rr::quote(uri) + " whose changes can be told");
    for (const auto& id : std::exchange(subscription.unanswered, {})) answer_empty(id);
    if (is_awaited) return;
    if (!is_told) return subscription.listening.stream->close();  // not there yet
    if (uri.empty() && is_first) return;
  } else if (method != resource_updated && method != list_changed) {
    const auto why = text_in(news, {"error", "message"});
    if (!why.empty() && !subscription.unanswered.empty()) give_up(subscription, resource_not_found, why);
    if (!why.empty() && uri.empty() && !subscription.has_begun) subscription.end();  // an older gateway
    return;
  }
  // After a cut nobody knows whether it has changed.
  tell_(rr::write_json(subscription.news()));
}

void McpBridge::give_up(Subscription& subscription, int code, std::string_view why) {
  for (const auto& id : std::exchange(subscription.unanswered, {})) refuse(id, code, why);
  subscription.end();
  subscriptions_.erase(subscription.uri);
}

void McpBridge::answer_empty(const rr::OrderedJson& id) {
  tell_(rr::write_json({{"jsonrpc", "2.0"}, {"id", id}, {"result", rr::OrderedJson::object()}}));
}

rr::awaitable<void> McpBridge::carry(std::shared_ptr<Message> message) {
  const auto done = co_await exchange(*message);
  message->stream = nullptr;
  if (message->is_cancelled || message->is_answered) co_return;
  const auto why = done ? std::string("the gateway has ended its answer before it was whole") : done.error().message;
  if (!message->id.is_null())
    refuse(message->id, internal_error, why);
  else if (!done)
    std::cerr << "rrgate mcp: " << message->method << ": " << why << "\n";
}

rr::awaitable<rr::Result<>> McpBridge::exchange(Message& message) {
  auto connected = co_await server_.connect();
  if (!connected) co_return connected.error();
  const auto stream = std::move(*connected);
  message.stream = stream.get();
  const struct Gone {
    rr::ByteStream*& stream;
    ~Gone() { stream = nullptr; }
  } gone{message.stream};
  if (message.is_cancelled) co_return rr::Result<>();
  rr::Deadline silence(executor_, [&stream] { stream->close(); });
  silence.arm(longest_silence);
  const auto request = request_of(message);
  const auto slice = rr::as_bytes(request);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  if (const auto error = co_await stream->write(slices))
    co_return rr::make_error(rr::ErrorCode::connection_error, error.message());

  ResponseParser parser;
  const std::function<void()> take_events = [&] {
    silence.arm(longest_silence);
    auto& response = parser.get();
    if (!std::string_view(response[boost::beast::http::field::content_type]).starts_with("text/event-stream")) return;
    auto& body = response.body();
    for (auto end = body.find("\n\n"); end != std::string::npos; end = body.find("\n\n")) {
      const auto data = body.find("data: ");
      if (data < end) answer(message, body.substr(data + 6, body.find('\n', data) - data - 6));
      body.erase(0, end + 2);
    }
  };
  if (auto read = co_await read_response(*stream, parser, largest_answer, take_events); !read) co_return read;
  co_return pass_on(message, parser.get().result_int(), std::move(parser.get().body()));
}

/// What is no event stream, or is left of one.
rr::Result<> McpBridge::pass_on(Message& message, unsigned status, std::string body) {
  if (message.is_answered || status == 202) return {};
  auto json = rr::read_json(body);
  const auto fail = [&](const std::string& why) {
    return rr::make_error(rr::ErrorCode::connection_error, "the gateway answers " + std::to_string(status) + why);
  };
  if (!json || !json->is_object()) return fail("");
  if (!json->contains("jsonrpc")) {
    const auto detail = text_in(*json, {"detail"});
    return fail(detail.empty() ? "" : ": " + detail);
  }
  if (message.id.is_null() && !message.method.empty())
    return status < 400 ? rr::Result<>() : fail(": " + text_in(*json, {"error", "message"}));
  if ((*json)["id"].is_null()) {  // refused before it was read
    (*json)["id"] = message.id;
    body = json->dump();
  }
  answer(message, std::move(body));
  return {};
}

/// A message of the gateway: the answer, or what comes before it.
void McpBridge::answer(Message& message, std::string text) {
  if (message.is_cancelled || message.is_answered) return;
  const auto json = rr::read_json(text);
  if (!json || !json->is_object()) return;
  if (message.take) return message.take(*json);
  if (!json->contains("method")) message.is_answered = true;
  if (message.method == "initialize") revision_ = text_in(*json, {"result", "protocolVersion"});
  tell_(trimmed(std::move(text)));
  if (message.method == "initialize" && !revision_.empty() && !list_ && !is_ending_) {
    list_ = std::make_shared<Subscription>(executor_, "");
    listen(list_);
  }
}

void McpBridge::refuse(const rr::OrderedJson& id, int code, std::string_view why) {
  tell_(rr::write_json({{"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", code}, {"message", why}}}}));
}

std::string McpBridge::request_of(const Message& message) const {
  std::string out = "POST " + server_.path + " HTTP/1.1\r\nHost: " + server_.authority +
                    "\r\nContent-Type: application/json\r\nAccept: application/json, text/event-stream\r\n"
                    "User-Agent: rrgate\r\nConnection: close\r\nContent-Length: " +
                    std::to_string(message.text.size()) + "\r\n";
  const auto& revision = message.revision.empty() ? revision_ : message.revision;
  const bool is_first = message.method == "initialize";
  if (!revision.empty() && !is_first) out += "MCP-Protocol-Version: " + revision + "\r\n";
  if (!message.method.empty()) out += "Mcp-Method: " + message.method + "\r\n";
  for (const auto& [name, value] : server_.headers) out.append(name).append(": ").append(value).append("\r\n");
  return out + "\r\n" + message.text;
}

}  // namespace rrgate
