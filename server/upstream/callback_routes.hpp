// Which clients of a session a callback of the device is for. Layer: server/upstream.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "node/client/client_connection.hpp"
#include "server/config/config.hpp"

namespace rrgate {

class UpstreamClient;

class CallbackRoutes {
 public:
  using CallNumber = std::uint64_t;
  /// The client calls a function of this object, until end_call().
  CallNumber begin_call(UpstreamClient& client, const std::string& path);
  void end_call(CallNumber number);
  void forget(const UpstreamClient& client);

  /// Who of the `candidates`, which may answer a callback of an object, is asked for an answer. None where it could be
  /// several: it is not guessed who is asked, say, whether the robot may move.
  std::vector<UpstreamClient*> choose(const std::vector<CallbackRule>& rules, const std::string& path,
                                      const std::string& callback, std::vector<UpstreamClient*> candidates) const;

 private:
  struct Call {
    UpstreamClient* client = nullptr;
    std::string path;
    CallNumber number = 0;
  };
  std::vector<Call> calls_;  ///< oldest first
  CallNumber last_call_ = 0;
};

/// What each of `count` clients that are asked is given for its answer: the first value counts, or else the last error.
rr::ClientConnection::CallbackReply first_value(std::size_t count, rr::ClientConnection::CallbackReply answer);

}  // namespace rrgate
