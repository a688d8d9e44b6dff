// What agents want to be told of, where their revision of the protocol says so apart from the stream on which they are
// told. Layer: server/state. See docs/mcp.md.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "core/support/error.hpp"
#include "server/state/agent_table.hpp"

namespace rrgate {

/// By session, whose name nobody else knows. Sessions without a stream are forgotten when there are too many, those
/// that were used last at the end. For one thread.
class AgentSubscriptions {
  struct Session {
    std::string owner = {};
    std::set<std::string> uris = {};
    std::uint64_t changes = 0;
    std::chrono::steady_clock::time_point used = std::chrono::steady_clock::now();
    std::size_t streams = 0;

    // For AgentTable.
    auto rank() const { return used; }
    bool is_held() const { return streams > 0; }
  };
  using SessionPtr = std::shared_ptr<Session>;

 public:
  static constexpr std::size_t most_resources = 64;  ///< of a session
  static constexpr std::size_t most_sessions = 256;
  static constexpr std::size_t most_of_owner = 128;  ///< sessions, half of all: the others get theirs

  /// `owner`  whose the session is: a user, or the network of somebody whom nobody knows.
  /// Errors   out_of_system_resource: it has as many as it may have, or there are too many sessions with streams.
  rr::Result<> add(const std::string& session, const std::string& owner, const std::string& uri);
  void remove(const std::string& session, const std::string& uri);
  void end(const std::string& session);
  bool has(const std::string& session) const { return sessions_.find(session) != nullptr; }

  /// What a session's stream tells of, while there is one. Outlives this.
  class Stream {
   public:
    explicit Stream(SessionPtr session) : session_(std::move(session)) { ++session_->streams; }
    ~Stream() {
      --session_->streams;
      session_->used = std::chrono::steady_clock::now();
    }
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;
    const std::set<std::string>& uris() const { return session_->uris; }
    /// Another number whenever uris() has changed.
    std::uint64_t changes() const { return session_->changes; }

   private:
    SessionPtr session_;
  };
  /// Errors   out_of_system_resource.
  rr::Result<std::unique_ptr<Stream>> open_stream(const std::string& session, const std::string& owner);

 private:
  rr::Result<SessionPtr> find_or_make(const std::string& session, const std::string& owner);

  AgentTable<Session> sessions_;
};

}  // namespace rrgate
