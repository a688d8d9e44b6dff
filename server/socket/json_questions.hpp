// What a device asks a client of a JSON WebSocket by callbacks, until it is answered. Layer: server/socket. See
// docs/http-api.md.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "server/limits/outbox.hpp"
#include "server/socket/json_members.hpp"

namespace rrgate {

/// What a device hears whose question nobody can answer any more.
rr::Error client_gone();

/// Belongs to the socket's JsonOperations. For the gateway's thread.
class JsonQuestions {
 public:
  using Reply = rr::ClientConnection::CallbackReply;

  JsonQuestions(boost::asio::any_io_executor executor, rr::JsonForm form, std::shared_ptr<Outbox> outbox);

  /// Asks the client. `id`  of its request for the callback; `target`  the callback, without a client.
  /// Replies   also out_of_system_resource: too many wait; operation_timeout: it has not answered in time.
  void ask(const std::string& id, const TargetPtr& target, std::span<const rr::Value> arguments, Reply reply);
  /// Takes the client's answer. Throws   rr::Exception: to no question, or it is no value of the callback's type.
  void answer(const JsonRequest& request);
  /// What waits of one callback is answered with `why`.
  void end_of(std::string_view path, std::string_view member, const rr::Error& why);
  /// The client has gone.
  void end_all();

 private:
  struct Question;

  boost::asio::any_io_executor executor_;
  rr::JsonForm form_;
  std::shared_ptr<Outbox> outbox_;
  std::map<std::int64_t, std::shared_ptr<Question>> waiting_;
  std::int64_t last_ = 0;
};

}  // namespace rrgate
