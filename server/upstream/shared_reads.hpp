// Reads of properties that several clients of a session share. Layer: server/upstream.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "node/client/client_connection.hpp"

namespace rrgate {

class UpstreamClient;

/// Whoever reads behind a command of its own hears what has come of that: no answer to what was asked before it.
class SharedReads {
 public:
  using Completion = rr::ClientConnection::Completion;
  using Key = std::pair<std::string, std::string>;  // path, property
  struct Read {
    Key key;
    std::uint64_t begun = 0;  ///< counts reads and commands
    std::vector<Completion> readers = {};
  };

  /// The client commands something.
  void note_command(const UpstreamClient& client) { commands_[&client] = ++last_step_; }
  void forget(const UpstreamClient& client) { commands_.erase(&client); }
  /// `done`  is called with the answer to a read. Null: one that is under way; else the device is to be asked for it,
  /// and handle_answer() to be told what it says.
  [[nodiscard]] std::shared_ptr<const Read> join(const UpstreamClient& client, const Key& key, Completion done);
  void handle_answer(const std::shared_ptr<const Read>& read, const rr::Result<rr::Value>& value);

 private:
  std::map<Key, std::shared_ptr<Read>> newest_;              ///< that others may join
  std::map<const UpstreamClient*, std::uint64_t> commands_;  ///< when each client has commanded something last
  std::uint64_t last_step_ = 0;
};

}  // namespace rrgate
